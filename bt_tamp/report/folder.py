"""The folder of one run: where it lies, and files that are either whole or not there.

Nothing is created before the first write, so that wrong input leaves no trace.
"""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

RESULT = "result.json"
EVENTS = "events.jsonl"
SCENARIO = "scenario.json"
SIGNALS = "signals.npz"
STATE = "state.json"
VIDEO = "video.mp4"
CRASH = "crash.txt"
PDDL, PLANS, TREES = "pddl", "plans", "trees"

OWN = (RESULT, EVENTS, SCENARIO, SIGNALS, STATE, VIDEO, CRASH, PDDL, PLANS, TREES)
"""Everything a run writes: what `--force` clears, and nothing else."""


class FolderError(Exception):
    """A run's folder that can't be written or read; the message says which and why."""


@dataclass
class RunFolder:
    """A run's folder. `path` is settled when `open` is called, at the latest by the first write.

    wanted: the folder to use; numbered: append -2, -3, … while one exists; force: clear the run
    that lies there already.
    """

    wanted: Path
    numbered: bool = False
    force: bool = False
    _path: Path | None = field(default=None, init=False)

    @staticmethod
    def for_run(scene: str, seed: int, out: Path | None, force: bool) -> "RunFolder":
        """`out`, or else `runs/SCENE-SEED[-n]`. Raises FolderError if it can't become a run's folder."""
        folder = RunFolder(Path("runs") / f"{scene}-{seed}" if out is None else out, out is None and not force, force)
        folder.check()
        return folder

    def check(self) -> None:
        """Raise FolderError unless the folder can be made and written, without making it."""
        if not self.numbered and not self.force and (self.wanted / RESULT).exists():
            raise FolderError(f"{self.wanted}: holds a run's result; --force replaces it, --out takes another folder")
        if not self.numbered and self._is_foreign():
            raise FolderError(f"{self.wanted}: holds other things than a run, expected a new or empty folder")
        existing = self.wanted
        while not existing.exists() and existing != existing.parent:
            existing = existing.parent
        if not existing.is_dir():
            raise FolderError(f"{existing}: is not a folder, expected one to write the run into")
        if not os.access(existing, os.W_OK | os.X_OK):
            raise FolderError(f"{existing}: no permission to write there; give another folder with --out")

    def _is_foreign(self) -> bool:
        """Would a run be written among things that no run wrote, and clear what only has the same name?"""
        if not self.wanted.is_dir() or not os.access(self.wanted, os.R_OK | os.X_OK):
            return False
        names = {entry.name for entry in self.wanted.iterdir()}
        return bool(names) and names.isdisjoint((RESULT, EVENTS))

    @property
    def path(self) -> Path:
        """Where the folder lies (it exists from now on)."""
        return self.open()

    def open(self) -> Path:
        """Make the folder and its subfolders, clear an older run if forced. Raises FolderError."""
        if self._path is not None:
            return self._path
        self.check()
        try:
            path = self._claim()
            for name in OWN:
                _remove(path / name)
            for name in (PDDL, PLANS, TREES):
                (path / name).mkdir()
        except OSError as error:
            raise FolderError(f"{self.wanted}: can't be written ({error.strerror or error})") from None
        self._path = path
        return path

    def _claim(self) -> Path:
        if not self.numbered:
            self.wanted.mkdir(parents=True, exist_ok=True)
            return self.wanted
        self.wanted.parent.mkdir(parents=True, exist_ok=True)
        path, number = self.wanted, 1
        while True:
            try:
                path.mkdir()
                return path
            except FileExistsError:
                number += 1
                path = self.wanted.with_name(f"{self.wanted.name}-{number}")

    @contextmanager
    def writing(self, name: str) -> Iterator[Path]:
        """A temporary path that becomes `name` when the block ends well, and vanishes otherwise."""
        with replacing(self.path / name) as partial:
            yield partial

    def write(self, name: str, text: str) -> Path:
        """Write a text file whole; its path."""
        with self.writing(name) as partial:
            partial.write_text(text, encoding="utf-8")
        return self.path / name


@contextmanager
def replacing(target: Path) -> Iterator[Path]:
    """A temporary path beside `target` that replaces it when the block ends well. Raises FolderError."""
    try:
        handle, name = tempfile.mkstemp(prefix=f".{target.stem}-", suffix=target.suffix, dir=target.parent)
    except OSError as error:
        raise FolderError(f"{target}: can't be written ({error.strerror})") from None
    os.close(handle)
    partial = Path(name)
    try:
        yield partial
        partial.chmod(0o644)
        partial.replace(target)
    except OSError as error:
        raise FolderError(f"{target}: can't be written ({error.strerror or error})") from None
    finally:
        partial.unlink(missing_ok=True)


def existing_run(path: Path) -> Path:
    """The same path if it is a run's folder, else FolderError."""
    if not path.is_dir():
        raise FolderError(f"{path}: no such folder, expected one that `bt-tamp run` wrote")
    if not (path / EVENTS).is_file():
        raise FolderError(f"{path}: holds no {EVENTS}, expected a folder that `bt-tamp run` wrote")
    return path


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
