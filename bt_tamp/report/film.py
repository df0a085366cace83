"""A recorded run as pictures: at each time the rendered state, the forces, the set-points and the words."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pinocchio import SE3

from bt_tamp.report.events import Event, read_events
from bt_tamp.report.folder import EVENTS, SCENARIO, SIGNALS
from bt_tamp.report.overlay import STRIP, Arrow, Path3, Words, draw
from bt_tamp.report.scenario_json import scenario_from_json
from bt_tamp.report.signals import Signals
from bt_tamp.report.timeline import Timeline
from scenarios.scenario import Scenario
from sim.render import HEIGHT, WIDTH, Backdrop, Engine, Renderer
from sim.robot import RobotModel

CONTACT_MEMORY = 0.12
"""Seconds for which recorded contacts are shown: they are recorded less often than the signals."""

LEAST_FORCE = 0.3
DOT_SPACING = 0.015


@dataclass(frozen=True)
class Shot:
    """One picture of the film: robot time t (s), speed as a factor, and what is told."""

    t: float
    speed: float
    told: tuple[str, ...] = ()


@dataclass(frozen=True)
class Recording:
    """What a run's folder holds of it. shifts: when (s) which region was shifted, by how much in W (m); in order."""

    scenario: Scenario
    signals: Signals
    timeline: Timeline
    shifts: tuple[tuple[float, str, tuple[float, ...]], ...] = ()

    @staticmethod
    def load(folder: Path) -> "Recording":
        """Read a run's folder. Raises ValueError or OSError naming the file that is missing or broken."""
        scenario = scenario_from_json((folder / SCENARIO).read_text(encoding="utf-8"))
        signals = Signals.load(folder / SIGNALS)
        if not len(signals.t):
            raise ValueError(f"{folder / SIGNALS}: holds no sample, expected a run that got as far as moving")
        events = list(read_events(folder / EVENTS))
        return Recording(scenario, signals, Timeline.of(events), tuple(_shifts(events)))

    def scene_at(self, t: float) -> Scenario:
        """The scene with its regions where they stood at time t (s)."""
        regions = dict(self.scenario.regions)
        for _, name, by in (shift for shift in self.shifts if shift[0] <= t):
            X_WR = regions[name].X_WR
            regions[name] = replace(regions[name], X_WR=SE3(X_WR.rotation, X_WR.translation + np.array(by)))
        return self.scenario if regions == self.scenario.regions else replace(self.scenario, regions=regions)

    @property
    def duration(self) -> float:
        """Robot time in seconds, up to the last thing that is told."""
        return max(float(self.signals.t[-1]), self.timeline.end)


