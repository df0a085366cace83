"""Run a scene: plan, act, watch, plan again, until the goal is reached or given up."""

import argparse
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from bt_tamp.commands.choices import add_planning, add_scene, add_time_limit, options_of, scenario_of
from bt_tamp.commands.stopping import stop_on_signals

if TYPE_CHECKING:
    from bt_tamp.report.result import RunResult


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Scene, options, folder, picture."""
    add_scene(parser)
    parser.add_argument(
        "--render", action="store_true", help="PyBullet's window where there is a display, else an MP4 after the run"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="the run's folder (default: runs/SCENE-SEED[-n])")
    parser.add_argument("--force", action="store_true", help="replace a run that lies in the folder already")
    add_time_limit(parser)
    add_planning(parser)


def call(arguments: argparse.Namespace) -> int:
    """Run, then say where everything lies; the exit code tells the outcome."""
    has_display = bool(os.environ.get("DISPLAY"))
    options = options_of(arguments, window=arguments.render and has_display)
    scenario = scenario_of(arguments)

    from bt_tamp.report.folder import RunFolder

    folder = RunFolder.for_run(scenario.name, scenario.seed, arguments.out, arguments.force)
    stop_on_signals()

    from bt_tamp.quiet import quiet_imports

    with quiet_imports():
        from bt_tamp.executive.loop import run_scenario
    from bt_tamp.report.live import watcher
    from bt_tamp.report.recorder import RunRecorder

    with RunRecorder(scenario, folder, watcher(sys.stdout)) as recorder:
        result = run_scenario(scenario, options, recorder)
    if arguments.render and not options.window and result.outcome != "interrupted":
        _render(folder.path)
    print(_closing(result, folder.path))
    print(folder.path)
    return result.exit_code


def _render(folder: Path) -> None:
    from bt_tamp.commands.render import render

    render(folder, None)


def _closing(result: "RunResult", folder: Path) -> str:
    """Is the goal reached, and where does everything lie: one sentence."""
    from bt_tamp.report.folder import EVENTS, PDDL, RESULT, TREES, VIDEO

    if result.outcome == "goal_reached":
        said = f"Goal reached in {result.robot_s:.0f} s of robot time ({result.wall_s:.0f} s of real time)"
    else:
        missing = [literal for literal, holds in result.goal.items() if not holds]
        said = f"Goal not reached: {result.reason}; missing: {', '.join(missing) or 'rest at the end'}"
    parts = [RESULT, EVENTS, f"{TREES}/", f"{PDDL}/"]
    if (folder / VIDEO).exists():
        parts.insert(0, VIDEO)
    return f"{said.rstrip('.')}; everything lies in {folder}{os.sep} ({', '.join(parts)}, …)."
