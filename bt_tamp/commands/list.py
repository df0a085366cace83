"""List the scenes that ship with the package, or the classes of disturbances."""

import argparse


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What is listed."""
    parser.add_argument("--disturbances", action="store_true", help="what `run` and `sweep` know as --disturb CLASS")


def call(arguments: argparse.Namespace) -> int:
    """Print one name a line; of classes also what they do."""
    if not arguments.disturbances:
        from scenarios.library import list_scenarios

        print("\n".join(list_scenarios()))
        return 0

    from bt_tamp.disturb.names import CLASSES

    width = max(map(len, CLASSES))
    for name, declared in CLASSES.items():
        hopeless = "" if declared.is_reachable else " (the goal is out of reach then)"
        print(f"{name:{width}}  {declared.sentence}{hopeless}")
    return 0
