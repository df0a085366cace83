"""An error in a planner or a skill, as a phrase: it fails what it happened in, and is told."""

import traceback
from pathlib import Path

LONGEST = 200
"""Characters of an error's own message that are told."""


def crash_of(error: Exception) -> str:
    """What crashed where, on one line."""
    text = " ".join(str(error).split())
    return f"{type(error).__name__} in {place_of(error)}: {text if len(text) <= LONGEST else text[: LONGEST - 1] + '…'}"


def place_of(error: Exception) -> str:
    """The function that raised the error, with its file and line."""
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f"{last.name} ({Path(last.filename).name}:{last.lineno})"
