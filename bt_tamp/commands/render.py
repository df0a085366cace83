"""Render the video of a run from its recorded states."""

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The run's folder and the video."""
    parser.add_argument("folder", type=Path, metavar="DIR", help="a run's folder")
    parser.add_argument("--out", type=Path, metavar="MP4", help="where the video goes (default: DIR/video.mp4)")


def call(arguments: argparse.Namespace) -> int:
    """Render, and print where the video lies."""
    from bt_tamp.report.folder import existing_run
    from bt_tamp.stopping import stop_on_signals

    stop_on_signals()
    print(render(existing_run(arguments.folder), arguments.out))
    return 0


def render(folder: Path, out: Path | None) -> Path:
    """Render a run's video with a progress bar; its path. Raises UserError for a folder that can't be replayed."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    from bt_tamp.errors import refusing
    from bt_tamp.quiet import quiet_imports

    with quiet_imports():
        from bt_tamp.report.video import render_run

    columns = (TextColumn("rendering"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    with (
        refusing(ValueError, OSError),
        Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar,
    ):
        task = bar.add_task("rendering", total=None)
        return render_run(folder, out, lambda done, total: bar.update(task, completed=done, total=total))
