import numpy as np
import pinocchio as pin
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pinocchio import SE3

from planner.motion.chain import place_links, placement
from planner.motion.ik import SWIVELS, ClosedFormIK, WristPoses
from planner.motion.ik_numeric import solve_numerically
from sim.robot import RobotModel

ROBOT = RobotModel(X_WB=SE3(pin.exp3(np.array([0.1, -0.2, 0.7])), np.array([0.3, -0.1, 0.2])))
IK = ClosedFormIK(ROBOT)

configurations = st.tuples(*(st.floats(low, high) for low, high in zip(ROBOT.q_min, ROBOT.q_max, strict=True))).map(
    np.array
)


def _wrists(X_WG: SE3, count: int) -> WristPoses:
    """The wrist pose of one gripper pose, several times."""
    return IK.wrist_poses(np.tile(X_WG.rotation, (count, 1, 1)), np.tile(X_WG.translation, (count, 1)))


def _error(q: np.ndarray, X_WG: SE3) -> float:
    return float(np.abs(ROBOT.X_WG(q).homogeneous - X_WG.homogeneous).max())


@settings(max_examples=60, derandomize=True, deadline=None)
@given(configurations)
def test_every_solution_brings_the_hand_to_the_pose_and_keeps_the_limits(q):
    assume(abs(np.sin(q[3])) > 1e-3)
    X_WG = ROBOT.X_WG(q)
    solutions = IK.ik(X_WG)
    for solution in solutions[::7]:
        assert _error(solution, X_WG) < 1e-9
        assert np.all(solution >= ROBOT.q_min)
        assert np.all(solution <= ROBOT.q_max)


def _swivel(q: np.ndarray) -> float:
    """Angle of the elbow about the line from shoulder to wrist, from straight up in the robot's base."""
    poses = ROBOT.link_poses(q, 0.0)
    shoulder, elbow, wrist = (ROBOT.X_WB.actInv(poses[f"link_{k}"]).translation for k in (2, 4, 6))
    line = (wrist - shoulder) / np.linalg.norm(wrist - shoulder)
    up = np.array([0.0, 0.0, 1.0])
    up -= line * (line @ up)
    out = elbow - shoulder
    return float(np.arctan2(np.cross(up, out) @ line, up @ out))


@settings(max_examples=60, derandomize=True, deadline=None)
@given(configurations)
def test_the_configuration_one_came_from_is_among_the_solutions(q):
    assume(min(abs(np.sin(q[1])), abs(np.sin(q[3])), abs(np.sin(q[5]))) > 0.02)
    wrists = _wrists(ROBOT.X_WG(q), 8)
    solutions = IK.follow(wrists, np.full(8, _swivel(q)), np.arange(8))
    assert np.abs(solutions - q).max(axis=1).min() < 1e-7


@pytest.mark.parametrize(
    "q", [np.zeros(7), np.array([0.3, 0.0, 0.2, -1.0, 0.4, 0.0, 0.1]), np.array([0.0, 1.0] + [0.0] * 5)]
)
def test_singular_poses_are_solved_too(q):
    X_WG = ROBOT.X_WG(q)
    solutions = IK.ik(X_WG)
    assert len(solutions) > 0
    assert max(_error(solution, X_WG) for solution in solutions) < 1e-7


def test_solutions_come_with_the_largest_joint_margin_first():
    solutions = IK.ik(ROBOT.X_WG(np.radians([10.0, 20.0, 5.0, -80.0, 0.0, 60.0, 0.0])))
    margins = [IK.margin(q) for q in solutions]
    assert margins == sorted(margins, reverse=True)
    assert margins[-1] >= 0.0


def test_the_elbow_is_uppermost_at_swivel_zero():
    X_WG = ROBOT.X_WG(np.radians([10.0, 40.0, 25.0, -80.0, 0.0, 60.0, 0.0]))
    q = IK.follow(_wrists(X_WG, len(SWIVELS)), SWIVELS, np.zeros(len(SWIVELS)))
    up = ROBOT.X_WB.rotation[:, 2]
    heights = [float(up @ ROBOT.link_poses(x, 0.0)["link_4"].translation) for x in q]
    assert SWIVELS[int(np.argmax(heights))] == pytest.approx(0.0, abs=1e-12)


def test_a_pose_out_of_reach_has_no_solution():
    assert len(IK.ik(SE3(np.eye(3), np.array([3.0, 0.0, 0.5])))) == 0


def test_the_numeric_solver_reaches_what_the_closed_form_reaches():
    rng = np.random.default_rng(3)
    start = np.radians([0.0, 20.0, 0.0, -80.0, 0.0, 80.0, 0.0])
    reached = 0
    for _ in range(8):
        X_WG = ROBOT.X_WG(np.clip(start + rng.normal(size=7) * 0.5, ROBOT.q_min, ROBOT.q_max))
        q = solve_numerically(ROBOT, X_WG, [start, *rng.uniform(ROBOT.q_min, ROBOT.q_max, (4, 7))])
        if q is not None:
            reached += 1
            assert _error(q, X_WG) < 1e-5
            assert np.all((q >= ROBOT.q_min) & (q <= ROBOT.q_max))
    assert reached == 8


@settings(max_examples=15, derandomize=True, deadline=None)
@given(configurations, st.integers(0, 1000))
def test_what_the_numeric_solver_finds_is_among_the_closed_form_s_solutions(q, seed):
    assume(min(abs(np.sin(q[1])), abs(np.sin(q[3])), abs(np.sin(q[5]))) > 0.1)
    X_WG = ROBOT.X_WG(q)
    near = q + np.random.default_rng(seed).normal(size=7) * 0.2
    found = solve_numerically(ROBOT, X_WG, [near, q])
    assert found is not None
    assert _error(found, X_WG) < 1e-5
    assume(min(abs(np.sin(found[1])), abs(np.sin(found[3])), abs(np.sin(found[5]))) > 0.05)
    solutions = IK.follow(_wrists(X_WG, 8), np.full(8, _swivel(found)), np.arange(8))
    assert np.abs(solutions - found).max(axis=1).min() < 1e-3


@pytest.mark.filterwarnings("error")
def test_the_numeric_solver_says_none_out_of_reach_and_warns_of_nothing():
    assert solve_numerically(ROBOT, SE3(np.eye(3), np.array([3.0, 0.0, 0.5])), [np.zeros(7) + 0.1]) is None


def test_batched_kinematics_agree_with_the_robot_model():
    q = np.random.default_rng(0).uniform(ROBOT.q_min, ROBOT.q_max, (5, 7))
    links = place_links(ROBOT, q)
    for k in range(5):
        poses = ROBOT.link_poses(q[k], 0.0)
        for link in range(8):
            assert np.allclose(links[k, link], placement(poses[f"link_{link}"]), atol=1e-12)
