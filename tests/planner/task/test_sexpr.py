"""Brackets, words and their places."""

import pytest

from planner.task.sexpr import MAX_DEPTH, Group, PddlError, Position, Word, parse


def test_words_and_groups_know_their_line_and_column():
    root = parse("; a comment (\n(Define\n  (x ?y))", "f.pddl")
    assert root.at == Position(2, 1)
    assert root.items[0] == Word("define", Position(2, 2))
    inner = root.items[1]
    assert isinstance(inner, Group)
    assert inner.at == Position(3, 3)
    assert inner.items[1] == Word("?y", Position(3, 6))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "f.pddl: is empty, expected '(define ...)'"),
        (" ; only a comment\n", "f.pddl: is empty, expected '(define ...)'"),
        ("(a (b)", "f.pddl:1:1: '(' is never closed, expected ')'"),
        ("(a))", "f.pddl:1:4: ')' after the closing bracket, expected the end of the file"),
        ("a (b)", "f.pddl:1:1: 'a' outside brackets, expected '(define ...)'"),
        ("(a)\n (b)", "f.pddl:2:2: '(' after the closing bracket, expected the end of the file"),
        (
            "(" * 1000,
            f"f.pddl:1:{MAX_DEPTH + 1}: brackets nested deeper than {MAX_DEPTH}, expected a PDDL file",
        ),
        ("(" + "a " * 600_000, "f.pddl: has 1200001 characters, expected at most 1000000"),
    ],
)
def test_unbalanced_texts_are_refused_in_one_line(text, message):
    with pytest.raises(PddlError) as error:
        parse(text, "f.pddl")
    assert str(error.value) == message


def test_unprintable_characters_do_not_break_the_line():
    with pytest.raises(PddlError) as error:
        parse("\x00\x1b[2J\nx", "f.pddl")
    assert str(error.value).isprintable()
