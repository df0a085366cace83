import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenarios.errors import SceneInvalid
from scenarios.goal import ARITY, GoalError, goal_text, parse_goal

names = st.text("ab7_-", max_size=6).map(lambda rest: f"x{rest}")
literals = st.sampled_from(sorted(ARITY)).flatmap(
    lambda name: st.tuples(st.just(name), st.tuples(*[names] * ARITY[name]))
)


@settings(derandomize=True, max_examples=60, deadline=None)
@given(st.lists(literals, min_size=1, max_size=6, unique=True))
def test_a_goal_written_as_text_parses_back(goal):
    assert parse_goal(goal_text(goal)) == tuple(goal)


def test_case_blanks_comments_and_repetitions_do_not_matter():
    text = "(AND (in_bin mug\n crate) ; the mug\n (hand_empty) (in_bin  mug crate))"
    assert parse_goal(text) == (("in_bin", ("mug", "crate")), ("hand_empty", ()))
    assert parse_goal("(holding mug)") == (("holding", ("mug",)),)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "is empty"),
        ("(and)", "at least one literal"),
        ("()", "expected a predicate's name"),
        ("((in_bin) a b)", "expected a predicate's name"),
        ("mug", "stands alone"),
        ("(and mug)", "stands alone"),
        ("(and (in_bin mug crate)", "not closed"),
        ("(in_bin mug crate))", "closes nothing"),
        ("(in_bin mug crate) (hand_empty)", "expected one condition"),
        ("(not (holding mug))", "conjunction of positive literals"),
        ("(and (or (holding mug) (holding pea)))", "conjunction of positive literals"),
        ("(and (and (holding mug)))", "conjunction of positive literals"),
        ("(in_bim mug crate)", "did you mean 'in_bin'"),
        ("(in_bin mug)", "has 1 arguments, expected 2 names"),
        ("(holding mug pea)", "has 2 arguments, expected 1 name"),
        ("(holding (mug))", "expected 1 name"),
        ("(hand_empty mug)", "expected 0 names"),
        ("(" * 20_000, "more than 10000 words"),
    ],
)
def test_a_goal_that_is_no_conjunction_of_known_literals_is_refused(text, expected):
    with pytest.raises(GoalError) as error:
        parse_goal(text)
    assert expected in str(error.value)


@pytest.mark.parametrize(
    "pair",
    [
        "(holding mug) (holding pea)",
        "(holding mug) (hand_empty)",
        "(holding mug) (in_bin mug crate)",
        "(in_bin mug crate) (in_bin mug table)",
        "(in_bin mug table) (put_away mug)",
        "(put_away mug) (in_bin mug crate) (in_bin mug tray)",
    ],
)
def test_literals_that_exclude_each_other_are_refused(plain, build, pair):
    with pytest.raises(SceneInvalid, match=r"^scene\.yaml, goal, line 26: .*can't both be true"):
        build(plain.replace("clear-table", f"(and {pair})"))


def test_literals_that_agree_are_kept(plain, build):
    goal = "(and (put_away mug) (in_bin mug crate) (in_bin pea table) (hand_empty))"
    assert build(plain.replace("clear-table", goal)).goal == goal


def test_clear_table_puts_crumbs_in_the_dustpan_things_home_and_the_rest_away(plain, build):
    goal = parse_goal(build(plain).goal)
    assert goal == (("in_bin", ("mug", "crate")), ("in_bin", ("pea", "tray")), ("put_away", ("sponge",)))


def test_a_crumb_goes_to_the_dustpan_that_is_its_home_else_to_the_nearest(plain, build):
    second = "  pan2: {kind: dustpan, size: [0.3, 0.2, 0.05], pose: {xyz: [0.7, 0.6, -0.06]}, open_side: -y}\n"
    text = plain.replace("fixed:\n", second + "fixed:\n")
    assert ("in_bin", ("pea", "pan2")) in parse_goal(build(text).goal)
    at_home = text.replace("mass: 0.005", "mass: 0.005\n    home: tray")
    assert ("in_bin", ("pea", "tray")) in parse_goal(build(at_home).goal)


def _without(text: str, region: str) -> str:
    return "\n".join(line for line in text.splitlines() if not line.startswith(f"  {region}:"))


def test_clear_table_with_a_crumb_needs_a_dustpan(plain, build):
    on_table = plain.replace("{on: tray, xy: [0.7, -0.6]}", "{on: table, xy: [0.7, -0.3]}")
    with pytest.raises(SceneInvalid, match=r"goal, line 25: .*'pea' is a crumb, expected a dustpan"):
        build(_without(on_table, "tray"))


def test_clear_table_with_a_thing_without_home_needs_a_bin(plain, build):
    with pytest.raises(SceneInvalid, match="nowhere to put 'mug', expected a home or a bin"):
        build(_without(plain.replace("    home: crate\n", ""), "crate"))
