"""Things that have to be put down for a while: on the table where nothing else will do, the sponge too."""

import pytest

from bt_tamp.executive.preview import preview
from bt_tamp.options import RunOptions
from planner.search_then_sample import Solution
from planner.task.facts import place_of
from scenarios.document import parse_document
from scenarios.load import build_scenario

TRAYS = """
version: 1
name: trays
robot: {{model: iiwa14_wsg50, base: {{xyz: [0, 0, 0]}}}}
table: {{size: [0.44, 0.68, 0.05], pose: {{xyz: [0.62, 0, 0.025]}}, friction: 0.5}}
{0}
"""

SWAP = """
regions:
  left_tray: {kind: bin, size: [0.15, 0.15, 0.04], pose: {xyz: [0.45, 0.45, 0.0]}}
  right_tray: {kind: bin, size: [0.15, 0.15, 0.04], pose: {xyz: [0.45, -0.45, 0.0]}}
objects:
  red: {shape: {box: [0.10, 0.05, 0.055]}, mass: 0.2, friction: 0.55, pose: {on: left_tray, xy: [0.45, 0.45]}}
  blue: {shape: {box: [0.10, 0.05, 0.055]}, mass: 0.2, friction: 0.55, pose: {on: right_tray, xy: [0.45, -0.45]}}
goal: (and (in_bin red right_tray) (in_bin blue left_tray))
"""

SPONGE_IN_THE_WAY = """
regions:
  tray: {kind: bin, size: [0.165, 0.165, 0.04], wall: 0.005, pose: {xyz: [0.45, 0.45, 0.0]}}
objects:
  box: {shape: {box: [0.13, 0.09, 0.055]}, mass: 0.2, friction: 0.55, pose: {on: table, xy: [0.6, 0.0]}}
tools:
  sponge:
    {kind: sponge, shape: {box: [0.09, 0.06, 0.04]}, mass: 0.06, friction: 0.5, pose: {on: tray, xy: [0.45, 0.45]}}
goal: (and (in_bin box tray))
"""


def solved(text: str) -> Solution:
    scenario = build_scenario(parse_document(TRAYS.format(text), "trays"))
    outcome = preview(scenario, RunOptions(), lambda kind, **data: None).outcome
    assert isinstance(outcome, Solution), outcome
    return outcome


def labels(solution: Solution) -> list[str]:
    return [str(action) for action in solution.plan.actions]


@pytest.fixture(scope="module")
def swap() -> Solution:
    return solved(SWAP)


def test_two_things_change_places_by_way_of_the_table(swap):
    assert [label for label in labels(swap) if "table" in label] in (
        ["place(red, table)", "pick(red, table)"],
        ["place(blue, table)", "pick(blue, table)"],
    )
    assert place_of(swap.scenes[-1], "red") == "right_tray"
    assert place_of(swap.scenes[-1], "blue") == "left_tray"


def test_no_more_is_put_aside_than_has_to_be(swap):
    assert len(swap.plan.steps) == 6


def test_the_sponge_is_put_on_the_table_when_it_lies_where_something_belongs():
    solution = solved(SPONGE_IN_THE_WAY)
    assert labels(solution) == ["pick(sponge, tray)", "place(sponge, table)", "pick(box, table)", "place(box, tray)"]
