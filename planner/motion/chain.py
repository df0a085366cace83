"""Forward kinematics of many configurations at once, in numpy."""

import numpy as np

from sim.robot import RobotModel


def place_links(robot: RobotModel, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (n,8,3,3) and origins (n,8,3) in W of links 0 to 7 at q (n,7)."""
    n = len(q)
    R, p = np.empty((n, 8, 3, 3)), np.empty((n, 8, 3))
    R[:, 0], p[:, 0] = robot.X_WB.rotation, robot.X_WB.translation
    turn = np.zeros((n, 3, 3))
    turn[:, 2, 2] = 1.0
    for k, X in enumerate(robot.model.jointPlacements[1:]):
        cosine, sine = np.cos(q[:, k]), np.sin(q[:, k])
        turn[:, 0, 0], turn[:, 0, 1] = cosine, -sine
        turn[:, 1, 0], turn[:, 1, 1] = sine, cosine
        if k == 0:
            R[:, 1], p[:, 1] = X.rotation @ turn, X.translation
        else:
            R[:, k + 1] = (R[:, k] @ X.rotation) @ turn
            p[:, k + 1] = p[:, k] + R[:, k] @ X.translation
    return R, p


def tcp_path(robot: RobotModel, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (n,3,3) and positions (n,3) of the gripper frame in W at q (n,7)."""
    R, p = place_links(robot, q)
    X_7G = robot.model.frames[robot.tcp_id].placement
    return R[:, 7] @ X_7G.rotation, p[:, 7] + R[:, 7] @ X_7G.translation
