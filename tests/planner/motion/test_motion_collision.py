from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from pinocchio import SE3

from planner.motion.collision import FastChecker, hand_hits
from planner.motion.exact import ExactChecker
from planner.motion.kernels import edge_is_free
from planner.motion.world import Margins, movables, obstacles
from planner.refinement import pairs
from scenarios.scenario import Scenario
from scenarios.shapes import Box, Compound, Cylinder, Hull, Shape, Sphere
from sim.robot import RobotModel
from sim.scene import Held, SceneState


def _touching(checker: ExactChecker, q: np.ndarray) -> set[frozenset[str]]:
    return {contact.pair for contact in checker.contacts(q[None])}


def _shape(rng: np.random.Generator) -> Shape:
    kinds = (
        Box(tuple(rng.uniform(0.01, 0.3, 3))),
        Cylinder(rng.uniform(0.01, 0.12), rng.uniform(0.01, 0.3)),
        Sphere(rng.uniform(0.01, 0.15)),
        Hull.of(rng.normal(size=(rng.integers(4, 40), 3)) * rng.uniform(0.03, 0.1, 3))[0],
    )
    return kinds[rng.integers(4)]


def _angle(rng: np.random.Generator) -> Shape:
    """Three shapes in a row: nothing like their convex hull."""
    return Compound.of([(_shape(rng), SE3(np.eye(3), np.array([0.15 * k, 0.0, 0.05 * k]))) for k in range(3)])[0]


def _pose(rng: np.random.Generator, lower: list[float], upper: list[float]) -> SE3:
    return SE3(pin.exp3(rng.normal(size=3) * 2), rng.uniform(lower, upper))


def _random_scene(table: Callable[..., Scenario], rng: np.random.Generator) -> SceneState:
    shapes = [_angle(rng) if k in (0, 3) else _shape(rng) for k in range(12)]
    poses = [_pose(rng, [-0.8, -0.8, 0.0], [0.8, 0.8, 1.1]) for _ in shapes]
    things = [(f"thing{k}", shape, X) for k, (shape, X) in enumerate(zip(shapes, poses, strict=True))]
    scene = SceneState.initial(table(things), rng.uniform(0.0, 0.11))
    if rng.random() < 0.7:
        scene = replace(scene, held=Held("thing0", _pose(rng, [-0.05] * 3, [0.05] * 3)))
    return scene


@pytest.fixture(scope="module")
def verdicts(robot: RobotModel, table: Callable[..., Scenario]) -> list[tuple[bool, bool]]:
    """Free by the fast model, and by the exact one, in random scenes."""
    rng = np.random.default_rng(0)
    found = []
    for _ in range(36):
        scene = _random_scene(table, rng)
        free = rng.choice([0.0, 0.005, 0.02])
        relaxed = {frozenset(("hand", "thing1")): -0.002, frozenset(("link_6", "thing2")): -0.005}
        fast = FastChecker(robot, scene, Margins(free, relaxed=relaxed))
        exact = ExactChecker(robot, scene, Margins(free, relaxed=relaxed))
        found += [(fast.is_free(q), exact.is_free(q)) for q in rng.uniform(robot.q_min, robot.q_max, (60, 7))]
    return found


def test_the_fast_model_never_calls_free_what_the_exact_one_calls_a_collision(verdicts):
    assert not [fast for fast, exact in verdicts if fast and not exact]


def test_the_fast_model_rejects_hardly_anything_that_is_free(verdicts):
    assert sum(exact and not fast for fast, exact in verdicts) <= 0.005 * len(verdicts)


def test_the_random_scenes_hold_both_free_and_colliding_configurations(verdicts):
    free = np.mean([exact for _, exact in verdicts])
    assert 0.2 < free < 0.8


@pytest.mark.parametrize("margin", [0.0, 0.005, 0.02])
def test_both_models_agree_at_the_brink_of_contact(robot, table, margin):
    # Bodies are moved towards the hand until the exact model says they are just nearer than the margin.
    rng = np.random.default_rng(1)
    q = np.radians([0.0, 20.0, 0.0, -80.0, 0.0, 80.0, 0.0])
    hand = robot.X_WG(q)
    late = []
    for _ in range(15):
        shape, turn = _shape(rng), pin.exp3(rng.normal(size=3))
        way = hand.rotation @ np.append(rng.normal(size=2) * 0.5, abs(rng.normal()) + 0.3)
        way /= np.linalg.norm(way)

        def scene_at(distance: float, shape=shape, turn=turn, way=way) -> SceneState:
            thing = ("thing", shape, SE3(turn, hand.translation + way * distance))
            return replace(SceneState.initial(table([thing]), 0.06), q=q)

        near, far = 0.0, 1.0
        for _ in range(20):
            middle = (near + far) / 2
            if not ExactChecker(robot, scene_at(middle), Margins(margin)).is_free(q):
                near = middle
            else:
                far = middle
        if near == 0.0:
            continue  # so small that it fits between the fingers
        assert not FastChecker(robot, scene_at(near - 1e-5), Margins(margin)).is_free(q)
        late.append(not FastChecker(robot, scene_at(far + 0.012), Margins(margin)).is_free(q))
    assert len(late) > 10
    assert not any(late)


