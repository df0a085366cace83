"""The results of sweeps in one SQLite file, written run by run."""

import json
import sqlite3
from collections.abc import Iterable, Mapping
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

from bt_tamp.errors import UserError, refusing
from bt_tamp.sweep import MAX_TRIES, Finished, Job

UNFINISHED = ("crashed", "killed")
"""Outcomes that a resumed sweep tries again, until MAX_TRIES."""

_TABLE = """
CREATE TABLE IF NOT EXISTS runs (
    scene TEXT NOT NULL, seed INTEGER NOT NULL, options TEXT NOT NULL,
    outcome TEXT NOT NULL, reason TEXT NOT NULL, result TEXT,
    tries INTEGER NOT NULL DEFAULT 1,
    stored_at TEXT NOT NULL DEFAULT CURRENT_TIMESTAMP,
    PRIMARY KEY (scene, seed, options)
)
"""

_COLUMNS = frozenset("scene seed options outcome reason result tries".split())


@dataclass(frozen=True)
class Stored:
    """A stored run. `result` is `result.json` as text, None for a run that never came to its end; `options` as stored,
    the seed not among them."""

    outcome: str
    reason: str
    result: str | None
    tries: int
    scene: str
    seed: int
    options: Mapping[str, Any]

    @property
    def is_final(self) -> bool:
        """Has it come to its end, or been tried often enough?"""
        return self.outcome not in UNFINISHED or self.tries >= MAX_TRIES


class SweepStore:
    """A context manager around the file, made if need be (is_made). Raises UserError when it can't be used."""

    def __init__(self, path: Path, is_made: bool = True) -> None:
        self._path = path
        try:
            self._connection = sqlite3.connect(path, timeout=30.0)
            columns = {row[1] for row in self._connection.execute("PRAGMA table_info(runs)")}
            if not columns >= _COLUMNS and (columns or not is_made):
                raise UserError(
                    f"{path}: has no table `runs` like a sweep's, expected a store that `bt-tamp sweep` wrote"
                )
            self._connection.execute("PRAGMA journal_mode=WAL")
            self._connection.execute(_TABLE)
            self._connection.commit()
        except sqlite3.Error as error:
            raise UserError(f"{path}: can't be used as a store of results ({error})") from None

    def __enter__(self) -> "SweepStore":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._connection.close()

    def add(self, finished: Finished) -> Stored:
        """Store a run, in place of an earlier one of the same job."""
        before = self.get(finished.job)
        tries = finished.tries + (before.tries if before is not None and before.outcome in UNFINISHED else 0)
        outcome, reason, result = finished.outcome, finished.reason, finished.result
        scene, seed, options = _key(finished.job)
        with self._refusing(), self._connection:
            self._connection.execute(
                "INSERT OR REPLACE INTO runs (scene, seed, options, outcome, reason, result, tries)"
                " VALUES (?, ?, ?, ?, ?, ?, ?)",
                (scene, seed, options, outcome, reason, result, tries),
            )
        return Stored(outcome, reason, result, tries, scene, seed, json.loads(options))

    def get(self, job: Job) -> Stored | None:
        """What is stored of a job."""
        scene, seed, options = _key(job)
        with self._refusing():
            found = self._connection.execute(
                "SELECT outcome, reason, result, tries FROM runs WHERE scene = ? AND seed = ? AND options = ?",
                (scene, seed, options),
            ).fetchone()
        return None if found is None else Stored(*found, scene=scene, seed=seed, options=json.loads(options))

    def everything(self) -> list[Stored]:
        """All that is stored, by scene and seed."""
        with self._refusing():
            found = self._connection.execute(
                "SELECT outcome, reason, result, tries, scene, seed, options FROM runs ORDER BY scene, options, seed"
            ).fetchall()
        return [
            Stored(outcome, reason, result, tries, scene, seed, json.loads(options))
            for outcome, reason, result, tries, scene, seed, options in found
        ]

    def stored(self, jobs: Iterable[Job]) -> dict[Job, Stored]:
        """Those of the jobs that are stored."""
        found = {job: self.get(job) for job in jobs}
        return {job: row for job, row in found.items() if row is not None}

    def _refusing(self) -> AbstractContextManager[None]:
        """A file that can't be read or written any more (locked, the disk full) is the person's to mend."""
        return refusing(sqlite3.Error, about=str(self._path))


def _key(job: Job) -> tuple[str, int, str]:
    return job.scene, job.options.seed, _distinction(job)


def _distinction(job: Job) -> str:
    """What tells two runs of one scene and seed apart, as JSON."""
    data = {name: value for name, value in asdict(job.options).items() if name not in ("seed", "window")}
    # Left out as they are by default, so that runs stored before these options existed are found again.
    data = {name: value for name, value in data.items() if (name, value) not in (("disturb", ()), ("replan", True))}
    data |= {"digest": job.digest} if job.digest else {}
    return json.dumps(data, sort_keys=True, default=str)
