"""Run scenes over many seeds in parallel; every result is stored as it arrives, a table closes."""

import argparse


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """None needed."""


def call(arguments: argparse.Namespace) -> int:
    """None."""
    return 0
