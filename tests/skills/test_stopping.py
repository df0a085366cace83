"""An arm that is pushed while it moves: it stops, says so, and goes on when asked again."""

import numpy as np
from bench import TICKS_PER_TREE, Bench, action, scene_with
from py_trees.common import Status
from py_trees.trees import BehaviourTree

from planner.failure import ArmStopped
from planner.motion.trajectory import Trajectory
from sim.scene import pose_distance
from skills.context import ActionRun
from skills.control.reference import Reference
from skills.lift_off import LiftOff


def ended(bench: Bench, root) -> Status:
    """Tick a tree to its end."""
    tree = BehaviourTree(root)
    for _ in range(1500):
        tree.tick()
        if root.status is not Status.RUNNING:
            return root.status
        bench.run(10)
    raise AssertionError(f"{root.name} did not end")


def test_a_push_in_the_middle_of_a_motion_stops_the_arm_and_the_action_works_when_begun_again():
    bench = Bench(scene_with("box"))
    step = bench.plant.step
    pushed: list[float] = []
    failed: list[float] = []

    def told(kind: str, **data: object) -> None:
        if kind == "action_failed":
            failed.append(bench.context.observation.t)

    bench.context.report = told

    def shoving_step() -> None:
        if 0.6 < bench.context.observation.t < 0.7:
            bench.plant.push(np.array([0.0, 100.0, 0.0]), "link_5")
            pushed.append(bench.context.observation.t)
        step()

    bench.plant.step = shoving_step
    pick = action("pick(box, table)")
    assert ended(bench, bench.skills["pick"].subtree(ActionRun(pick), bench.context)) is Status.FAILURE
    assert pushed
    assert isinstance(bench.context.failure, ArmStopped)
    assert "pushes joint" in bench.context.failure.reason
    assert len(failed) == 1
    assert failed[0] < pushed[0] + 0.1

    bench.context.failure = None
    assert ended(bench, LiftOff(bench.context)) is Status.SUCCESS
    assert bench.context.controller.stopped is None
    assert bench.do("pick(box, table)") is Status.SUCCESS
    assert bench.scene.held is not None


def test_an_arm_that_swings_what_it_holds_stops_within_150_ms_and_it_does_not_slip():
    bench = Bench(scene_with("box"))
    assert bench.do("pick(box, table)") is Status.SUCCESS
    q, duration = bench.context.observation.q, 1.97
    s = np.linspace(0.0, 1.0, 60)[:, None]
    swing = 1.2 * np.eye(7)[0]
    rise, rate = s**3 * (10 - 15 * s + 6 * s * s), 30 * s * s * (1 - s) ** 2 / duration
    swung = Trajectory(s[:, 0] * duration, q + rise * swing, rate * swing)
    held = bench.scene.held
    bench.context.controller.follow(Reference(swung))
    bench.run(round(duration / 2 / 0.002))
    assert abs(bench.context.observation.v[0]) > 1.1
    bench.context.controller.hold()
    bench.run(75)
    assert bench.context.controller.is_still
    bench.run(100)
    assert held is not None
    assert bench.scene.held is not None
    distance, angle = pose_distance(held.X_GO, bench.scene.held.X_GO)
    assert distance < 0.001
    assert np.degrees(angle) < 1.0


def test_a_plan_dropped_in_the_middle_of_a_stroke_lifts_the_sponge_off_before_anything_is_planned():
    bench = Bench(scene_with("sponge", "carrot"))
    assert bench.do("pick(sponge, dustpan)") is Status.SUCCESS
    context, lift = bench.context, LiftOff(bench.context)
    told = []
    context.report = lambda kind, **_: told.append(kind)
    act = bench.skills["wipe"].subtree(ActionRun(action("wipe(carrot, table, dustpan)")), context)
    while (phase := context.phase) is None or phase.name != "stroke" or context.controller.contact_force < 5.0:
        act.tick_once()
        bench.run(TICKS_PER_TREE)
    lift.tick_once()
    # In the tick that puts the plan out of force what it had under way is stopped last.
    act.stop(Status.INVALID)
    height = bench.robot.X_WG(context.observation.q).translation[2]
    while lift.status is Status.RUNNING:
        bench.run(TICKS_PER_TREE)
        lift.tick_once()
    assert lift.status is Status.SUCCESS
    assert told[-1] == "lifting_off"
    assert bench.robot.X_WG(context.observation.q).translation[2] - height > 0.04
    assert not context.controller.contact
