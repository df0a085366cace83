"""A run's folder as a video, and a scene as a picture."""

import os
import signal
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from fractions import Fraction
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path

import av
import numpy as np
import pinocchio as pin
from PIL import Image

from bt_tamp.quiet import quiet_imports
from bt_tamp.report.film import Filming, Recording, Shot
from bt_tamp.report.folder import VIDEO, replacing
from scenarios.scenario import Scenario
from sim.render import HEIGHT, WIDTH, Backdrop, Engine, Renderer
from sim.render_egl import egl_is_faster
from sim.robot import RobotModel

BUDGET_S = 20.0
"""Seconds that the pictures should take at most, by the first ones; it decides how many there are. Start-up and
a machine on which others work as well take as much again, or twice that."""

WORKERS = 4
RATE = 25
PACES = (
    *((1, 1), (2, 1), (3, 1), (4, 1), (5, 1), (6, 1)),
    *((4, 2), (5, 2), (6, 2), (8, 2), (8, 3), (16, 3), (32, 5)),
)
"""Speed (robot seconds a film second), and for how many of RATE's ticks a picture stands; most pictures first."""

READING_S, READING_MORE_S = 1.6, 0.9
"""Film seconds for which the film stands still to let a sentence, and each further one, be read."""

MOST_READING_S = 20.0
"""Film seconds for which it stands still in all: more sentences are shown for a shorter time each."""

END_S = 1.5
BATCH = 6
FEW = 12
"""Up to so many pictures, starting other processes takes longer than it gains."""


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
    there = (body for body in scenario.bodies.values() if body.name not in scenario.late)
    poses = {body.name: pin.SE3ToXYZQUAT(body.X_WO) for body in there}
    with Renderer(scenario) as renderer, replacing(out) as partial:
        picture = renderer.picture(scenario.robot.q0, robot.gripper.stroke, poses)
        Image.fromarray(picture).save(partial, format="PNG", optimize=True)
    return out


def shots_of(recording: Recording, cost: float) -> list[tuple[Shot, int]]:
    """The shots of a film, each with the number of its pictures at RATE; `cost` in seconds a shot.

    The first of PACES is taken that keeps within BUDGET_S, or else the last.
    """
    duration = recording.duration
    fitting = (pace for pace in PACES if duration * RATE / (pace[0] * pace[1]) * cost <= BUDGET_S)
    speed, hold = next(fitting, PACES[-1])
    step = speed * hold / RATE
    times = [min(number * step, duration) for number in range(int(np.ceil(duration / step)) + 1)]
    told = [recording.timeline.told_between(a, b) for a, b in pairwise([-np.inf, *times])]
    pauses = [READING_S + READING_MORE_S * (len(words) - 1) if words else 0.0 for words in told]
    haste = min(1.0, MOST_READING_S / max(sum(pauses), 1e-9))
    shots = [
        (Shot(t, float(speed), words), hold + round(RATE * haste * pause))
        for t, words, pause in zip(times, told, pauses, strict=True)
    ]
    last, pictures = shots[-1]
    shots[-1] = (last, pictures + round(RATE * END_S))
    return shots


def write_film(
    path: Path,
    shots: list[tuple[Shot, int]],
    pictures: Iterable[np.ndarray],
    progress: Callable[[int, int], None] | None = None,
    size: tuple[int, int] = (WIDTH, HEIGHT),
) -> None:
    """Encode pictures (height, width, 3) uint8 of `size` (width, height), each repeated as its shot says."""
    with av.open(str(path), "w", format="mp4", options={"movflags": "+faststart"}) as container:
        stream = container.add_stream("libx264", rate=RATE, options={"crf": "21", "preset": "veryfast"})
        stream.width, stream.height = size
        stream.pix_fmt = "yuv420p"
        clock = 0
        for done, ((_, repeats), picture) in enumerate(zip(shots, pictures, strict=False), start=1):
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24").reformat(format="yuv420p")
            for _ in range(repeats):
                frame.pts = clock
                frame.time_base = Fraction(1, RATE)
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
    if workers == 1 or len(shots) <= FEW:
        yield from (filming.take(shot) for shot, _ in shots)
        return
    batches = [[shot for shot, _ in shots[start : start + BATCH]] for start in range(0, len(shots), BATCH)]
    crew = ProcessPoolExecutor(workers, get_context("spawn"), _start_worker, (folder, filming.backdrop))
    try:
        waiting: deque[Future[list[np.ndarray]]] = deque()
        for batch in batches:
            with quiet_imports():  # A worker that starts here inherits what its imports may say.
                waiting.append(crew.submit(_take_batch, batch))
            if len(waiting) > 2 * workers:
                yield from waiting.popleft().result()
        while waiting:
            yield from waiting.popleft().result()
    finally:
        crew.shutdown(wait=False, cancel_futures=True)


_worker: list[Filming] = []
"""In a worker process: what it films with."""


def _start_worker(folder: Path, backdrop: Backdrop) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _worker.append(Filming(Recording.load(folder), backdrop, "tiny"))


def _take_batch(shots: list[Shot]) -> list[np.ndarray]:
    return [_worker[0].take(shot) for shot in shots]
