"""What would be done: a plan from the scene as it stands, nothing moved."""

from collections.abc import Callable
from dataclasses import dataclass

from bt_tamp.executive.build import build
from bt_tamp.export.snapshot import TreeNode, snapshot
from bt_tamp.options import RunOptions
from planner.search_then_sample import NoPlan, Solution
from scenarios.scenario import Scenario


@dataclass(frozen=True)
class Preview:
    """A plan or why there is none, the tree that would run, and what planning cost in seconds of CPU and wall time."""

    outcome: Solution | NoPlan
    tree: TreeNode
    cpu_s: float
    wall_s: float


def preview(scenario: Scenario, options: RunOptions, report: Callable[..., None]) -> Preview:
    """Plan a scene as a run would at its start. Raises what `build` raises."""
    machine = build(scenario, options, report, lambda why: None)
    try:
        outcome = machine.planner.plan(machine.context.scene, machine.agenda)
        if isinstance(outcome, Solution):
            machine.agenda.adopt(outcome.plan, outcome.refinements, machine.context, "planned")
        thinking = machine.planner.thinking
        return Preview(outcome, snapshot(machine.mission.root), thinking.cpu_s, thinking.wall_s)
    finally:
        machine.plant.close()
