"""A run's folder as a video, and a scene as a picture."""

import os
import time
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import pinocchio as pin
from joblib import Parallel, delayed
from PIL import Image

from bt_tamp.report.film import Filming, Recording, Shot
from bt_tamp.report.folder import SIGNALS, VIDEO, replacing
from scenarios.scenario import Scenario
from sim.render import Backdrop, Engine, Renderer
from sim.render_egl import egl_is_faster
from sim.robot import RobotModel

BUDGET_S = 40.0
"""Seconds that rendering should take at most; it decides how many pictures the film has."""

WORKERS = 4
RATE = 25
PACES = ((1, 25), (2, 25), (3, 25), (4, 25), (4, 15), (4, 10), (5, 10), (6, 10), (8, 10), (8, 5), (16, 5), (32, 5))
"""Speed (robot seconds a film second) and pictures a film second, from most pictures to fewest."""

READING_S, READING_MORE_S = 1.6, 0.9
"""Film seconds for which the film stands still to let a sentence, and each further one, be read."""

END_S = 1.5
BATCH = 6


def render_run(folder: Path, out: Path | None = None, progress: Callable[[int, int], None] | None = None) -> Path:
    """Write the film of a run (H.264, 1280×720) to `out` or into its folder; where it lies.

    progress: called with pictures done and in all. Raises ValueError or OSError for a folder that
    can't be read or a place that can't be written.
    """
    recording = Recording.load(folder)
    target = folder / VIDEO if out is None else out
    engine: Engine = "egl" if egl_is_faster() else "tiny"
    workers = 1 if engine == "egl" else max(1, min(WORKERS, len(os.sched_getaffinity(0))))
    with Filming(recording, engine=engine) as filming:
        cost = _cost(filming) / workers
        shots = shots_of(recording, cost)
        with replacing(target) as partial:
            pictures = _pictures(folder, filming, shots, workers)
            write_film(partial, shots, pictures, progress)
    return target


def show_scene(scenario: Scenario, out: Path) -> Path:
    """Write a picture (PNG, 1280×720) of a scene as it stands at the start; where it lies."""
    robot = RobotModel(scenario.robot.model, scenario.robot.X_WB)
    poses = {name: pin.SE3ToXYZQUAT(body.X_WO) for name, body in scenario.bodies.items()}
    with Renderer(scenario) as renderer, replacing(out) as partial:
        picture = renderer.picture(scenario.robot.q0, robot.gripper.stroke, poses)
        Image.fromarray(picture).save(partial, format="PNG", optimize=True)
    return out


def shots_of(recording: Recording, cost: float) -> list[tuple[Shot, int]]:
    """The shots of a film, each with the number of its pictures at RATE; `cost` in seconds a shot.

    The first of PACES is taken that keeps within BUDGET_S, or else the last.
    """
    duration = recording.duration
    fitting = (pace for pace in PACES if duration / pace[0] * pace[1] * cost <= BUDGET_S)
    speed, rate = next(fitting, PACES[-1])
    step = speed / rate
    hold = RATE // rate
    shots: list[tuple[Shot, int]] = []
    before = -np.inf
    for number in range(int(np.ceil(duration / step)) + 1):
        t = min(number * step, duration)
        told = recording.timeline.told_between(before, t)
        pause = round(RATE * (READING_S + READING_MORE_S * (len(told) - 1))) if told else 0
        shots.append((Shot(t, float(speed), told), hold + pause))
        before = t
    last, pictures = shots[-1]
    shots[-1] = (last, pictures + round(RATE * END_S))
    return shots


def write_film(
    path: Path,
    shots: list[tuple[Shot, int]],
    pictures: Iterator[np.ndarray],
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Encode pictures (height, width, 3) uint8, each repeated as its shot says."""
    with av.open(str(path), "w", format="mp4", options={"movflags": "+faststart"}) as container:
        stream = container.add_stream("libx264", rate=RATE, options={"crf": "21", "preset": "veryfast"})
        stream.pix_fmt = "yuv420p"
        stream.time_base = Fraction(1, RATE)
        clock = 0
        for done, ((_, repeats), picture) in enumerate(zip(shots, pictures, strict=True), start=1):
            stream.height, stream.width = picture.shape[:2]
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24").reformat(format="yuv420p")
            for _ in range(repeats):
                frame.pts = clock
                frame.time_base = stream.time_base
                container.mux(stream.encode(frame))
                clock += 1
            if progress is not None:
                progress(done, len(shots))
        container.mux(stream.encode())


def _cost(filming: Filming) -> float:
    """Seconds that a shot takes here."""
    filming.take(Shot(0.0, 1.0))
    started = time.perf_counter()
    for part in (0.25, 0.75):
        filming.take(Shot(filming.recording.duration * part, 1.0))
    return (time.perf_counter() - started) / 2


def _pictures(folder: Path, filming: Filming, shots: list[tuple[Shot, int]], workers: int) -> Iterator[np.ndarray]:
    if workers == 1:
        yield from (filming.take(shot) for shot, _ in shots)
        return
    batches = [[shot for shot, _ in shots[start : start + BATCH]] for start in range(0, len(shots), BATCH)]
    options: dict[str, Any] = {"return_as": "generator", "pre_dispatch": 2 * workers, "batch_size": 1}
    key = (str(folder.resolve()), (folder / SIGNALS).stat().st_mtime_ns)
    crew: Any = Parallel(n_jobs=workers, **options)
    for batch in crew(delayed(_take_batch)(key, filming.backdrop, batch) for batch in batches):
        yield from batch


_filming: dict[tuple[str, int], Filming] = {}
"""In a worker: what it films with, kept from batch to batch; by folder and age of its signals."""


def _take_batch(key: tuple[str, int], backdrop: Backdrop, shots: list[Shot]) -> list[np.ndarray]:
    """In a worker: the pictures of some shots."""
    if key not in _filming:
        for old in _filming.values():
            old.close()
        _filming.clear()
        _filming[key] = Filming(Recording.load(Path(key[0])), backdrop, "tiny")
    return [_filming[key].take(shot) for shot in shots]