class Filming:
    """Draws shots of one recording. A context manager; `close` frees the engine."""

    def __init__(self, recording: Recording, backdrop: Backdrop | None = None, engine: Engine | None = None) -> None:
        self.recording = recording
        self.backdrop = backdrop or backdrop_of(recording.scenario)
        self._renderer = Renderer(recording.scenario, self.backdrop, engine)
        self._scenario = recording.scenario
        self._engine: Engine | None = engine
        self._hands = frozenset(RobotModel.links)

    def __enter__(self) -> "Filming":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the engine."""
        self._renderer.close()

    def take(self, shot: Shot) -> np.ndarray:
        """The picture (HEIGHT, WIDTH, 3) uint8 of a shot."""
        signals = self.recording.signals
        self._look_at(self.recording.scene_at(shot.t))
        row = int(np.clip(np.searchsorted(signals.t, shot.t + 1e-9) - 1, 0, len(signals.t) - 1))
        seen = zip(signals.bodies.tolist(), signals.poses[row], strict=True)
        poses = {name: pose for name, pose in seen if np.isfinite(pose[0])}
        picture = self._renderer.picture(signals.q[row], float(signals.opening[row]), poses)
        force = float(signals.force[row])
        words = Words(
            self.recording.timeline.caption(shot.t),
            shot.t,
            force if force > LEAST_FORCE else None,
            shot.speed,
            shot.told,
        )
        return draw(picture, self._renderer.camera, self._arrows(shot.t), set_points(signals, row), words)

    def _look_at(self, scenario: Scenario) -> None:
        """Regions may have been shifted: what never moves is drawn anew then, from the same point of view."""
        if scenario.regions == self._scenario.regions:
            return
        self._renderer.close()
        backdrop = Backdrop.seen(scenario, self.backdrop.camera, self.backdrop.light)
        self._renderer, self._scenario = Renderer(scenario, backdrop, self._engine), scenario

    def _arrows(self, t: float) -> list[Arrow]:
        signals = self.recording.signals
        last = int(np.searchsorted(signals.contact_t, t + 1e-9)) - 1
        if last < 0 or t - signals.contact_t[last] > CONTACT_MEMORY:
            return []
        now = np.flatnonzero(signals.contact_t == signals.contact_t[last])
        names = [(str(signals.contact_names[a]), str(signals.contact_names[b])) for a, b in signals.contact_pair[now]]
        return net_forces(names, signals.contact_p[now], signals.contact_f[now], self._hands)


def _shifts(events: Iterable[Event]) -> Iterator[tuple[float, str, tuple[float, ...]]]:
    for event in events:
        for name, by in event.data.get("shifts", {}).items():
            yield event.t, name, tuple(by)


def backdrop_of(scenario: Scenario) -> Backdrop:
    """A scene's backdrop that leaves room for the strip."""
    return Backdrop.of(scenario, WIDTH, HEIGHT, foot=STRIP / HEIGHT)


def net_forces(
    pairs: Sequence[tuple[str, str]], points: np.ndarray, forces: np.ndarray, robot: frozenset[str]
) -> list[Arrow]:
    """Contact points (n,3) with forces (n,3) on each pair's first, summed up to what a person wants to see.

    For a thing in the hand that touches something else: the force of that on it. For a thing that only
    the robot touches: what the robot feels of it (the squeeze of the two fingers cancels out).
    """
    outside: dict[tuple[str, str], list[tuple[np.ndarray, np.ndarray]]] = {}
    by_hand: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {}
    touched = {name for pair in pairs for name in pair if len(robot.intersection(pair)) == 1} - robot
    for (first, second), point, force in zip(pairs, points, forces, strict=True):
        if first in robot or second in robot:
            thing = second if first in robot else first
            by_hand.setdefault(thing, []).append((point, force if first in robot else -force))
        else:
            key = (first, second) if first in touched else (second, first)
            outside.setdefault(key, []).append((point, force if first in touched else -force))
    groups = list(outside.values())
    groups += [group for thing, group in by_hand.items() if not any(thing in pair for pair in outside)]
    arrows = []
    for group in groups:
        weights = np.array([np.linalg.norm(force) for _, force in group])
        total = np.sum([force for _, force in group], axis=0)
        if np.linalg.norm(total) > LEAST_FORCE:
            arrows.append(Arrow(np.average([point for point, _ in group], axis=0, weights=weights), total))
    return arrows


def set_points(signals: Signals, row: int) -> Path3 | None:
    """The set-points of the spell of contact that sample `row` falls into, evenly spaced; None in free space."""
    given = np.isfinite(signals.p_ref[:, 0])
    if not given[row]:
        return None
    gaps = np.flatnonzero(~given)
    place = int(np.searchsorted(gaps, row))
    start = int(gaps[place - 1]) + 1 if place else 0
    end = int(gaps[place]) if place < len(gaps) else len(given)
    spell = signals.p_ref[start:end]
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(spell, axis=0), axis=1))])
    wanted = np.arange(0.0, way[-1] + 1e-9, DOT_SPACING)
    points = np.column_stack([np.interp(wanted, way, axis) for axis in spell.T])
    return Path3(points, int(np.searchsorted(wanted, way[row - start] + 1e-9, side="right")))
