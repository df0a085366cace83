"""The laws by which the arm follows a reference: what each asks of the QP at one instant."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from skills.control.contact import ContactWrench, along, with_force_along
from skills.control.force import ForceLoop, smooth_step
from skills.control.limits import ApproachLimit, Row
from skills.control.reference import Reference
from skills.control.state import Target
from skills.control.tasks import LANDING_DAMPING, SINK_DAMPING, HybridTask, JointTask, PoseTask, PostureTask, Task

GUARDED, GUARDED_DAMPING = 400.0, 25.0
"""Gains in 1/s² and 1/s on the way to contact: low, for what a hard surface does to the velocity comes back as
torque at once, and until the touch is noticed the arm goes on pressing with the stiffness."""

LANDING = 0.12
"""Seconds after touching in which bouncing is damped."""

APPROACH_LIMIT = 0.03
"""Metres per second towards the surface that the QP allows while contact is sought or kept."""

Joints = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Where the joints should be: position, velocity and acceleration (7,)."""


class Law(NamedTuple):
    """The tasks of an instant, the wrench (6,) on the tool, in W, that they rely on, and limits of their own."""

    tasks: Sequence[Task]
    wrench: np.ndarray
    limits: Sequence[Row] = ()


def track(joints: Joints) -> Law:
    """Follow stiffly in joint space."""
    return Law([JointTask(*joints)], _NO_WRENCH)


def seek(joints: Joints, reference: Reference) -> Law:
    """Move towards a contact."""
    return Law([JointTask(*joints, GUARDED_DAMPING, GUARDED)], _NO_WRENCH, _approach(reference))


def press(joints: Joints, target: Target, reference: Reference, felt: ContactWrench, loop: ForceLoop) -> Law:
    """Follow in the plane of contact, regulating the force felt along its normal: one more tick of the loop."""
    normal = reference.normal
    force = loop.update(along(normal, felt.raw))
    landed = smooth_step(loop.time / LANDING) if reference.until_contact else 1.0
    damping = LANDING_DAMPING + (SINK_DAMPING - LANDING_DAMPING) * landed
    task = HybridTask(target, reference.R_WC, reference.damping * damping)
    return Law([task, PostureTask(*joints)], with_force_along(normal, force, felt.smooth), _approach(reference))


def comply(joints: Joints, target: Target, reference: Reference, period: float) -> Law:
    """Follow as a mass, spring and damper. period: of the control ticks, in s."""
    assert reference.stiffness is not None
    task = PoseTask(target, reference.stiffness, period, reference.damping)
    return Law([task, PostureTask(*joints)], _NO_WRENCH, _approach(reference))


def lowered(target: Target, reference: Reference, force: float, height: float) -> Target:
    """The target in the plane through the touched point, `height` m along the normal, and below it by `force` N over
    the stiffness."""
    assert reference.stiffness is not None
    normal = reference.normal
    depth = force / float(normal**2 @ reference.stiffness[:3])
    across = np.outer(normal, normal)
    V, A = target.V.copy(), target.A.copy()
    V[:3] -= across @ V[:3]
    A[:3] -= across @ A[:3]
    return Target(target.p + normal * (height - depth - normal @ target.p), target.R, V, A)


def _approach(reference: Reference) -> Sequence[Row]:
    return (ApproachLimit(reference.normal, APPROACH_LIMIT),) if reference.force > 0.0 else ()


_NO_WRENCH = np.zeros(6)
