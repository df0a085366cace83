"""Optimal task plans by Fast Downward, from the package up-fast-downward: a reference that benchmarks alone use."""

import importlib.util
import os
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

SECONDS = 2
"""Limit of one search: a foreign process knows no counted one. What it has proven by then is told."""

SEARCH = "astar(lmcut())"
_SCRIPT = ("downward", "fast-downward.py")


@dataclass(frozen=True)
class Proven:
    """What is known of the shortest plan: at least so many steps, and whether that is its length. cpu: seconds."""

    at_least: int
    is_optimal: bool
    cpu: float


def is_there() -> bool:
    """Is the package installed?"""
    return importlib.util.find_spec("up_fast_downward") is not None


def prove(domain_text: str, problem_text: str) -> Proven | None:
    """Search for the shortest plan; None if nothing came of it."""
    spec = importlib.util.find_spec("up_fast_downward")
    if spec is None or spec.origin is None:
        raise ImportError("up_fast_downward is not installed")
    script = Path(spec.origin).parent.joinpath(*_SCRIPT)
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / "domain.pddl", Path(folder) / "problem.pddl"]
        for file, text in zip(files, (domain_text, problem_text), strict=True):
            file.write_text(text)
        command = [
            sys.executable,
            str(script),
            "--search-time-limit",
            f"{SECONDS}s",
            *map(str, files),
            "--search",
            SEARCH,
        ]
        before = os.times()
        said = subprocess.run(command, cwd=folder, capture_output=True, text=True).stdout
        after = os.times()
    cpu = after.children_user + after.children_system - before.children_user - before.children_system
    length = re.search(r"Plan length: (\d+) step", said)
    bounds = re.findall(r"\bf = (\d+),", said)
    if length:
        return Proven(int(length[1]), True, cpu)
    return Proven(int(bounds[-1]), False, cpu) if bounds else None
