"""The results of sweeps in one SQLite file, written run by run."""

import json
import sqlite3
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType

from bt_tamp.errors import UserError
from bt_tamp.sweep import Finished, Job

UNFINISHED = ("crashed", "killed")
"""Outcomes that a resumed sweep tries again."""

_TABLE = """
CREATE TABLE IF NOT EXISTS runs (
    scene TEXT NOT NULL, seed INTEGER NOT NULL, options TEXT NOT NULL,
    outcome TEXT NOT NULL, reason TEXT NOT NULL, result TEXT,
    stored_at TEXT NOT NULL DEFAULT CURRENT_TIMESTAMP,
    PRIMARY KEY (scene, seed, options)
)
"""


@dataclass(frozen=True)
class Row:
    """A stored run. `result` is `result.json` as text, None for a run that never came to its end."""

    outcome: str
    reason: str
    result: str | None


class SweepStore:
    """A context manager around the file. Raises UserError when it can't be used."""

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            self._connection = sqlite3.connect(path, timeout=30.0)
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

    def add(self, finished: Finished) -> None:
        """Store a run, in place of an earlier one of the same job."""
        row = (*_key(finished.job), finished.outcome, finished.reason, finished.result)
        with self._connection:
            self._connection.execute(
                "INSERT OR REPLACE INTO runs (scene, seed, options, outcome, reason, result) VALUES (?, ?, ?, ?, ?, ?)",
                row,
            )

    def get(self, job: Job) -> Row | None:
        """What is stored of a job."""
        found = self._connection.execute(
            "SELECT outcome, reason, result FROM runs WHERE scene = ? AND seed = ? AND options = ?", _key(job)
        ).fetchone()
        return None if found is None else Row(*found)

    def stored(self, jobs: Iterable[Job]) -> dict[Job, Row]:
        """Those of the jobs that are stored."""
        found = {job: self.get(job) for job in jobs}
        return {job: row for job, row in found.items() if row is not None}


def _key(job: Job) -> tuple[str, int, str]:
    return job.scene, job.options.seed, _distinction(job)


def _distinction(job: Job) -> str:
    """What tells two runs of one scene and seed apart, as JSON."""
    data = {name: value for name, value in asdict(job.options).items() if name not in ("seed", "window")}
    data |= {"digest": job.digest} if job.digest else {}
    return json.dumps(data, sort_keys=True, default=str)
