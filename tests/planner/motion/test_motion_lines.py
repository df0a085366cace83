from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from pinocchio import SE3

from planner.motion.ik import ClosedFormIK
from planner.motion.lines import MAX_JOINT_STEP, MIN_MARGIN, STEP, TURN, CartesianPath, interpolate, track

START = np.radians([0.0, 20.0, 0.0, -80.0, 0.0, 80.0, 0.0])


@pytest.fixture(scope="module")
def ik(robot) -> ClosedFormIK:
    return ClosedFormIK(robot)


@pytest.fixture(scope="module")
def stroke(down) -> list[SE3]:
    """Down to the table, 30 cm along −y, and up again; the fingers along x."""
    return [
        down(0.6, 0.15, 0.2, 90),
        down(0.6, 0.15, 0.065, 90),
        down(0.6, -0.15, 0.065, 90),
        down(0.6, -0.15, 0.2, 90),
    ]


def _poses(path: CartesianPath) -> list[SE3]:
    return [SE3(R, p) for R, p in zip(path.R_WG, path.p_WG, strict=True)]


def test_poses_on_a_polyline_are_close_and_pass_its_waypoints(down):
    waypoints = [down(0.5, 0.1, 0.3), down(0.5, 0.1, 0.3, 50), down(0.62, 0.1, 0.1, 50)]
    path = interpolate(waypoints)
    poses = _poses(path)
    assert all(poses[k].isApprox(X_WG, 1e-9) for k, X_WG in zip(path.corners, waypoints, strict=True))
    for X_WA, X_WB in pairwise(poses):
        assert np.linalg.norm(X_WB.translation - X_WA.translation) <= STEP + 1e-9
        assert np.linalg.norm(pin.log3(X_WA.rotation.T @ X_WB.rotation)) <= TURN + 1e-9


def test_orientations_turn_the_short_way_at_a_constant_rate(down):
    path = interpolate([down(0.5, 0.0, 0.3, 0), down(0.5, 0.0, 0.3, 40)])
    poses = _poses(path)
    assert poses[len(poses) // 2].isApprox(down(0.5, 0.0, 0.3, 20), 1e-9)


def test_a_line_that_goes_nowhere_is_one_step(down):
    path = interpolate([down(0.5, 0.0, 0.3), down(0.5, 0.0, 0.3)])
    assert len(path.p_WG) == 2
    assert np.all(np.isfinite(path.progress))


def test_joint_paths_follow_every_pose_smoothly_and_clear_of_the_limits(robot, ik, stroke):
    path = interpolate(stroke)
    found = list(track(ik, path, robot.v_max))
    assert len(found) >= 3
    for q in found:
        assert q.shape == (len(path.p_WG), 7)
        assert np.minimum(q - robot.q_min, robot.q_max - q).min() >= MIN_MARGIN
        assert np.abs(np.diff(q, axis=0)).max() <= MAX_JOINT_STEP
        for configuration, X_WG in zip(q[::9], _poses(path)[::9], strict=True):
            assert robot.X_WG(configuration).isApprox(X_WG, 1e-9)


def test_comfortable_paths_come_before_those_near_a_limit(robot, ik, stroke):
    margins = [ik.margin(q) for q in track(ik, interpolate(stroke), robot.v_max)]
    assert margins[0] >= 0.25
    assert min(margins) < margins[0]


def test_paths_near_the_arm_come_first_among_equals(robot, ik, down):
    path = interpolate([down(0.6, 0.0, 0.3), down(0.6, 0.0, 0.2)])
    paths = list(track(ik, path, robot.v_max))
    far = max(paths, key=lambda q: np.abs(q[0] - paths[0][0]).max())
    first = next(iter(track(ik, path, robot.v_max, near=far[0])))
    assert np.abs(first[0] - far[0]).max() < np.abs(paths[0][0] - far[0]).max()


def test_several_postures_are_offered_before_the_same_one_turned_about_its_axes(robot, ik, stroke):
    first, second = list(track(ik, interpolate(stroke), robot.v_max))[:2]
    elbows = [robot.link_poses(q[0], 0.0)["link_4"].translation for q in (first, second)]
    assert np.linalg.norm(elbows[0] - elbows[1]) > 0.05


@pytest.mark.parametrize("radius", [0.45, 0.6, 0.8])
@pytest.mark.parametrize("yaw", [0, 45, 90])
def test_the_hand_comes_straight_down_on_the_whole_table(robot, ik, down, radius, yaw):
    path = interpolate([down(radius, 0.0, 0.17, yaw), down(radius, 0.0, 0.065, yaw)])
    assert list(track(ik, path, robot.v_max))


def test_what_is_out_of_reach_has_no_path(robot, ik, down):
    assert not list(track(ik, interpolate([down(0.6, 0.0, 0.2), down(1.2, 0.0, 0.2)]), robot.v_max))


def test_a_line_can_go_on_from_where_the_arm_is(robot, planner, down):
    start = planner.ik(down(0.6, 0.1, 0.1))[0]
    path = planner.line_from(start, [down(0.6, 0.1, 0.1), down(0.6, 0.1, 0.2), down(0.6, 0.0, 0.2)])
    assert path is not None
    assert np.allclose(path[0], start, atol=1e-4)
    assert robot.X_WG(path[-1]).isApprox(down(0.6, 0.0, 0.2), 1e-5)
    assert np.abs(np.diff(path, axis=0)).max() < MAX_JOINT_STEP
    middle = robot.X_WG(path[len(path) // 4]).translation
    assert np.allclose(middle[:2], [0.6, 0.1], atol=1e-5)


def test_a_line_from_the_wrong_place_or_out_of_reach_is_none(planner, down):
    start = planner.ik(down(0.6, 0.1, 0.1))[0]
    assert planner.line_from(start, [down(0.6, 0.1, 0.1), down(1.3, 0.1, 0.1)]) is None
    assert planner.line_from(start, [down(0.6, -0.3, 0.1), down(0.6, -0.3, 0.2)]) is None
