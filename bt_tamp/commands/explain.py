"""Tell the story of a run: each plan, what failed, why, what was learned, what was done instead."""

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The run's folder."""
    parser.add_argument("folder", type=Path, metavar="DIR", help="a run's folder")


def call(arguments: argparse.Namespace) -> int:
    """Print the story."""
    from bt_tamp.errors import refusing
    from bt_tamp.report.events import read_events
    from bt_tamp.report.folder import EVENTS, RESULT, existing_run
    from bt_tamp.report.result import RunResult
    from bt_tamp.report.story import story

    folder = existing_run(arguments.folder)
    with refusing(ValueError, OSError):
        events = list(read_events(folder / EVENTS))
    result = None
    if (folder / RESULT).exists():
        with refusing(ValueError, OSError, about=str(folder / RESULT)):
            result = RunResult.from_json((folder / RESULT).read_text(encoding="utf-8"))
    with refusing(ValueError, about=str(folder / EVENTS)):
        told = story(events, result)
    print(told)
    return 0
