"""Does to a run what was declared or drawn: at a time, in a phase, while it plans. It sees everything, and only its own
plant sees it."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import partial
from zlib import crc32

import numpy as np

from bt_tamp.disturb.classes import KINDS, Kind, Prospect
from bt_tamp.disturb.consequence import Trial
from bt_tamp.disturb.deed import Deed, Draw, Occasion
from bt_tamp.disturb.names import CLASSES
from bt_tamp.disturb.scheduled import drawing
from bt_tamp.disturb.unmet import why_declared, why_drawn
from bt_tamp.executive.build import Machine
from bt_tamp.executive.seams import REAL, Seams
from planner.motion.motion_planner import MotionPlanner
from scenarios.disturbance import Disturbance, Moment
from sim.bullet import BulletPlant
from sim.disturbance import HAIR, DisturbedPlant
from sim.world_faults import BinShifted

WHILE_PLANNING = 0.1
"""Share of the instances that fall into the first planning."""

AGAIN = 0.1
"""Seconds after which an instance for which there was nothing to do is tried again."""

LOOK_EVERY = 0.02
"""Seconds between two looks for the consequences of what was done."""

PATIENCE = 600
"""How often at most, unless it must come: what was taken for a while comes back, or the goal would be out of reach."""

STILL_PHASE = 0.3
"""Seconds taken for the length of a phase in which only the fingers move."""


@dataclass
class _Coming:
    """One instance: what draws it, by which chance, and when: `due` (s), once that is known. number: of the scene's
    entry, if it is one. is_owed: it follows from what was done before, and is tried as long as the run lasts."""

    name: str
    draw: Draw
    rng: np.random.Generator
    moment: Moment | None = None
    kind: Kind | None = None
    due: float | None = None
    share: float = 0.0
    spot: tuple[str, str] | None = None
    met: int = 0
    tries: int = 0
    number: int = 0
    is_owed: bool = False


@dataclass
class Driver:
    """Brings disturbances over one run: those of the scene, and one of each class named.

    `hear` must be told of every event of the run, `bind` of the machine once it is wired, `close` of the run's end.
    """

    declared: Iterable[Disturbance]
    classes: Iterable[str]
    seed: int
    report: Callable[..., None]
    _coming: list[_Coming] = field(default_factory=list, init=False)
    _machine: Machine | None = field(default=None, init=False)
    _plant: DisturbedPlant | None = field(default=None, init=False)
    _motion: MotionPlanner | None = field(default=None, init=False)
    _trials: list[Trial] = field(default_factory=list, init=False)
    _told: int = field(default=0, init=False)
    _look_again: float = field(default=0.0, init=False)
    _struck: set[str] = field(default_factory=set, init=False)
    _given_up: list[_Coming] = field(default_factory=list, init=False)
    _began: dict[str, None] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        for number, one in enumerate(self.declared):
            rng = np.random.default_rng([self.seed, 11, number])
            draw, moment = drawing(one.happening), one.moment
            self._coming.append(_Coming("declared", draw, rng, moment=moment, due=moment.at, number=number))
        for name in self.classes:
            kind, rng = KINDS[name], self._stream(name)
            if kind.draw is None:
                continue
            coming = _Coming(name, kind.draw, rng, kind=kind, share=kind.latest * float(rng.uniform()))
            if kind.while_planning and rng.uniform() < WHILE_PLANNING:
                coming.due = float(rng.uniform(0.05, 0.3))
            self._coming.append(coming)

    @property
    def seams(self) -> Seams:
        """What this run is wired with."""
        found = Seams(plant=self._wrapped)
        for name in self.classes:
            given = vars(KINDS[name].seams(self._stream(name), partial(self._strike, name)))
            found = replace(found, **{key: part for key, part in given.items() if part is not getattr(REAL, key)})
        return found

    def bind(self, machine: Machine) -> None:
        """The machine is wired."""
        self._machine = machine
        self._motion = MotionPlanner(machine.robot, self.seed)

    def hear(self, kind: str, t: float, phase: str = "", action: str = "") -> None:
        """Something happened in the run."""
        if kind == "action_started":
            self._choose_phases()
        if kind == "phase":
            self._began[phase] = None
            for coming in self._coming:
                self._meet(coming, t, action, phase)

    def close(self) -> None:
        """The run is over: tell what did not come."""
        for coming in [*self._given_up, *self._coming]:
            if coming.is_owed:
                continue
            if coming.moment is None:
                sentence = why_drawn(coming.name, coming.tries, coming.due is not None)
            else:
                sentence = why_declared(coming.number, coming.moment, coming.met, coming.tries, self._began)
            self.report("never_came", name=coming.name, sentence=sentence)
        for name in self.classes:
            if KINDS[name].draw is None and name not in self._struck:
                self.report("never_came", name=name, sentence=why_drawn(name, 0, True))

    def _stream(self, name: str) -> np.random.Generator:
        return np.random.default_rng([self.seed, 13, crc32(name.encode())])

    def _wrapped(self, plant: BulletPlant) -> DisturbedPlant:
        self._plant = DisturbedPlant(plant)
        self._plant.before_step = self._look_at_the_clock
        return self._plant

    def _strike(self, name: str) -> None:
        """Software fails, now: the first time is told."""
        if name not in self._struck:
            self._struck.add(name)
            self._tell(name, Deed(CLASSES[name].sentence, is_certain=True))

    def _choose_phases(self) -> None:
        """Every class goes through the kinds of phases in the plan from seed to seed; of a kind it takes any. Chosen
        anew when the action in question is no longer to come."""
        assert self._machine is not None
        agenda = self._machine.agenda
        left = {str(action) for action in agenda.left}
        scenario = self._machine.context.scene.scenario
        for coming in self._coming:
            is_to_come = coming.spot is not None and coming.spot[0] in left
            if coming.kind is None or coming.due is not None or is_to_come:
                continue
            coming.spot = None
            kinds: dict[tuple[str, str], list[tuple[str, str]]] = {}
            refinements = agenda.refinements[len(agenda.refinements) - len(agenda.left) :]
            for number, refinement in enumerate(refinements):
                later = agenda.left[number:]
                for phase in refinement.phases:
                    # Once the last thing is let go of, there is nothing left that could go wrong.
                    if refinement is refinements[-1] and phase.name == refinement.phases[-1].name:
                        break
                    if coming.kind.fits(Prospect(phase, later, scenario, agenda.goal)):
                        spots = kinds.setdefault((refinement.action.name, phase.name), [])
                        spots.append((str(refinement.action), phase.name))
            if kinds:
                spots = kinds[sorted(kinds)[(self.seed + crc32(coming.name.encode())) % len(kinds)]]
                coming.spot = spots[int(coming.rng.integers(len(spots)))]

    def _meet(self, coming: _Coming, t: float, action: str, phase: str) -> None:
        if coming.due is not None:
            return
        moment = coming.moment
        if moment is not None:
            if phase == moment.phase and moment.action in (None, action.partition("(")[0]):
                coming.met += 1
                if coming.met == moment.nth:
                    coming.due = t + moment.after
        elif coming.spot == (action, phase):
            coming.due = t + coming.share * self._length_of_phase()

    def _length_of_phase(self) -> float:
        assert self._machine is not None
        phase = self._machine.context.phase
        return max(phase.trajectory.duration, STILL_PHASE) if phase is not None else STILL_PHASE

    def _look_at_the_clock(self, t: float) -> None:
        # One in a step: the next is to see what became of the world by this one.
        coming = next((one for one in self._coming if one.due is not None and one.due <= t), None)
        if coming is not None:
            self._do(coming, t)
        if self._trials and t >= self._look_again:
            self._look_for_consequences(t)

    def _look_for_consequences(self, t: float) -> None:
        self._look_again = t + LOOK_EVERY
        now = self._occasion(t, np.random.default_rng(self.seed))
        for trial in list(self._trials):
            is_proven = trial.is_proven(now)
            if is_proven:
                self.report("mattered", number=trial.number)
            if is_proven or t > trial.until:
                self._trials.remove(trial)

    def _occasion(self, t: float, rng: np.random.Generator) -> Occasion:
        assert self._machine is not None
        assert self._plant is not None
        assert self._motion is not None
        return Occasion(t, self._plant.truth(), self._machine, self._motion, rng)

    def _do(self, coming: _Coming, t: float) -> None:
        now = self._occasion(t, coming.rng)
        deed = coming.draw(now) if _is_fit(coming.kind, now) else None
        if deed is None:
            coming.tries += 1
            coming.due = t + AGAIN
            if coming.tries > PATIENCE and not coming.is_owed:
                self._coming.remove(coming)
                self._given_up.append(coming)
            return
        self._coming.remove(coming)
        self._carry_out(coming, deed, now)

    def _carry_out(self, coming: _Coming, deed: Deed, now: Occasion) -> None:
        assert self._plant is not None
        self._tell(coming.name, deed)
        # What concerns nothing in the world changes nothing in it; what the robot itself moves meanwhile doesn't count.
        if not deed.is_certain and (deed.names or deed.goal is not None):
            self._trials.append(Trial.of(self._told - 1, deed, now))
            self._look_again = now.t + HAIR
        for fault in deed.faults:
            self._plant.suffer(fault)
        if deed.goal is not None:
            now.machine.agenda.want(deed.goal)
        if deed.later is not None:
            self._coming.append(_Coming(coming.name, deed.later.draw, coming.rng, due=deed.later.t, is_owed=True))

    def _tell(self, name: str, deed: Deed) -> None:
        machine = self._machine
        assert machine is not None
        running, phase = machine.agenda.running, machine.context.phase
        self._told += 1
        self.report(
            "disturbed",
            name=name,
            sentence=deed.sentence,
            bodies=list(deed.names),
            phase=phase.name if phase is not None and running is not None else "planning",
            action=str(running or ""),
            mattered=deed.is_certain,
            hidden_s=self._hidden_s() if deed.names else 0.0,
            is_urgent=running is not None
            and (deed.is_in_the_way or not frozenset(running.args).isdisjoint(deed.names)),
            shifts={fault.region: fault.by for fault in deed.faults if isinstance(fault, BinShifted)},
        )

    def _hidden_s(self) -> float | None:
        assert self._plant is not None
        hidden = self._plant.hides_poses_for()
        return hidden if math.isfinite(hidden) else None


def _is_fit(kind: Kind | None, now: Occasion) -> bool:
    """May it come now? What found nothing to do in the phase it was drawn for comes in another of its kind."""
    return (
        kind is None
        or now.phase is None
        or kind.fits(Prospect(now.phase, now.left, now.scenario, now.machine.agenda.goal))
    )
