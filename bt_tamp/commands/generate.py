"""Write a random scene file: a cluttered table that the arm can clear, or one that it can't, for a known reason.

The same seed, number of objects and kind always give the same file. What a solvable table needs goes by the seed's last
digit: 0-2 nothing special, 3-4 one thing before another, 5-8 a chain of two or more, 8-9 something put aside.
"""

import argparse
from pathlib import Path

KINDS = ("goal-too-small", "crumb-behind-wall", "out-of-reach", "too-heavy", "flat-blocked")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What to draw, and the file."""
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="which table (default: 0)")
    parser.add_argument(
        "--objects", type=int, default=8, metavar="K", help="things on it, crumbs included (default: 8)"
    )
    parser.add_argument("--unsolvable", choices=KINDS, metavar="KIND", help=f"why not: {', '.join(KINDS)}")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="the scene file to write")


def call(arguments: argparse.Namespace) -> int:
    """Write the file."""
    from bt_tamp.errors import UserError, refusing
    from scenarios.generate import generate

    with refusing(ValueError):
        text = generate(arguments.seed, arguments.objects, arguments.unsolvable)
    try:
        arguments.out.parent.mkdir(parents=True, exist_ok=True)
        arguments.out.write_text(text, encoding="utf-8")
    except OSError as error:
        raise UserError(f"{arguments.out}: can't be written ({error.strerror}), expected a path to a file") from None
    print(f"{arguments.out}: {text.splitlines()[1].removeprefix('# ')}")
    return 0
