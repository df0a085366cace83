"""Whole runs in parallel processes. A run that crashes, or whose process is killed, costs none of the others."""

import os
import re
import signal
import time
from collections import Counter
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, replace
from threading import TIMEOUT_MAX, Thread

from joblib.externals.loky import ProcessPoolExecutor
from joblib.externals.loky.process_executor import BrokenProcessPool

from bt_tamp.options import RunOptions

MAX_TRIES = 2
"""How often a run is tried, at most, whose process vanishes."""

TO_BEGIN = 600.0
"""Seconds that a run gets on top, for imports and for what is compiled once."""

SLOWEST = 5.0
"""Times its longest simulated time that a run may take: one that takes longer hangs. It ends itself otherwise."""

PARENT_EVERY = 0.5
"""Seconds between two looks of a worker at whether its parent still is."""

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Variables that keep a process's libraries to one thread."""


@dataclass(frozen=True)
class Job:
    """One run: a scene by name or path, its options, the seed among them, and a digest of the scene file's text (""
    for none), so that a run of an edited file is another run."""

    scene: str
    options: RunOptions
    digest: str = ""


@dataclass(frozen=True)
class Finished:
    """What became of a job, at its how-manieth try. outcome: that of the run, or "crashed" (an error in our code),
    "killed" (its process vanished, or hung and was ended), "wrong_input". result: `result.json` as text, None unless
    the run came to its end."""

    job: Job
    outcome: str
    reason: str
    result: str | None = None
    tries: int = 1


@dataclass(frozen=True)
class _Running:
    """A job at work, and when (s, `time.monotonic`) its process will be taken to hang."""

    job: Job
    executor: ProcessPoolExecutor
    until: float


def patience(job: Job) -> float:
    """Seconds of real time after which a job's process is taken to hang."""
    return TO_BEGIN + SLOWEST * job.options.max_sim_time


def run_jobs(
    jobs: Iterable[Job],
    processes: int,
    work: Callable[[Job], Finished] | None = None,
    allowed: Callable[[Job], float] = patience,
) -> Generator[Finished, None, None]:
    """Run the jobs, so many at a time, and yield each as it comes to its end. work: what runs a job (`run_job`);
    allowed: the seconds of real time that a job gets before its process is ended.

    Every process is an executor of its own, so that one that dies can be told from its neighbours. A job whose process
    vanishes is tried MAX_TRIES times in all: one that kills it each time is recorded as such. One that hangs is not
    tried again at once: it would cost as much time once more.
    Leaving the iterator early ends the processes.
    """
    work = run_job if work is None else work
    waiting = iter(jobs)
    idle = [_executor() for _ in range(processes)]
    again: list[Job] = []
    tries: Counter[Job] = Counter()
    running: dict[Future, _Running] = {}
    try:
        while True:
            while idle and (job := again.pop() if again else next(waiting, None)) is not None:
                executor = idle.pop()
                tries[job] += 1
                try:
                    future = _submitted(executor, work, job)
                except BrokenProcessPool:  # Its process vanished while it was idle.
                    executor = _executor()
                    future = _submitted(executor, work, job)
                running[future] = _Running(job, executor, time.monotonic() + allowed(job))
            if not running:
                return
            left = max(0.0, min(one.until for one in running.values()) - time.monotonic())
            done = wait(running, min(left, TIMEOUT_MAX), return_when=FIRST_COMPLETED).done
            hanging = {future for future, one in running.items() if one.until <= time.monotonic()} - done
            for future in [*done, *hanging]:
                job, executor = running[future].job, running[future].executor
                del running[future]
                finished = _hung(job, allowed(job)) if future in hanging else _harvest(job, future)
                if finished.outcome == "killed":
                    executor.shutdown(wait=False, kill_workers=True)
                    executor = _executor()
                idle.append(executor)
                if finished.outcome == "killed" and future not in hanging and tries[job] < MAX_TRIES:
                    again.append(job)
                    continue
                yield replace(finished, tries=tries[job])
    finally:
        for executor in [*idle, *(one.executor for one in running.values())]:
            executor.shutdown(wait=False, kill_workers=True)


def run_job(job: Job) -> Finished:
    """Run one job in this process, without a folder. An error in our code is an outcome too."""
    from bt_tamp.quiet import quiet_imports

    with quiet_imports():
        from bt_tamp.disturb.classes import amended
        from bt_tamp.executive.loop import run_scenario
        from bt_tamp.report.recorder import RunRecorder
        from scenarios.errors import SceneError
        from scenarios.load import load_scenario
    from bt_tamp.garbage import collect_rarely

    collect_rarely()
    try:
        scenario = amended(load_scenario(job.scene, job.options.seed), job.options.disturb)
        result = run_scenario(scenario, job.options, RunRecorder(scenario))
    except SceneError as error:
        return Finished(job, "wrong_input", str(error))
    except Exception as error:
        return Finished(job, "crashed", f"{type(error).__name__}: {_short(error)}")
    return Finished(job, result.outcome, result.reason, result.to_json())


def _executor() -> ProcessPoolExecutor:
    return ProcessPoolExecutor(
        max_workers=1, env=dict.fromkeys(THREADS, "1"), initializer=_end_with, initargs=(os.getpid(),)
    )


def _submitted(executor: ProcessPoolExecutor, work: Callable[[Job], Finished], job: Job) -> Future:
    """The job given to its process, which begins now if it has not yet.

    The terminal's Ctrl-C reaches the whole group, and the parent decides what ends: a process begun while the signal is
    blocked never hears of it, the parent does afterwards.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        return executor.submit(work, job)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _end_with(parent: int) -> None:
    """End this process soon after its parent, which may have been killed: it would wait for work for ever."""

    def look() -> None:
        while os.getppid() == parent:
            time.sleep(PARENT_EVERY)
        os._exit(1)

    Thread(target=look, daemon=True).start()


def _hung(job: Job, seconds: float) -> Finished:
    return Finished(job, "killed", f"it had not come to its end after {seconds:.0f} s of real time, and was ended")


def _harvest(job: Job, future: Future) -> Finished:
    try:
        return future.result()
    except BrokenProcessPool as error:
        codes = re.search(r"\{(.+)\}", str(error))
        return Finished(job, "killed", "its process vanished" + (f", {codes[1]}" if codes else ""))
    except Exception as error:
        return Finished(job, "crashed", f"{type(error).__name__}: {_short(error)}")


def _short(error: BaseException) -> str:
    text = " ".join(str(error).split())
    return text if len(text) <= 200 else text[:199] + "…"
