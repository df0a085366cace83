"""How the hand comes to where its lines begin: without a stop, where there is room to cut the corner."""

from dataclasses import replace

import numpy as np
import pytest
from bench import TICKS_PER_TREE, Bench, action, scene_with
from py_trees.common import Status

from planner.motion.timing import haste, joined
from planner.refinement import Phase, Refinement, pairs
from scenarios.scenario import Fixture
from scenarios.shapes import Box
from skills.carrying import MAX_ACCELERATION, acceleration
from skills.context import ActionRun
from skills.motions import Follow
from skills.skill import ContactSettings, Toolkit
from skills.way_search import Entry, entered
from skills.waypoints import raised, shifted
from skills.ways import Line


def _phases(bench: Bench, text: str) -> dict[str, Phase]:
    found = bench.refine(action(text))
    assert isinstance(found, Refinement), found
    return {phase.name: phase for phase in found.phases}


@pytest.mark.parametrize(
    ("bodies", "before", "text", "names"),
    [
        (("box",), (), "pick(box, table)", ("pre-grasp", "approach")),
        (("box",), ("pick(box, table)",), "place(box, right_bin)", ("pre-place", "descend")),
        (("book",), (), "drag(book, table)", ("pre-drag", "approach")),
        (("sponge", "carrot"), ("pick(sponge, dustpan)",), "wipe(carrot, table, dustpan)", ("pre-wipe", "approach")),
    ],
)
def test_every_skill_comes_to_its_line_without_a_stop(bodies, before, text, names):
    bench = Bench(scene_with(*bodies))
    for earlier in before:
        assert bench.do(earlier) is Status.SUCCESS
    phases = _phases(bench, text)
    first = phases[names[0]]
    reach, entry = (phases[name].trajectory for name in names)
    assert reach.ends_moving
    np.testing.assert_allclose(reach.q[-1], entry.q[0], atol=1e-9)
    np.testing.assert_allclose(reach.v[-1], entry.v[0], atol=1e-9)
    assert haste(joined([reach, entry]), bench.robot) <= 1.0 + 1e-9
    assert acceleration(bench.robot, entry, bench.scene.held) <= MAX_ACCELERATION
    # As long as the reach lasts nothing is touched, not even what the line is for.
    ready = replace(bench.scene, opening=first.opening)
    assert bench.motion.audit(ready, reach, first.allowed) is None
    assert bench.motion.audit(ready, entry.until(0.2), first.allowed) is None


def test_the_arm_keeps_moving_from_the_reach_into_the_approach():
    bench = Bench(scene_with("box"))
    what = action("pick(box, table)")
    found = bench.refine(what)
    assert isinstance(found, Refinement)
    run, context = ActionRun(what, found), bench.context
    speeds = []
    for leaf in (Follow("pre-grasp", run, context), Follow("approach", run, context)):
        leaf.tick_once()
        while leaf.status is Status.RUNNING:
            bench.run(TICKS_PER_TREE)
            speeds.append(float(np.linalg.norm(context.observation.v)))
            leaf.tick_once()
        assert leaf.status is Status.SUCCESS
    moving = np.flatnonzero(np.array(speeds) > 0.1)
    assert min(speeds[moving[0] : moving[-1]]) > 0.05
    assert speeds[-1] < 0.05


def test_a_corner_with_something_in_it_is_not_cut():
    bench = Bench(scene_with("box"))
    scene = bench.scene
    toolkit = Toolkit(bench.robot, bench.motion, ContactSettings())
    X_WG = bench.robot.X_WG(scene.q)
    there = shifted(X_WG, np.array([0.0, 0.15, 0.0]))
    path = bench.motion.lines([there, raised(there, -0.08)], scene.q)[0]
    reach, line = bench.motion.move(scene, [path[0]]), Line(scene, path, 0.15, frozenset())
    timed = bench.motion.timed_line(scene, path, 0.15)
    cut, entry, corner = entered(toolkit, scene, Entry(reach, line, timed, frozenset()))
    assert cut.ends_moving
    assert corner > 0.0
    post = Fixture("post", Box((0.02, 0.15, 0.02)), bench.robot.X_WG(entry.at(0.1)[0]), 0.5, (1.0, 1.0, 1.0, 1.0))
    walled = replace(scene, scenario=replace(scene.scenario, fixtures={"post": post}))
    # What only the line may touch is in the way of the corner too.
    touching = replace(line, scene=walled, allowed=pairs(bench.robot.hand_links, "post"))
    for kind in (replace(line, scene=walled), touching):
        kept, after, corner = entered(toolkit, walled, Entry(reach, kind, timed, frozenset()))
        assert kept is reach
        assert after is timed
        assert corner == 0.0


def test_an_arm_that_has_arrived_sets_out_again_at_once():
    bench = Bench(scene_with("box"))
    assert bench.do("pick(box, table)") is Status.SUCCESS
    begun = {}
    bench.context.report = lambda kind, **data: begun.setdefault(data.get("phase"), bench.context.observation.t)
    since = bench.context.observation.t
    assert bench.do("place(box, right_bin)") is Status.SUCCESS
    assert begun["pre-place"] - since < 0.01
