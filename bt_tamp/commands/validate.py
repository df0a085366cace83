"""Check scene files: format, names, goal, that nothing overlaps or floats, and that the arm can start there.

Each file's first fault is told in one line.
"""

import argparse
import sys


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The files."""
    parser.add_argument("files", nargs="+", metavar="FILE", help="a scene file, or the name of a shipped scene")
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N", help="draw this seed's noise too (default: 0, none)"
    )


def call(arguments: argparse.Namespace) -> int:
    """One line a file; 2 if any of them can't be used."""
    from bt_tamp.commands.choices import check_start
    from bt_tamp.errors import UserError, one_line_of
    from scenarios.errors import SceneError
    from scenarios.load import load_scenario

    code = 0
    for file in arguments.files:
        try:
            scenario = load_scenario(file, arguments.seed)
            check_start(scenario, file)
        except (UserError, SceneError, ValueError) as error:
            print(f"bt-tamp: {one_line_of(error)}", file=sys.stderr)
            code = 2
            continue
        print(f"{file}: scene {scenario.name!r} is fine; {_counted(len(scenario.bodies))}; goal {scenario.goal}")
    return code


def _counted(bodies: int) -> str:
    return "1 movable thing" if bodies == 1 else f"{bodies} movable things"
