"""Generated tables: reproducible, of the format, and what they are said to be."""

from collections import Counter

import numpy as np
import pytest

from scenarios.document import parse_document
from scenarios.generate import GenerateError, generate, table_kind
from scenarios.goal import is_crumb, parse_goal
from scenarios.load import build_scenario
from scenarios.scenario import Scenario
from scenarios.shapes import Box, Compound, Cylinder, Hull, extents, reach, volume
from scenarios.spoilers import KINDS

SEEDS = range(20)


def _table(seed: int, objects: int, kind: str | None = None) -> Scenario:
    return build_scenario(parse_document(generate(seed, objects, kind), "generated"))


@pytest.fixture(scope="module")
def tables() -> dict[int, Scenario]:
    """Twenty tables with 4 to 12 objects."""
    return {seed: _table(seed, 4 + seed % 9) for seed in SEEDS}


def test_the_same_seed_gives_the_same_file_and_another_one_another():
    assert generate(7, 6) == generate(7, 6)
    assert len({generate(seed, 5) for seed in range(4)}) == 4


def test_there_are_as_many_objects_as_asked_for(tables):
    for seed, scenario in tables.items():
        assert sum(body.tool is None for body in scenario.bodies.values()) == 4 + seed % 9
    assert all(len(_table(3, count).bodies) >= count for count in (1, 2, 3, 20))


def test_all_kinds_of_shapes_crumbs_and_sides_occur(tables):
    shapes = Counter(type(body.shape) for scenario in tables.values() for body in scenario.bodies.values())
    assert min(shapes[kind] for kind in (Box, Cylinder, Hull, Compound)) >= 3
    model = next(iter(tables.values())).robot.model
    assert sum(is_crumb(b, model) for s in tables.values() for b in s.bodies.values()) >= 5
    sides = {np.sign(s.regions["dustpan"].X_WR.translation[1]) for s in tables.values() if "dustpan" in s.regions}
    assert sides == {-1.0, 1.0}
    names = {name.split("_")[0] for scenario in tables.values() for name in scenario.bodies}
    assert {"mug", "bowl", "book", "crumb", "can", "box", "prism", "wedge"} <= names


def test_the_shares_of_what_must_be_learned_are_kept_in_every_ten_seeds():
    kinds = Counter(table_kind(seed) for seed in range(100))
    assert 100 - kinds["plain"] >= 50
    assert kinds["chain"] + kinds["chain-aside"] >= 30
    assert kinds["aside"] + kinds["chain-aside"] >= 10


def _on_top(scenario: Scenario) -> list[tuple[str, str]]:
    """Pairs (upper, lower) of things of which one stands on the other."""
    top = {n: b.X_WO.translation[2] + reach(b.shape, b.X_WO.rotation[2]) for n, b in scenario.bodies.items()}
    low = {n: b.X_WO.translation[2] - reach(b.shape, -b.X_WO.rotation[2]) for n, b in scenario.bodies.items()}
    return [
        (a, b)
        for a in scenario.bodies
        for b in scenario.bodies
        if a != b
        and abs(low[a] - top[b]) < 0.001
        and np.linalg.norm((scenario.bodies[a].X_WO.translation - scenario.bodies[b].X_WO.translation)[:2]) < 0.02
    ]


def test_a_chain_has_three_links_and_what_is_put_aside_stands_on_something(tables):
    for seed, scenario in tables.items():
        kind, on_top = table_kind(seed), _on_top(scenario)
        if "chain" in kind:
            is_stack = any(upper == lower for _, upper in on_top for lower, _ in on_top)
            assert is_stack or any(name.startswith("block") and on_top for name in scenario.bodies)
        if "aside" in kind:
            aside = [args[0] for name, args in parse_goal(scenario.goal) if name == "in_bin" and args[1] == "table"]
            assert aside
            assert all(any(upper == name for upper, _ in on_top) for name in aside)
        if kind == "plain":
            assert not on_top


@pytest.mark.parametrize("seed", SEEDS)
def test_a_tables_start_varies_with_the_runs_seed(seed):
    document = parse_document(generate(seed, 4 + seed % 9), "generated")
    starts = [build_scenario(document, run).bodies for run in range(4)]
    for name, body in starts[0].items():
        moves = [np.linalg.norm(start[name].X_WO.translation - body.X_WO.translation) for start in starts[1:]]
        assert 0.0005 < max(moves) < 0.01


@pytest.mark.parametrize("kind", KINDS)
def test_an_unsolvable_table_has_the_flaw_it_is_named_for(kind):
    scenario = _table(4, 5, kind)
    bodies, fixtures = scenario.bodies, scenario.fixtures
    match kind:
        case "goal-too-small":
            inside = np.array(scenario.regions["slot"].size[:2]) - 2 * scenario.regions["slot"].wall
            assert np.all(np.sort(extents(bodies["block_1"].shape))[:2] > inside)
            assert ("in_bin", ("block_1", "slot")) in parse_goal(scenario.goal)
        case "crumb-behind-wall":
            wall, pan = fixtures["wall"], scenario.regions["dustpan"].X_WR.translation[1]
            assert extents(wall.shape)[0] == pytest.approx(scenario.table.size[0])
            y = wall.X_WO.translation[1]
            assert (bodies["crumb_1"].X_WO.translation[1] - y) * (pan - y) < 0
        case "out-of-reach":
            assert np.linalg.norm(bodies["box_far"].X_WO.translation[:2]) > 1.25
        case "too-heavy":
            assert bodies["block_1"].mass > 15.0
        case "flat-blocked":
            assert np.sort(extents(bodies["book_1"].shape))[1] > 0.11
            assert len(fixtures) == 4
            assert sum(volume(f.shape) for f in fixtures.values()) > 4 * 0.4 * 0.01 * 0.04


@pytest.mark.parametrize(
    ("seed", "objects", "kind", "words"),
    [(-1, 4, None, "seed -1"), (0, 0, None, "0 objects"), (0, 99, None, "99 objects"), (0, 4, "odd", "unknown kind")],
)
def test_what_can_not_be_generated_is_refused(seed, objects, kind, words):
    with pytest.raises(GenerateError, match=words):
        generate(seed, objects, kind)
