"""What is believed of a scene from eyes that shake, lag or blink."""

import numpy as np
import pinocchio as pin
import pytest
from pinocchio import SE3

from bt_tamp.executive.belief import Belief
from bt_tamp.executive.sighting import OVERLOOKED, REMEMBERED, Sighting
from scenarios.load import load_scenario
from sim.plant import Observation
from sim.robot import RobotModel
from sim.scene import pose_distance
from sim.wrench import Wrench

TICK = 0.02
ROBOT = RobotModel()
STILL = Wrench(np.zeros(3), np.zeros(3))


@pytest.fixture(scope="module")
def scenario():
    return load_scenario("fig2")


def seen(scenario, t, **changes):
    """What is observed at t: everything as declared, but for the changes."""
    poses = {name: body.X_WO for name, body in scenario.bodies.items()}
    known = {
        "t": t,
        "q": scenario.robot.q0,
        "v": np.zeros(7),
        "tau": np.zeros(7),
        "opening": 0.055,
        "opening_velocity": 0.0,
        "grip_force": 0.0,
        "wrist": STILL,
        "poses": poses,
    } | changes
    known.setdefault("velocities", {name: np.zeros(6) for name in known["poses"]})
    return Observation(**known)


def shaken(rng, X, metres=0.003, turn=0.03):
    shift, axis = rng.normal(size=(2, 3))
    return SE3(pin.exp3(turn * axis) @ X.rotation, X.translation + metres * shift)


def test_a_clean_look_is_believed_as_it_is_and_so_is_a_clean_move():
    sighting, X = Sighting(), SE3.Random()
    Y = SE3(X.rotation, X.translation + np.array([0.05, 0.0, 0.0]))
    looks = [sighting.see(pose, True) for pose in (X, X, X, Y, Y)]
    assert looks == [X, X, X, Y, Y]


def test_noise_is_averaged_away():
    rng, sighting, X = np.random.default_rng(0), Sighting(), SE3.Random()
    errors = [pose_distance(sighting.see(shaken(rng, X), True), X) for _ in range(200)]
    distances, turns = np.array(errors[40:]).T
    assert distances.max() < 0.003
    assert turns.max() < 0.03


def test_a_move_is_noticed_within_a_fifth_of_a_second_in_spite_of_noise():
    rng, sighting, X = np.random.default_rng(0), Sighting(), SE3.Identity()
    Y = SE3(np.eye(3), np.array([0.06, 0.0, 0.0]))
    for _ in range(60):
        sighting.see(shaken(rng, X), True)
    looks = [sighting.see(shaken(rng, Y), True) for _ in range(10)]
    assert pose_distance(looks[-1], Y)[0] < 0.008


def test_a_turn_on_the_spot_is_noticed_within_a_fifth_of_a_second_in_spite_of_noise():
    rng, sighting, X = np.random.default_rng(0), Sighting(), SE3.Identity()
    Y = SE3(pin.rpy.rpyToMatrix(0.0, 0.0, np.radians(80.0)), np.zeros(3))
    for _ in range(60):
        sighting.see(shaken(rng, X), True)
    looks = [sighting.see(shaken(rng, Y), True) for _ in range(10)]
    assert pose_distance(looks[-1], Y)[1] < np.radians(5.0)


def test_what_is_out_of_sight_is_believed_where_it_was_and_after_a_while_nowhere(scenario):
    belief = Belief(scenario, ROBOT)
    belief.update(seen(scenario, 0.0), False)
    blind = belief.update(seen(scenario, 1.0, poses={}), False)
    assert blind.poses.keys() == scenario.bodies.keys()
    assert not belief.update(seen(scenario, REMEMBERED + 0.1, poses={}), False).poses


def held_at(scenario, q, X_GO, t, **changes):
    """Observed at t with the sponge in the closed hand."""
    poses = {name: body.X_WO for name, body in scenario.bodies.items()} | {"sponge": ROBOT.X_WG(q) * X_GO}
    return seen(scenario, t, q=q, poses=poses, grip_force=20.0, opening=0.05, **changes)


IN_HAND = SE3(np.eye(3), np.array([0.0, 0.0, -0.01]))


def test_what_is_missing_while_the_rest_is_seen_is_gone_at_once_but_not_after_a_blink(scenario):
    belief = Belief(scenario, ROBOT)
    belief.update(seen(scenario, 0.0), False)
    rest = {name: X for name, X in seen(scenario, 0.0).poses.items() if name != "cube"}
    assert "cube" in belief.update(seen(scenario, TICK, poses=rest), False).poses
    assert "cube" not in belief.update(seen(scenario, OVERLOOKED + TICK, poses=rest), False).poses

    belief.update(seen(scenario, 1.0), False)
    for t in np.arange(1.0, 2.0, TICK):
        assert "cube" in belief.update(seen(scenario, t, poses={}), False).poses
    assert "cube" in belief.update(seen(scenario, 2.0, poses=rest), False).poses
    assert "cube" not in belief.update(seen(scenario, 2.0 + OVERLOOKED + TICK, poses=rest), False).poses


