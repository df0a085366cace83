"""Brackets and words of a PDDL text, each with its place in the file."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from scenarios.errors import one_line

MAX_CHARACTERS = 1_000_000
MAX_DEPTH = 20

_TOKEN = re.compile(r";[^\n]*|\s+|[()]|[^\s();]+")


class PddlError(Exception):
    """A PDDL text can't be used. `str` is one line: file, line, column, what is wrong, what was expected."""

    def __init__(self, message: str, file: str = "", at: "Position | None" = None) -> None:
        self.message = one_line(message)
        self.file = one_line(file)
        self.line, self.column = (at.line, at.column) if at else (0, 0)
        place = f"{self.file}:{self.line}:{self.column}" if at else self.file
        super().__init__(f"{place}: {self.message}" if place else self.message)


@dataclass(frozen=True)
class Position:
    """Where something stands in a text; lines and columns count from 1."""

    line: int
    column: int


@dataclass(frozen=True)
class Word:
    """A name, variable or keyword, in lower case: PDDL doesn't tell cases apart."""

    text: str
    at: Position


@dataclass(frozen=True)
class Group:
    """A pair of brackets and what is in it."""

    items: "tuple[Word | Group, ...]"
    at: Position


Node = Word | Group


def parse(text: str, file: str) -> Group:
    """The one bracketed expression that the text consists of. Raises PddlError naming `file`."""
    if len(text) > MAX_CHARACTERS:
        raise PddlError(f"has {len(text)} characters, expected at most {MAX_CHARACTERS}", file)
    stack: list[tuple[Position, list[Node]]] = []
    found: Group | None = None
    for token, at in _tokens(text):
        if found is not None:
            raise PddlError(f"{token!r} after the closing bracket, expected the end of the file", file, at)
        if token == "(":
            if len(stack) == MAX_DEPTH:
                raise PddlError(f"brackets nested deeper than {MAX_DEPTH}, expected a PDDL file", file, at)
            stack.append((at, []))
        elif not stack:
            raise PddlError(f"{token!r} outside brackets, expected '(define ...)'", file, at)
        elif token == ")":
            opened, items = stack.pop()
            group = Group(tuple(items), opened)
            if stack:
                stack[-1][1].append(group)
            else:
                found = group
        else:
            stack[-1][1].append(Word(token.lower(), at))
    if stack:
        raise PddlError("'(' is never closed, expected ')'", file, stack[-1][0])
    if found is None:
        raise PddlError("is empty, expected '(define ...)'", file)
    return found


def _tokens(text: str) -> Iterator[tuple[str, Position]]:
    line, start = 1, 0
    for match in _TOKEN.finditer(text):
        token = match[0]
        if not token[0].isspace() and token[0] != ";":
            yield token, Position(line, match.start() - start + 1)
        newlines = token.count("\n")
        if newlines:
            line += newlines
            start = match.start() + token.rindex("\n") + 1
