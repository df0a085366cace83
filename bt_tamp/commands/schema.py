"""Print the scene format as JSON Schema."""

import argparse


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """None needed."""


def call(arguments: argparse.Namespace) -> int:
    """Print the schema."""
    import json

    from scenarios.schema import json_schema

    print(json.dumps(json_schema(), indent=2, ensure_ascii=False))
    return 0
