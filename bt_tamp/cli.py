"""The command line: finds the subcommand, and turns what goes wrong into one line and an exit code.

Nothing heavy is imported here or by the modules in `commands/` before one of them runs, so that
`--help` answers at once.
"""

import argparse
import importlib
import io
import sys
from collections.abc import Sequence
from typing import NoReturn

from bt_tamp.errors import UserError, one_line_of
from bt_tamp.quiet import outliving_a_closed_pipe

COMMANDS = {
    "run": "run a scene: plan, act, plan again until the goal is reached",
    "plan": "plan a scene without acting: rounds, what failed, what was learned, the plan",
    "list": "list the scenes that ship with the package, or the classes of disturbances",
    "validate": "check a scene file",
    "generate": "write a random scene file: solvable by construction, or unsolvable in a known way",
    "schema": "print the scene format as JSON Schema",
    "show": "draw a scene, and print the facts derived from it",
    "tree": "show the behaviour tree of a scene or of a run",
    "explain": "tell the story of a run",
    "render": "render the video of a run",
    "sweep": "run scenes over many seeds in parallel, and sum up",
    "results": "sum up what sweeps have stored, by scene and class of disturbance",
    "bench": "measure how well contact is controlled, and what control costs",
}

EPILOG = """\
exit codes: 0 goal reached, 2 wrong input, 10 proven infeasible, 11 no plan within the budget,
12 execution gave up, 130 interrupted, 1 an error in the program
"""

WRONG_INPUT = 2
INTERRUPTED = 130


class _Parser(argparse.ArgumentParser):
    """Says what is wrong with the arguments in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(WRONG_INPUT, f"bt-tamp: {' '.join(message.split())} (see {self.prog} --help)\n")


def parser() -> argparse.ArgumentParser:
    """The parser of the whole command line."""
    top = _Parser(
        prog="bt-tamp",
        description="Clears tables with a simulated robot arm: plans, acts, watches, and plans again.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    top.add_argument("--version", action="store_true", help="print the version and end")
    commands = top.add_subparsers(dest="command", metavar="COMMAND", title="commands")
    for name, summary in COMMANDS.items():
        module = importlib.import_module(f"bt_tamp.commands.{name}")
        sub = commands.add_parser(name, help=summary, description=f"{module.__doc__}")
        module.add_arguments(sub)
        sub.set_defaults(call=module.call)
    return top


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; its exit code. Wrong input is one line on stderr and 2."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        arguments = parser().parse_args(argv)
    except SystemExit as end:
        return int(end.code or 0)
    if arguments.version:
        from importlib.metadata import PackageNotFoundError, version

        try:
            print(f"bt-tamp {version('bt-tamp')}")
        except PackageNotFoundError:
            print("bt-tamp, not installed")
        return 0
    if arguments.command is None:
        print("bt-tamp: name a command (see bt-tamp --help)", file=sys.stderr)
        return WRONG_INPUT
    try:
        code = 0
        with outliving_a_closed_pipe():
            code = arguments.call(arguments)
        return code
    except KeyboardInterrupt:
        print("bt-tamp: interrupted", file=sys.stderr)
        return INTERRUPTED
    except Exception as error:
        if not isinstance(error, _user_errors()):
            raise
        print(f"bt-tamp: {one_line_of(error)}", file=sys.stderr)
        return WRONG_INPUT


def _user_errors() -> tuple[type[Exception], ...]:
    from bt_tamp.report.folder import FolderError
    from planner.task.sexpr import PddlError
    from scenarios.errors import SceneError

    return UserError, FolderError, SceneError, PddlError


if __name__ == "__main__":
    sys.exit(main())
