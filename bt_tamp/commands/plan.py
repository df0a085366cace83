"""Plan a scene without acting: each round, what failed in it, what was learned, and the plan with its phases."""

import argparse
from typing import TYPE_CHECKING, Any

from bt_tamp.commands.choices import add_planning, add_scene, options_of, startable_scenario_of

if TYPE_CHECKING:
    from planner.search_then_sample import Solution


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Scene and options."""
    add_scene(parser)
    add_planning(parser)


def call(arguments: argparse.Namespace) -> int:
    """Print what happens while planning, then the plan; 0, or why there is none: 10 proven, 11 within the budget."""
    options = options_of(arguments)
    scenario = startable_scenario_of(arguments)

    from bt_tamp.quiet import quiet_imports

    with quiet_imports():
        from bt_tamp.executive.preview import preview
    from bt_tamp.report.events import Event
    from bt_tamp.report.result import EXIT_CODES
    from bt_tamp.report.sentences import counted, sentence
    from planner.search_then_sample import NoPlan

    def tell(kind: str, **data: Any) -> None:
        said = sentence(Event(kind, 0.0, data))
        if said is not None:
            print(said if kind == "round" else f"  {said}", flush=True)

    found = preview(scenario, options, tell)
    outcome = found.outcome
    cost = f"{counted(outcome.rounds, 'round')}, {found.cpu_s:.1f} s of CPU"
    if isinstance(outcome, NoPlan):
        proven = outcome.verdict == "proven"
        print(f"{'proven infeasible' if proven else 'no plan'} ({cost}): {outcome.reason}")
        return EXIT_CODES["proven_infeasible" if proven else "no_plan"]
    _print_plan(outcome, cost)
    return EXIT_CODES["planned"]


def _print_plan(solution: "Solution", cost: str) -> None:
    print(f"plan ({cost}):")
    width = max((len(str(step.action)) for step in solution.plan.steps), default=0)
    for number, (step, refinement) in enumerate(zip(solution.plan.steps, solution.refinements, strict=True), start=1):
        phases = ", ".join(phase.name for phase in refinement.phases)
        print(f"  {number:2}. {step.action!s:{width}}  {phases}")
    if not solution.plan.steps:
        print("  nothing to do: the goal holds already")