def test_what_is_held_and_out_of_sight_is_still_held_and_moves_along(scenario):
    belief, q = Belief(scenario, ROBOT), scenario.robot.q0
    belief.update(held_at(scenario, q, IN_HAND, 0.0), True)
    later = q + 0.2
    dark = belief.update(seen(scenario, 0.5, q=later, poses={}, grip_force=20.0, opening=0.05), True)
    assert dark.held is not None
    assert pose_distance(dark.poses["sponge"], ROBOT.X_WG(later) * IN_HAND)[0] < 1e-9


def test_what_is_held_and_seen_late_is_where_the_hand_has_brought_it(scenario):
    belief, q0 = Belief(scenario, ROBOT), scenario.robot.q0
    path = [q0 + 0.02 * k for k in range(30)]
    for k, q in enumerate(path):
        then = path[max(k - 15, 0)]
        late = ROBOT.X_WG(then) * IN_HAND
        poses = {name: body.X_WO for name, body in scenario.bodies.items()} | {"sponge": late}
        at = {"sponge": max(k - 15, 0) * TICK}
        look = seen(scenario, k * TICK, q=q, poses=poses, grip_force=20.0, opening=0.05, seen_at=at)
        scene = belief.update(look, True)
    assert scene.held is not None
    assert scene.held.name == "sponge"
    assert pose_distance(scene.poses["sponge"], ROBOT.X_WG(path[-1]) * IN_HAND)[0] < 1e-6


def ik_above(X_WO):
    """A configuration (7,) that has the pads about a body."""
    X_WG, q = SE3(np.diag([-1.0, 1.0, -1.0]), X_WO.translation + np.array([0.0, 0.0, -0.01])), np.full(7, 0.3)
    data = ROBOT.data()
    for _ in range(300):
        J = pin.computeFrameJacobian(ROBOT.model, data, q, ROBOT.tcp_id, pin.ReferenceFrame.LOCAL)
        error = pin.log6(ROBOT.X_WG(q).actInv(X_WG)).vector
        q = q + np.clip(J.T @ np.linalg.solve(J @ J.T + 1e-4 * np.eye(6), error), -0.2, 0.2)
    return q


def test_what_fingers_without_force_hold_is_held_until_it_is_seen_to_leave_them(scenario):
    belief, q = Belief(scenario, ROBOT), scenario.robot.q0
    assert belief.update(held_at(scenario, q, IN_HAND, 0.0), True).held is not None
    lower = SE3(np.eye(3), IN_HAND.translation + np.array([0.0, 0.0, 0.012]))

    def limp(X_GO, t, sinking=0.0):
        fingers_shut = held_at(scenario, q, X_GO, t)
        velocities = dict(fingers_shut.velocities) | {"sponge": np.array([0.0, 0.0, -sinking, 0.0, 0.0, 0.0])}
        return Observation(**(vars(fingers_shut) | {"grip_force": 0.5, "velocities": velocities}))

    assert belief.update(limp(IN_HAND, 0.1), True).held is not None
    assert belief.update(limp(IN_HAND, 0.5), True).held is not None
    assert belief.update(limp(lower, 0.6, sinking=0.2), True).held is None
    assert belief.update(limp(lower, 0.7, sinking=0.0), True).held is not None


def test_what_lies_below_fingers_without_force_is_not_held(scenario):
    belief = Belief(scenario, ROBOT)
    on_table = seen(scenario, 0.0).poses["cube"]
    q = ik_above(on_table)
    assert belief.update(seen(scenario, 0.0, q=q, opening=0.05, grip_force=0.5), True).held is None
    assert belief.update(seen(scenario, 0.1, q=q, opening=0.05, grip_force=20.0), True).held is not None


def test_what_fingers_without_force_hold_out_of_sight_is_not_held(scenario):
    belief, q = Belief(scenario, ROBOT), scenario.robot.q0
    belief.update(held_at(scenario, q, IN_HAND, 0.0), True)
    dark = seen(scenario, 0.1, q=q, poses={}, grip_force=0.5, opening=0.05)
    assert belief.update(dark, True).held is None


def test_a_bin_is_believed_where_it_is_seen(scenario):
    belief, name = Belief(scenario, ROBOT), next(iter(scenario.regions))
    declared = scenario.regions[name].X_WR
    elsewhere = SE3(declared.rotation, declared.translation + np.array([0.05, 0.0, 0.0]))
    assert belief.update(seen(scenario, 0.0), False).scenario is scenario
    first = belief.update(seen(scenario, 0.1, regions={name: elsewhere}), False)
    again = belief.update(seen(scenario, 0.2, regions={name: elsewhere}), False)
    assert elsewhere == first.scenario.regions[name].X_WR
    assert again.scenario is first.scenario
    assert all(first.scenario.regions[other] is region for other, region in scenario.regions.items() if other != name)


def test_an_arm_pushed_onto_a_joints_stop_can_still_plan_from_there(scenario):
    q = scenario.robot.q0.copy()
    q[5] = ROBOT.q_min[5] - 1e-4
    believed = Belief(scenario, ROBOT).update(seen(scenario, 0.0, q=q), False).q
    assert (believed > ROBOT.q_min).all()
    np.testing.assert_allclose(believed, q, atol=2e-3)