def test_a_wall_thinner_than_a_step_is_not_jumped(robot, table, at):
    wall = ("wall", Box((0.6, 0.002, 0.6)), at(0.6, 0.0, 0.45))
    scene = SceneState.initial(table([wall]), 0.06)
    right, left = (np.array([angle, 0.6, 0.0, -1.4, 0.0, 1.1, 0.0]) for angle in (-0.6, 0.6))
    for checker in (FastChecker(robot, scene), ExactChecker(robot, scene)):
        assert checker.is_free(right)
        assert checker.is_free(left)
        assert not checker.edge_is_free(right, left)


def test_what_is_left_out_of_an_edge_because_there_is_room_is_free(robot, table):
    rng = np.random.default_rng(3)
    disagreeing, free, looked, steps = 0, 0, 0, 0
    for _ in range(8):
        packed = FastChecker(robot, _random_scene(table, rng), Margins(0.005)).packed
        for qa in rng.uniform(0.5 * robot.q_min, 0.5 * robot.q_max, (30, 7)):
            if not edge_is_free(qa, qa, packed, 1.0, np.inf)[0]:
                continue
            qb = qa + rng.normal(size=7) * 0.2
            count = int(np.ceil(np.abs(qb - qa).max() / 0.02))
            points = qa + (qb - qa) * (np.arange(1, count + 1) / count)[:, None]
            answer, checks = edge_is_free(qa, qb, packed, 0.02, np.inf)
            disagreeing += answer != all(edge_is_free(q, q, packed, 1.0, np.inf)[0] for q in points)
            if answer:
                free, looked, steps = free + 1, looked + checks, steps + count
    assert disagreeing == 0
    assert free > 20
    assert looked < 0.7 * steps


def test_a_configuration_beyond_a_joint_limit_is_not_free(robot, scene):
    q = scene.q.copy()
    q[3] = robot.q_min[3] - 1e-3
    assert not FastChecker(robot, scene).is_free(q)
    assert not ExactChecker(robot, scene).is_free(q)


def test_the_arm_folded_on_its_base_meets_itself(robot, table):
    scene = SceneState.initial(table([]), 0.06)
    folded = np.radians([0.0, -90.0, 0.0, 119.0, 0.0, 119.0, 0.0])
    assert _touching(ExactChecker(robot, scene), folded) == pairs(frozenset({"link_5", "link_6"}), "link_0")
    assert not FastChecker(robot, scene).is_free(folded)


def test_allowed_pairs_may_touch_and_others_may_not(robot, scene, planner, down):
    q = planner.ik(down(0.73, -0.08, 0.16))[0]
    wide = replace(scene, opening=0.05)
    assert _touching(ExactChecker(robot, wide), q) == pairs(robot.finger_links, "box")
    allowed = Margins(allowed=pairs(robot.finger_links, "box"))
    assert FastChecker(robot, wide, allowed).is_free(q)
    assert not FastChecker(robot, wide, Margins(allowed=pairs("finger_left", "box"))).is_free(q)


def test_the_opening_moves_the_fingers(robot, scene, planner, down):
    q = planner.ik(down(0.73, -0.08, 0.16))[0]
    assert FastChecker(robot, replace(scene, opening=0.1)).is_free(q)
    assert not FastChecker(robot, replace(scene, opening=0.05)).is_free(q)


def test_a_held_body_collides_under_its_own_name_and_no_longer_stands_around(robot, sponge_in_hand, planner, down):
    q = planner.ik(down(0.6, 0.25, 0.07))[0]
    assert _touching(ExactChecker(robot, sponge_in_hand, Margins(0.0)), q) == pairs("sponge", "table")
    assert not FastChecker(robot, sponge_in_hand, Margins(0.0)).is_free(q)
    assert "sponge" not in {obstacle.name for obstacle in obstacles(sponge_in_hand)}
    assert "sponge" not in movables(sponge_in_hand)


def test_obstacles_are_everything_that_stands_around(scene):
    names = [obstacle.name for obstacle in obstacles(scene)]
    assert set(names) == {"floor", "pedestal", "table", "left_bin", "right_bin", "dustpan", *scene.scenario.bodies}
    assert names.count("left_bin") == 5
    assert names.count("dustpan") == 4


def test_a_robot_that_stands_on_the_floor_has_no_pedestal(table, at):
    raised = SceneState.initial(table([], at(0.0, 0.0, -0.21)), 0.06)
    assert "pedestal" not in {obstacle.name for obstacle in obstacles(raised)}


def test_the_hand_alone_is_checked_where_no_arm_could_bring_it(robot, scene, down):
    margins = Margins(0.002)
    assert hand_hits(robot, scene, down(5.0, 0.0, 1.0), margins) == frozenset()
    assert hand_hits(robot, scene, down(0.73, 0.135, 0.06), margins) == {"carrot"}
    assert hand_hits(robot, scene, down(0.73, 0.135, 0.04), margins) == {"carrot", "table"}
    everything = pairs(robot.hand_links, frozenset({"carrot", "table"}))
    assert hand_hits(robot, scene, down(0.73, 0.135, 0.04), Margins(0.002, everything)) == frozenset()
