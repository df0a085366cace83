"""List the scenes that ship with the package."""

import argparse


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """None needed."""


def call(arguments: argparse.Namespace) -> int:
    """Print one name a line."""
    from scenarios.library import list_scenarios

    print("\n".join(list_scenarios()))
    return 0
