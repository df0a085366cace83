"""Draw a scene, and print the facts derived from it."""

import argparse
from pathlib import Path

from bt_tamp.commands.choices import add_scene, scenario_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The scene and the picture."""
    add_scene(parser)
    parser.add_argument("--out", type=Path, metavar="PNG", help="where the picture goes (default: SCENE.png)")


def call(arguments: argparse.Namespace) -> int:
    """Write the picture, print the facts."""
    scenario = scenario_of(arguments)

    from bt_tamp.errors import refusing
    from bt_tamp.quiet import quiet_imports

    with quiet_imports():
        from bt_tamp.report.video import show_scene
    from planner.task.facts import observed_facts
    from sim.robot import RobotModel
    from sim.scene import SceneState

    robot = RobotModel(scenario.robot.model, scenario.robot.X_WB)
    with refusing(ValueError, OSError):
        picture = show_scene(scenario, arguments.out or Path(f"{scenario.name}.png"))
    facts = observed_facts(SceneState.initial(scenario, robot.gripper.stroke))
    print(f"{scenario.name}, seed {scenario.seed}; goal {scenario.goal}")
    print("\n".join(f"  {fact}" for fact in sorted(facts)))
    print(picture)
    return 0
