"""The options that every command that plans or runs understands, and `RunOptions` from them."""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bt_tamp.options import RunOptions
    from scenarios.scenario import Scenario


def add_scene(parser: argparse.ArgumentParser, is_optional: bool = False) -> None:
    """The scene and its seed."""
    parser.add_argument(
        "scene",
        metavar="SCENE",
        nargs="?" if is_optional else None,
        help="a shipped scene's name (bt-tamp list) or a scene file",
    )
    parser.add_argument("--seed", type=int, metavar="N", help="0 (default): the nominal scene; else noise drawn from N")


def add_planning(parser: argparse.ArgumentParser) -> None:
    """How to plan and to touch."""
    group = parser.add_argument_group("planning and contact")
    group.add_argument("--contact", choices=("hybrid", "impedance"), help="control of contact (default: hybrid)")
    group.add_argument("--preset", choices=("default", "paper"), help="paper: the paper's values where it gives any")
    group.add_argument(
        "--search",
        metavar="NAME",
        help="task planner's search: auto (default), astar-hmax, wastar-hff, gbfs-hff, astar-blind",
    )
    group.add_argument(
        "--tries", type=int, metavar="R", help="samples per action in a round (default: 20; doubled when widened)"
    )
    group.add_argument("--motion-planner", metavar="NAME", help="OMPL planner for free motions (default: RRTConnect)")
    group.add_argument("--domain", type=Path, metavar="FILE", help="hand-written PDDL domain, with --problem")
    group.add_argument("--problem", type=Path, metavar="FILE", help="hand-written PDDL problem, with --domain")


def add_disturbances(parser: argparse.ArgumentParser) -> None:
    """What befalls a run, and whether it watches."""
    from bt_tamp.disturb.names import CLASSES

    group = parser.add_argument_group("disturbances")
    group.add_argument(
        "--disturb",
        default="none",
        metavar="CLASS,…",
        help="classes of disturbances, all or none (default); `bt-tamp list --disturbances` says what each does:"
        f" {', '.join(CLASSES)}",
    )
    group.add_argument(
        "--no-replan",
        dest="replan",
        action="store_const",
        const=False,
        help="the open-loop baseline: the first plan is carried out blindly, and a failure ends the run",
    )


def add_time_limit(parser: argparse.ArgumentParser) -> None:
    """When to give up."""
    parser.add_argument(
        "--max-sim-time", type=float, default=900.0, metavar="S", help="simulated seconds after which it gives up (900)"
    )


def options_of(
    arguments: argparse.Namespace, window: bool = False, before: Mapping[str, Any] | None = None
) -> "RunOptions":
    """The choices made on the command line, over those made `before`. Raises UserError for values that can't be."""
    from bt_tamp.errors import refusing
    from bt_tamp.options import RunOptions

    names = "seed contact preset search tries motion_planner domain problem replan max_sim_time".split()
    given = dict(before or {})
    given |= {name: value for name in names if (value := getattr(arguments, name, None)) is not None}
    if hasattr(arguments, "disturb"):
        from bt_tamp.disturb.names import chosen

        with refusing(ValueError, about="--disturb"):
            given["disturb"] = chosen(arguments.disturb)
    with refusing(ValueError):
        options = RunOptions(**given, window=window)
    _check_names(options)
    return options


def scenario_of(arguments: argparse.Namespace) -> "Scenario":
    """The scene named on the command line, its noise drawn. Raises UserError or SceneError."""
    from bt_tamp.errors import refusing
    from scenarios.load import load_scenario

    with refusing(ValueError):
        return load_scenario(arguments.scene, arguments.seed or 0)


def startable_scenario_of(arguments: argparse.Namespace) -> "Scenario":
    """The same, if the robot can stand and begin where the scene has it. Raises UserError or SceneError."""
    scenario = scenario_of(arguments)
    check_start(scenario, str(arguments.scene))
    return scenario


def check_start(scenario: "Scenario", file: str) -> None:
    """Raise SceneInvalid if the robot can't stand and begin where the scene has it, or if a disturbance waits for a
    phase that no skill has."""
    from bt_tamp.executive.start import phase_problem, start_problem
    from scenarios.errors import SceneInvalid

    for problem in (start_problem(scenario), phase_problem(scenario)):
        if problem is not None:
            raise SceneInvalid(problem[1], file, problem[0])


def _check_names(options: "RunOptions") -> None:
    """Names known to the planners alone are looked up only when given: that import takes its time."""
    from bt_tamp.errors import refusing

    if options.search is not None:
        from planner.task.pyperplan_ import PyperplanPlanner

        with refusing(ValueError, about="--search"):
            PyperplanPlanner(options.search)
    if options.motion_planner is not None:
        from planner.motion.ompl_ import PathSettings

        with refusing(ValueError, about="--motion-planner"):
            PathSettings(planner=options.motion_planner)
