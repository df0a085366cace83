"""One slide: grasp the sponge, lower it until it touches, press and slide, lift it; what was true of it."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from bt_tamp.bench.open_loop import OpenLoopHybrid
from bt_tamp.bench.rig import Rig, plan_lines
from bt_tamp.bench.scene import AS_BELIEVED, SPONGE, Truth, believed, sponge_height
from planner.motion.trajectory import Trajectory
from sim.disturbance import Fault
from sim.plant import Observation
from sim.robot import WSG50, RobotModel
from sim.scene import pose_distance
from skills.control.reference import Reference

Law = Literal["hybrid", "open-loop PD hybrid", "impedance, paper's gains", "impedance, tuned"]

PAPER_STIFFNESS = np.array([100.0, 100.0, 10.0, 10.0, 10.0, 10.0])
TUNED_STIFFNESS = np.array([1000.0, 1000.0, 500.0, 50.0, 50.0, 50.0])

SPEED = 0.1
SETTLING = 0.5
"""Seconds after touchdown from which the force counts."""

LEAST_GRIP = 16.0
GRIP_RESERVE = 2.0
"""Friction may be that many times less than believed."""

BREAK = 0.5
"""Newtons below which the sponge counts as off the table."""


@dataclass(frozen=True)
class Case:
    """A law, the force in N it is told to press with, and everything that is not as it should be."""

    name: str
    law: Law
    target: float
    truth: Truth = AS_BELIEVED
    faults: tuple[Fault, ...] = ()

    @property
    def grip_force(self) -> float:
        """Newtons with which each finger holds the sponge: enough for friction to bear the target, with a reserve."""
        friction = WSG50.pad_friction * believed().bodies[SPONGE].friction
        return max(LEAST_GRIP, min(GRIP_RESERVE * self.target / (2.0 * friction), WSG50.max_force))


@dataclass(frozen=True)
class SlideResult:
    """What one slide came to. Forces are the engine's true normal forces, from SETTLING after touchdown until the
    command to lift unless said otherwise.

    mean, rms (of force − target), peak: N, the peak from touchdown on. overshoot: (largest force in the first
    SETTLING seconds − target) / target. airborne: seconds without contact since touchdown, bounces included. path:
    largest distance in the plane of the table between the tool and where it should be, in m. slip: m that the
    sponge moved in the hand. qp_us: median time to build and solve a QP.
    violations: ticks beyond a torque limit. ended: "done", or how it failed.
    """

    case: str
    law: str
    target: float
    mean: float
    rms: float
    peak: float
    overshoot: float
    airborne: float
    path: float
    slip: float
    qp_us: float
    fallbacks: int
    violations: int
    ended: str
    times: list[float] = field(repr=False)
    forces: list[float] = field(repr=False)


class _Log:
    """True forces and path errors after every tick, from the moment it is attached."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self.force: list[float] = []
        self.path: list[float] = []
        self.wanted: Callable[[], np.ndarray] | None = None
        """Where the joints should be now, during the slide."""
        rig.watch = self._look

    def _look(self, _: Observation) -> None:
        rig = self._rig
        self.force.append(rig.true_force())
        if self.wanted is not None:
            off = rig.true_pose().translation - rig.robot.X_WG(self.wanted()).translation
            self.path.append(float(np.linalg.norm(off[:2])))


def run_slide(case: Case, speed: float = SPEED) -> SlideResult:
    """Carry out one slide at `speed` m/s, from the grasp to the command to lift."""
    rig = Rig(plan_lines(RobotModel(), speed, sponge_height(case.truth)), case.grip_force, case.truth, case.faults)
    rig.grasp_sponge()
    held = rig.grip_pose()
    log = _Log(rig)
    press = _press_open_loop if case.law == "open-loop PD hybrid" else _press
    ended = press(rig, case, log)
    slip, _ = pose_distance(held, rig.grip_pose())
    result = _judge(case, rig, log, slip, ended)
    rig.close()
    return result


def _press(rig: Rig, case: Case, log: _Log) -> str:
    """Touch and slide by the controller's own laws. Returns how it ended."""
    mode = "hybrid" if case.law == "hybrid" else "impedance"
    stiffness = PAPER_STIFFNESS if case.law == "impedance, paper's gains" else TUNED_STIFFNESS

    def pressed(trajectory: Trajectory, until_contact: bool) -> Reference:
        return Reference(trajectory, mode, stiffness, case.target, until_contact=until_contact)

    controller = rig.controller
    if not rig.follow(pressed(rig.lines.lower, True)) or not controller.contact:
        return _trouble(rig, "no touchdown")
    slide = rig.lines.slide
    log.wanted = lambda: slide.at(controller.time_in_reference)[0]
    return "done" if rig.follow(pressed(slide, False)) else _trouble(rig, "not in time")


def _press_open_loop(rig: Rig, case: Case, log: _Log) -> str:
    """Lower by the controller until it touches, then leave the arm to the paper's law."""
    controller, lines = rig.controller, rig.lines
    controller.follow(Reference(lines.lower, "hybrid", force=case.target, until_contact=True))
    while not controller.contact:
        rig.tick()
        if controller.finished:
            return "no touchdown"
    start = rig.plant.observe().t
    rest = Trajectory.standstill(rig.plant.observe().q, SETTLING)
    rig.law = OpenLoopHybrid(controller.model, rest, case.target, start).update
    rig.run(SETTLING)
    begin = rig.plant.observe().t
    rig.law = OpenLoopHybrid(controller.model, lines.slide, case.target, begin).update
    log.wanted = lambda: lines.slide.at(rig.plant.observe().t - begin)[0]
    rig.run(lines.slide.duration)
    return "done"


def _trouble(rig: Rig, otherwise: str) -> str:
    stopped = rig.controller.stopped
    if stopped is not None:
        return str(stopped)
    return "contact lost" if rig.controller.contact_lost else otherwise


def _judge(case: Case, rig: Rig, log: _Log, slip: float, ended: str) -> SlideResult:
    force = np.array(log.force)
    touched = int(np.argmax(force > BREAK)) if np.any(force > BREAK) else len(force)
    settled = touched + round(SETTLING / rig.period)
    at_first, later = force[touched:settled], force[settled:]
    nothing = np.full(1, np.nan)
    at_first = at_first if len(at_first) else nothing
    later = later if len(later) else nothing
    return SlideResult(
        case=case.name,
        law=case.law,
        target=case.target,
        mean=float(np.mean(later)),
        rms=float(np.sqrt(np.mean((later - case.target) ** 2))),
        peak=float(max(at_first.max(), later.max())),
        overshoot=float(at_first.max() / case.target - 1.0),
        airborne=float((np.sum(later < BREAK) + np.sum(at_first < BREAK)) * rig.period),
        path=max(log.path, default=float("nan")),
        slip=slip,
        qp_us=rig.qp_us(),
        fallbacks=rig.controller.fallbacks,
        violations=rig.controller.torque_limit_violations,
        ended=ended,
        times=[round(k * rig.period, 4) for k in range(len(force) - touched)],
        forces=[float(f) for f in force[touched:]],
    )
