"""What was chosen for a run, kept as plain data, and the command line that runs the same once more."""

import shlex
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from bt_tamp.options import RunOptions

NOT_CHOICES = ("seed", "window")
"""What tells nothing about how a run of a scene and seed goes."""


def choices_of(options: RunOptions) -> dict[str, Any]:
    """What was chosen that isn't the usual, as JSON holds it; the seed left out."""
    usual = asdict(RunOptions())
    chosen = {name: value for name, value in asdict(options).items() if name not in NOT_CHOICES}
    return {name: _plain(value) for name, value in chosen.items() if value != usual[name]}


def choices_from(data: Any) -> dict[str, Any]:
    """The same, read back. Raises ValueError for what never came from `choices_of`."""
    if not isinstance(data, dict) or not data.keys() <= asdict(RunOptions()).keys():
        raise ValueError(f"not a run's choices: {data!r}")
    chosen: dict[str, Any] = {
        name: Path(value) if name in ("domain", "problem") else value for name, value in data.items()
    }
    try:
        RunOptions(**chosen)
    except TypeError as error:
        raise ValueError(f"not a run's choices: {error}") from None
    return chosen


def replay_command(scene: str, seed: int, choices: Mapping[str, Any]) -> str:
    """The command line that runs the same once more. Unknown names among the choices are ignored."""
    return shlex.join(["bt-tamp", "run", scene, "--seed", str(seed), *words(choices)])


def words(choices: Mapping[str, Any], leaving: Iterable[str] = ()) -> list[str]:
    """The choices that aren't the usual as words of a command line, but for those that are left out."""
    usual = {name: _plain(value) for name, value in asdict(RunOptions()).items()}
    said: list[str] = []
    for name in (name for name in usual if name not in (*NOT_CHOICES, *leaving)):
        value = _plain(choices.get(name, usual[name]))
        if value == usual[name]:
            continue
        if name == "replan":
            said.append("--no-replan")
        else:
            said += [f"--{name.replace('_', '-')}", ",".join(value) if name == "disturb" else str(value)]
    return said


def _plain(value: Any) -> Any:
    if isinstance(value, Path):
        return str(value)
    return list(value) if isinstance(value, tuple) else value
