"""Show a behaviour tree: the one that would run for a scene, or the last one that a run stored."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bt_tamp.commands.choices import add_planning, add_scene, options_of, scenario_of

if TYPE_CHECKING:
    from bt_tamp.export.snapshot import TreeNode

FORMATS = ("ascii", "unicode", "dot", "svg", "html")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Scene or folder, format, file."""
    add_scene(parser)
    parser.add_argument("--format", choices=FORMATS, default="unicode", help="default: unicode")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write there instead of printing")
    add_planning(parser)


def call(arguments: argparse.Namespace) -> int:
    """Print or write the tree; a scene without a plan gives 10 or 11."""
    folder = Path(arguments.scene)
    root, code = (_stored(folder), 0) if folder.is_dir() else _planned(arguments)
    if root is None:
        return code
    text = exported(root, arguments.format)
    if arguments.out is None:
        print(text)
        return code
    from bt_tamp.report.folder import replacing

    with replacing(arguments.out) as partial:
        partial.write_text(text + "\n", encoding="utf-8")
    print(arguments.out)
    return code


def exported(root: "TreeNode", form: str) -> str:
    """The tree in one of FORMATS, without a final line break."""
    import importlib

    module = "text" if form in ("ascii", "unicode") else form
    export = getattr(importlib.import_module(f"bt_tamp.export.{module}"), f"to_{form}")
    return export(root).rstrip("\n")


def _stored(folder: Path) -> "TreeNode":
    from bt_tamp.errors import UserError, refusing
    from bt_tamp.export.snapshot import TreeNode
    from bt_tamp.report.folder import TREES, existing_run

    trees = sorted((existing_run(folder) / TREES).glob("*.json"))
    if not trees:
        raise UserError(f"{folder / TREES}: holds no tree; the run ended before the first one")
    with refusing(ValueError, OSError, about=str(trees[-1])):
        return TreeNode.from_json(trees[-1].read_text(encoding="utf-8"))


def _planned(arguments: argparse.Namespace) -> "tuple[TreeNode | None, int]":
    """The tree and 0, or nothing and the exit code that says why there is no plan."""
    import sys

    options = options_of(arguments)
    scenario = scenario_of(arguments)

    from bt_tamp.quiet import quiet_imports

    with quiet_imports():
        from bt_tamp.executive.preview import preview
    from bt_tamp.report.result import EXIT_CODES
    from planner.search_then_sample import NoPlan

    def untold(kind: str, **data: Any) -> None:
        """The tree alone is wanted."""

    found = preview(scenario, options, untold)
    if isinstance(found.outcome, NoPlan):
        print(f"bt-tamp: no tree, as there is no plan: {found.outcome.reason}", file=sys.stderr)
        return None, EXIT_CODES["proven_infeasible" if found.outcome.verdict == "proven" else "no_plan"]
    return found.tree, 0
