"""Run a scene: plan, act, watch, plan again, until the goal is reached or given up."""

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bt_tamp.commands.choices import (
    add_disturbances,
    add_planning,
    add_scene,
    add_time_limit,
    options_of,
    startable_scenario_of,
)
from bt_tamp.stopping import stop_on_signals

if TYPE_CHECKING:
    from bt_tamp.report.result import RunResult
    from bt_tamp.report.state import RunState
    from scenarios.scenario import Scenario


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Scene, options, folder, picture."""
    add_scene(parser, is_optional=True)
    parser.add_argument(
        "--resume",
        type=Path,
        metavar="DIR",
        help="go on, with its options, from where the run in this folder ended, in place of a SCENE; what was still to"
        " befall that one doesn't come again",
    )
    parser.add_argument(
        "--render", action="store_true", help="PyBullet's window where there is a display, else an MP4 after the run"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="the run's folder (default: runs/SCENE-SEED[-n])")
    parser.add_argument("--force", action="store_true", help="replace a run that lies in the folder already")
    add_disturbances(parser)
    add_time_limit(parser)
    add_planning(parser)


def call(arguments: argparse.Namespace) -> int:
    """Run, then say where everything lies; the exit code tells the outcome."""
    from bt_tamp.display import has_display

    options_of(arguments)  # What is wrong there is told before anything is read.
    scenario, start = _beginning(arguments)
    before = {} if arguments.resume is None else _choices_before(arguments.resume)
    options = options_of(arguments, window=arguments.render and has_display(), before=before)
    options = replace(options, seed=scenario.seed)

    from bt_tamp.report.folder import RunFolder

    folder = RunFolder.for_run(scenario.name, scenario.seed, arguments.out, arguments.force)
    stop_on_signals()

    from bt_tamp.quiet import outliving_a_closed_pipe, quiet_imports

    with quiet_imports():
        from bt_tamp.disturb.classes import amended
        from bt_tamp.executive.loop import run_scenario
    from bt_tamp.garbage import collect_rarely
    from bt_tamp.replay import choices_of, replay_command
    from bt_tamp.report.live import watcher
    from bt_tamp.report.recorder import RunRecorder

    collect_rarely()

    scenario = amended(scenario, options.disturb)
    with RunRecorder(scenario, folder, watcher(sys.stdout)) as recorder:
        result = run_scenario(scenario, options, recorder, start)
    video = None
    if arguments.render and not options.window and result.outcome not in ("interrupted", "crashed"):
        video = _render(folder.path)
    with outliving_a_closed_pipe():
        print(_closing(result))
        if arguments.resume is None and result.outcome not in ("goal_reached", "interrupted"):
            print(f"Again: {replay_command(arguments.scene, scenario.seed, choices_of(options))}")
        print(folder.path if video is None else video)
    return result.exit_code


def _beginning(arguments: argparse.Namespace) -> "tuple[Scenario, RunState | None]":
    """The scene, or where another run ended. Raises UserError, FolderError or SceneError."""
    from bt_tamp.errors import UserError, refusing

    if (arguments.scene is None) == (arguments.resume is None):
        raise UserError("expected either a SCENE or --resume DIR")
    if arguments.resume is not None and arguments.seed is not None:
        raise UserError(f"--seed {arguments.seed}: can't go with --resume, the run that goes on has its seed")
    if arguments.resume is None:
        return startable_scenario_of(arguments), None

    from bt_tamp.report.folder import SCENARIO, STATE, existing_run
    from bt_tamp.report.scenario_json import scenario_from_json
    from bt_tamp.report.state import RunState

    folder = existing_run(arguments.resume)
    with refusing(OSError, ValueError, about=str(folder / SCENARIO)):
        scenario = scenario_from_json((folder / SCENARIO).read_text(encoding="utf-8"))
    with refusing(OSError, ValueError, about=str(folder / STATE)):
        start = RunState.from_json((folder / STATE).read_text(encoding="utf-8"))
        return start.applied(scenario), start


def _choices_before(folder: Path) -> dict[str, Any]:
    """What was chosen for the run in a folder, but for what befell it. Raises UserError."""
    from bt_tamp.errors import refusing
    from bt_tamp.replay import choices_from
    from bt_tamp.report.events import read_events
    from bt_tamp.report.folder import EVENTS

    with refusing(ValueError, OSError):
        begun = next((event for event in read_events(folder / EVENTS) if event.kind == "run_started"), None)
        chosen = choices_from(begun.data.get("choices", {}) if begun is not None else {})
    return {name: value for name, value in chosen.items() if name not in ("disturb", "max_sim_time")}


def _render(folder: Path) -> Path | None:
    """The video, if it can be made: the run's outcome stands without it."""
    from bt_tamp.commands.render import render
    from bt_tamp.errors import UserError

    try:
        return render(folder, None)
    except UserError as error:
        print(f"bt-tamp: no video: {error}", file=sys.stderr)
        return None


def _closing(result: "RunResult") -> str:
    """Is the goal reached, and where does everything lie: one sentence."""
    if result.outcome == "goal_reached":
        said = f"Goal reached in {result.robot_s:.0f} s of robot time ({result.wall_s:.0f} s of real time)"
    else:
        if result.outcome == "crashed":
            return f"Goal not reached: an error in the program, {result.reason}; crash.txt tells where."
        missing = [literal for literal, holds in result.goal.items() if not holds]
        said = f"Goal not reached: {result.reason.rstrip('.')}; missing: {', '.join(missing) or 'rest at the end'}"
    by_place: dict[str, list[str]] = {}
    for name, place in sorted(result.places.items()):
        by_place.setdefault(place, []).append(name)
    lying = [f"{_listed(names)} {_where(place, len(names) > 1)}" for place, names in sorted(by_place.items())]
    return f"{said}: {', '.join(lying)}." if lying else f"{said}."


def _listed(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _where(place: str, are_many: bool) -> str:
    if place == "hand":
        return "still in the hand"
    if place == "nowhere":
        return f"{'are' if are_many else 'is'} nowhere to be seen"
    if place == "elsewhere":
        return f"{'lie' if are_many else 'lies'} elsewhere"
    return f"{'lie' if are_many else 'lies'} {'on the' if place in ('table', 'floor') else 'in'} {place}"
