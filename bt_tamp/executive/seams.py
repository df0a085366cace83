"""Where something else can be wired in: a plant that is disturbed, planners and solvers that fail."""

from collections.abc import Callable
from dataclasses import dataclass

from planner.motion.motion_planner import MotionPlanner
from planner.task.planner import TaskPlanner
from sim.bullet import BulletPlant
from sim.disturbance import DisturbedPlant
from skills.control.osqp_ import Solver


def _same(part: BulletPlant) -> BulletPlant:
    return part


def _itself(planner: TaskPlanner) -> TaskPlanner:
    return planner


@dataclass(frozen=True)
class Seams:
    """What takes the place of the real parts: the plant and the task planner are given to a function that may wrap
    them; motion: what makes the motion planner; solver: solves the controller's QP (None: its own)."""

    plant: Callable[[BulletPlant], BulletPlant | DisturbedPlant] = _same
    task_planner: Callable[[TaskPlanner], TaskPlanner] = _itself
    motion: Callable[..., MotionPlanner] = MotionPlanner
    solver: Solver | None = None


REAL = Seams()
"""Nothing takes the place of anything."""
