"""The layouts of `bench wipe`, and what is made of their results."""

from dataclasses import replace

import numpy as np
import pytest

from bt_tamp.bench.crumbs import COUNT, CUBES, GRAIN_SIZES, GRAINS, PAN, SIDES, SPONGE, cubes, grains
from bt_tamp.bench.plots import plot_wipes
from bt_tamp.bench.wipe import WipeResult, acceptance
from bt_tamp.executive.preview import preview
from bt_tamp.options import RunOptions
from planner.search_then_sample import Solution
from planner.task.facts import observed_facts, place_of
from planner.task.symbols import Fact
from scenarios.goal import is_crumb
from scenarios.solids import body_solid, region_solid, table_solid
from scenarios.standing import overlap_problem
from sim.scene import SceneState


def test_every_layout_is_one_to_twelve_small_cubes_and_every_side_has_its_turn():
    made = list(cubes())
    assert len(made) == COUNT
    assert [layout.side for layout in made[:4]] == list(SIDES)
    assert {len(layout.edges) for layout in made} >= {1, 12}
    assert all(CUBES[0] <= edge <= CUBES[1] for layout in made for edge in layout.edges)
    assert made == list(cubes())


def test_grains_are_sixty_of_six_to_eight_millimetres():
    for layout in grains(2):
        assert len(layout.edges) == GRAINS
        assert all(GRAIN_SIZES[0] <= edge <= GRAIN_SIZES[1] for edge in layout.edges)


@pytest.mark.parametrize("index", range(8))
def test_all_lies_on_the_table_and_nothing_in_anything_else(index):
    scenario = list(cubes(8))[index].scenario()
    scene = SceneState.initial(scenario, 0.1)
    solids = [table_solid(scenario.table), region_solid(scenario.regions[PAN])]
    for name, body in scenario.bodies.items():
        assert place_of(scene, name) == "table"
        assert (name == SPONGE) == (not is_crumb(body, scenario.robot.model))
        named = replace(body, name=name)
        assert overlap_problem(body_solid(named), solids) is None
        solids.append(body_solid(named))


@pytest.mark.parametrize("index", range(4))
def test_with_the_dustpan_on_any_side_fewer_strokes_than_crumbs_bring_all_into_it(index):
    layout = next(layout for k, layout in enumerate(cubes()) if k % 4 == index and len(layout.edges) >= 4)
    found = preview(layout.scenario(), RunOptions(), lambda kind, **data: None)
    assert isinstance(found.outcome, Solution)
    wipes = [action for action in found.outcome.plan.actions if action.name == "wipe"]
    assert len(wipes) < len(layout.edges)
    assert len(found.outcome.refinements) == len(found.outcome.plan.steps)
    facts = observed_facts(found.outcome.scenes[-1])
    assert all(Fact("in_bin", (name, PAN)) in facts for name in layout.scenario().bodies if name != SPONGE)


def result(crumbs: int, missed: int, cpu: float) -> WipeResult:
    layout = next(cubes(1))
    names = tuple(f"crumb_{k:02d}" for k in range(missed))
    return WipeResult(layout, crumbs, names, 2, 20.0, 10.0, 6.0, cpu, 0, 11.0, (), "")


def test_shares_are_counted_over_all_crumbs_of_a_kind():
    checks = acceptance([result(1, 1, 2.0), result(99, 0, 2.0), result(GRAINS, 6, 8.0)])
    assert [(check.figure, check.reached) for check in checks[:2]] == [
        ("cubes in the dustpan", True),
        ("grains in the dustpan", False),
    ]
    assert checks[0].measured.startswith("99")
    assert checks[1].measured.startswith("90")
    assert checks[2].measured.startswith("3")
    assert np.isclose(result(1, 0, 2.0).factor, 3.0)


def test_layouts_are_drawn(tmp_path):
    pytest.importorskip("matplotlib")
    made = plot_wipes(tmp_path, [result(5, 0, 2.0), result(7, 2, 2.0)])
    assert [path.name for path in made] == ["wipe.png"]
    assert made[0].stat().st_size > 5000
