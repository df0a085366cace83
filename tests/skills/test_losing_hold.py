"""Skills whose object, sensors or fingers don't do what they should."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from bench import Bench, action, scene_with
from pinocchio import SE3
from py_trees.common import Status

from planner.failure import SceneChanged
from planner.refinement import Budget, Hints
from sim.disturbance import DisturbedPlant, Fault
from sim.scene import Held
from sim.sensor_faults import ForceBias, ForceMissing, PoseDelay
from skills.drag import standing_out
from skills.lift_off import LiftOff


@dataclass(frozen=True)
class JitteringFingers(Fault):
    """The fingers' encoder says that they never stand still."""

    def sense(self):
        return lambda seen: replace(seen, opening_velocity=0.05 if round(seen.t * 1000) % 2 else -0.05)


def at_phase(bench, name, do):
    """Have something done when a phase begins."""
    bench.context.report = lambda kind, **data: do() if kind == "phase" and data["phase"] == name else None


def test_what_a_silent_wrist_cannot_weigh_is_taken_for_what_it_should_be():
    bench = Bench(scene_with("box"))
    bench.plant = DisturbedPlant(bench.plant)
    at_phase(bench, "lift", lambda: bench.plant.suffer(ForceMissing(start=bench.context.observation.t)))
    assert bench.do("pick(box, table)") is Status.SUCCESS


@pytest.mark.parametrize("force", [(0.0, 0.0, 6.0), (0.0, 0.0, -6.0)])
def test_a_wrist_that_is_off_by_6_newtons_weighs_something_light_all_the_same(force):
    bench = Bench(scene_with("sponge"))
    bench.plant = DisturbedPlant(bench.plant, [ForceBias(force=force)])
    assert bench.do("pick(sponge, dustpan)") is Status.SUCCESS


def test_an_action_whose_object_is_gone_says_so():
    bench = Bench(scene_with("box"))
    bench.plant.take_away("box")
    bench.run(200)
    assert bench.do("pick(box, table)") is Status.FAILURE
    assert isinstance(bench.context.failure, SceneChanged)
    assert bench.context.failure.reason == "box is gone"


def test_what_was_lost_weighs_on_nothing_once_the_arm_has_lifted_off():
    bench = Bench(scene_with("box"))
    assert bench.do("pick(box, table)") is Status.SUCCESS
    bench.plant.put("box", SE3(np.eye(3), np.array([0.6, -0.3, 0.2])))
    bench.run(100)
    assert bench.scene.held is None
    lift_off = LiftOff(bench.context)
    for _ in range(200):
        lift_off.tick_once()
        bench.run(10)
        if lift_off.status is Status.SUCCESS:
            break
    bench.run(100)
    assert not bench.context.controller.contact
    assert bench.context.controller.contact_force < 0.5


def test_fingers_that_seem_never_to_come_to_rest_are_judged_by_what_they_hold():
    bench = Bench(scene_with("box"))
    bench.plant = DisturbedPlant(bench.plant)
    t_done = []

    def jitter():
        bench.plant.suffer(JitteringFingers(start=bench.context.observation.t, end=bench.context.observation.t + 30.0))
        t_done.append(bench.context.observation.t)

    at_phase(bench, "close", jitter)
    assert bench.do("pick(box, table)") is Status.FAILURE
    assert bench.context.observation.t - t_done[0] < 4.0


def test_a_drag_that_drops_its_object_has_missed_its_effect():
    bench = Bench(scene_with("book"))
    start = bench.scene.poses["book"].translation

    def drop():
        now = bench.scene.poses["book"].translation
        beyond = now + 0.4 * (now - start) / np.linalg.norm(now - start)
        bench.plant.put("book", SE3(np.eye(3), np.array([*beyond[:2], -0.1])))

    at_phase(bench, "retract", drop)
    assert bench.do("drag(book, table)") is Status.FAILURE
    assert bench.context.failure.kind == "EffectMissing"
    assert bench.context.failure.reason == "book did not come to where it should, it is on the floor"


@pytest.mark.parametrize("seconds", [0.12, 0.3])
def test_a_book_that_is_seen_late_comes_along_all_the_same_and_no_further(seconds):
    bench = Bench(scene_with("book"))
    bench.plant = DisturbedPlant(bench.plant, [PoseDelay(seconds=seconds)])
    told = []
    bench.context.report = lambda kind, **data: told.append(kind)
    assert bench.do("drag(book, table)") is Status.SUCCESS
    assert "pressed_harder" not in told
    end = bench.latest.refinement.sample.end
    scenario = bench.scene.scenario
    out = standing_out(scenario.bodies["book"], bench.plant.truth().poses["book"], scenario.table, end.edge)
    assert out == pytest.approx(end.overhang, abs=0.005)


def test_a_grasp_that_failed_twice_comes_after_all_others_unless_it_has_held_since():
    bench = Bench(scene_with("box"))
    pick, what = bench.skills["pick"], action("pick(box, table)")

    def first(**known):
        return pick.refine(what, bench.scene, np.random.default_rng(0), Budget(), Hints(**known)).sample

    best = first()
    assert first(failed=(best,)) == best
    assert first(failed=(best, best)) != best
    assert first(failed=(best, best), done=(best,)) == best


def test_what_is_held_and_still_stands_on_the_table_is_raised_first():
    bench = Bench(scene_with("box"))
    found = bench.refine(action("pick(box, table)"))
    closed, grasp = found.phases[2].trajectory.end, found.sample
    standing = replace(bench.scene, q=closed, opening=grasp.width, held=Held("box", grasp.X_OG.inverse()))
    placed = bench.skills["place"].refine(
        action("place(box, right_bin)"), standing, np.random.default_rng(0), Budget(), Hints()
    )
    carry = placed.phases[0].trajectory
    start = standing.poses["box"].translation
    way = [bench.robot.X_WG(carry.at(t)[0]) * standing.held.X_GO for t in np.linspace(0.0, carry.duration, 400)]
    risen = next(X_WO.translation for X_WO in way if X_WO.translation[2] - start[2] > 0.015)
    assert np.linalg.norm((risen - start)[:2]) < 0.01
