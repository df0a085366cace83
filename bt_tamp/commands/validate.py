"""Check scene files: format, names, goal, that nothing overlaps or floats, and that the arm can start there.

The first fault is told in one line.
"""

import argparse


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The files."""
    parser.add_argument("files", nargs="+", metavar="FILE", help="a scene file, or the name of a shipped scene")
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N", help="draw this seed's noise too (default: 0, none)"
    )


def call(arguments: argparse.Namespace) -> int:
    """One line a file; ends with an error at the first one that can't be used."""
    from bt_tamp.commands.choices import check_start
    from bt_tamp.errors import refusing
    from scenarios.load import load_scenario

    for file in arguments.files:
        with refusing(ValueError):
            scenario = load_scenario(file, arguments.seed)
        check_start(scenario, file)
        print(f"{file}: scene {scenario.name!r} is fine; {_counted(len(scenario.bodies))}; goal {scenario.goal}")
    return 0


def _counted(bodies: int) -> str:
    return "1 movable thing" if bodies == 1 else f"{bodies} movable things"
