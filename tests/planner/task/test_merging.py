"""What is laid down and taken up again for nothing is merged."""

from dataclasses import replace
from pathlib import Path

import pytest

import skills
from planner.task.merging import merged
from planner.task.pddl_reader import read_domain, read_text
from planner.task.primitives import ground
from planner.task.symbols import Fact, Step, TaskPlan, flaw

CATALOGUE = read_domain(read_text(Path(skills.__file__).parent / "domain.pddl"))
SCHEMAS = {schema.name: schema for schema in CATALOGUE.actions}
PLACES = {"cup": "table", "sponge": "dustpan", "a": "table", "b": "table"}
START = frozenset(
    {Fact("in_bin", item) for item in PLACES.items()}
    | {Fact("graspable", (name,)) for name in ("cup", "sponge")}
    | {Fact("hand_empty"), Fact("is_sponge", ("sponge",))}
)
GOAL = frozenset(
    {Fact("in_bin", (crumb, "dustpan")) for crumb in "ab"}
    | {Fact("put_away", (n,)) for n in PLACES if n in ("cup", "sponge")}
)


def step(text: str) -> Step:
    name, *args = text.split()
    return ground(SCHEMAS[name], (*args, "sponge") if name == "wipe" else tuple(args))


def needing(text: str, *away: str) -> Step:
    plain = step(text)
    return replace(plain, preconditions=plain.preconditions | {Fact("away", (name,)) for name in away})


def plan(*steps: Step) -> TaskPlan:
    whole = TaskPlan(steps, GOAL)
    assert flaw(whole, START, GOAL) is None
    return whole


TAKE, LAY = step("pick sponge dustpan"), step("place sponge left_bin")
TAKE_AGAIN = step("pick sponge left_bin")
CUP = (step("pick cup table"), step("place cup right_bin"))
A, B = step("wipe a table dustpan"), step("wipe b table dustpan")


def test_what_was_begun_too_early_waits_for_what_comes_later():
    late = needing("wipe b table dustpan", "cup")
    shorter = merged(plan(TAKE, A, LAY, *CUP, TAKE_AGAIN, late, LAY), START)
    assert flaw(shorter, START, GOAL) is None
    assert len(shorter.steps) == 6
    assert shorter.steps.index(late) > shorter.steps.index(CUP[0])


def test_what_could_have_been_done_at_once_comes_earlier():
    cup = needing("pick cup table", "a")
    shorter = merged(plan(TAKE, A, LAY, cup, CUP[1], TAKE_AGAIN, B, LAY), START)
    assert [str(s.action) for s in shorter.steps] == [str(s.action) for s in (TAKE, A, B, LAY, cup, CUP[1])]


def test_two_visits_that_are_both_needed_stay():
    cup, late = needing("pick cup table", "a"), needing("wipe b table dustpan", "cup")
    whole = plan(TAKE, A, LAY, cup, CUP[1], TAKE_AGAIN, late, LAY)
    assert merged(whole, START) == whole


def test_three_visits_become_one():
    whole = plan(TAKE, A, LAY, TAKE_AGAIN, LAY, *CUP, TAKE_AGAIN, B, LAY)
    assert len(merged(whole, START).steps) == 6


def test_taking_something_up_to_put_it_elsewhere_is_no_pair_that_undoes_itself():
    whole = plan(*CUP, TAKE, A, B, LAY)
    assert merged(whole, START) == whole


@pytest.mark.parametrize("crumb", ["a", "b"])
def test_what_is_laid_aside_goes_where_it_belongs_at_once_if_that_will_do(crumb):
    aside = (step("pick cup table"), step("place--aside cup table"))
    wipe = needing(f"wipe {crumb} table dustpan", "cup")
    other = B if crumb == "a" else A
    assert len(merged(plan(*aside, TAKE, wipe, other, LAY, *CUP), START).steps) == 6
