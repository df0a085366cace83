"""One run: observe, control, tick the tree, record, until the goal holds or nothing is left to try."""

import resource
import time
import traceback
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from py_trees.common import Status

from bt_tamp.disturb.driver import Driver
from bt_tamp.errors import one_line_of
from bt_tamp.executive.audit import ContactAudit
from bt_tamp.executive.befallen import Ledger
from bt_tamp.executive.build import CONTROL_EVERY, TREE_EVERY, Machine, build
from bt_tamp.executive.force_audit import ForceAudit
from bt_tamp.executive.peak_audit import PeakAudit
from bt_tamp.executive.plan_node import LOST_PATIENCE
from bt_tamp.executive.resuming import entering, state_of, take_up
from bt_tamp.executive.seams import REAL
from bt_tamp.export.snapshot import Results
from bt_tamp.options import RunOptions
from bt_tamp.replay import choices_of
from bt_tamp.report.recorder import RunRecorder
from bt_tamp.report.result import Outcome, RunResult
from bt_tamp.report.sentences import counted
from bt_tamp.report.signals import Contact, Reference
from bt_tamp.report.state import RunState
from bt_tamp.stopping import uninterrupted
from planner.task.facts import place_of
from scenarios.scenario import Scenario
from sim.disturbance import DisturbedPlant
from sim.plant import Command, Observation
from sim.scene import SceneState, is_on_floor

STANDS = ("plan_installed", "action_started", "action_done", "action_failed")
"""Events at which it is written down how things stand: a run that is killed goes on from the last."""

SAMPLE_EVERY = 5
"""Control ticks between two samples of the signals and two looks at the true contacts: 100 Hz."""

WORTH_A_LOOK = 15.0
"""Newtons felt at the wrist from which the true contacts are looked at in every tick, as when the arm is struck
elsewhere: a blow is over soon."""

BRAKING = 2.0
"""Simulated seconds that the arm gets to come to rest after an interruption."""

BLIND_PATIENCE = 3.0
"""Simulated seconds that things get to come to rest once a plan was carried out blindly."""

REST_PATIENCE = 30.0
"""Simulated seconds that things may go on moving once the goal's literals hold."""

MAX_REPLANS = 25
MAX_ACTIONS = 200


@dataclass
class Tally:
    """What is counted and remembered while a run goes on; `t` is simulated time in s."""

    t: float = 0.0
    results: Results = field(default_factory=Results)
    energy_j: float = 0.0
    peak_felt_n: float = 0.0
    unlawful: int = 0
    learned: dict[str, None] = field(default_factory=dict)
    failed: Counter[str] = field(default_factory=Counter)
    reasons: dict[str, str] = field(default_factory=dict)
    befallen: Ledger = field(default_factory=Ledger)
    over_since: float | None = None
    started: float = field(default_factory=time.perf_counter)


@dataclass(frozen=True)
class Audits:
    """What judges a run by the engine's truth."""

    contacts: ContactAudit
    forces: ForceAudit
    peaks: PeakAudit

    @staticmethod
    def of(machine: Machine) -> "Audits":
        return Audits(ContactAudit(machine.robot), ForceAudit(machine.robot), PeakAudit(machine.robot))


@dataclass(frozen=True)
class Ending:
    """How a run ended and why, in a sentence."""

    outcome: Outcome
    reason: str


def run_scenario(
    scenario: Scenario, options: RunOptions, recorder: RunRecorder, start: RunState | None = None
) -> RunResult:
    """Plan and act until the goal is reached or given up. An interruption (Ctrl-C) stops the arm softly; it, or an
    error in our own code, ends the run with a result too. start: the state in which the scenario is entered, if not
    afresh.

    Raises PddlError for hand-written PDDL that doesn't fit, ValueError for options that don't.
    """
    tally = Tally()

    def report(kind: str, **data: Any) -> None:
        if kind == "learned":
            tally.learned[data["sentence"]] = None
        if kind == "action_failed":
            tally.failed[data["action"]] += 1
            tally.reasons[data["action"]] = data["reason"]
        tally.befallen.hear(kind, tally.t, data)
        if kind in STANDS and recorder.is_kept:
            recorder.state(state_of(machine))
        _report(recorder, tally.t, kind, data, machine.planner.thinking.rounds)
        if driver is not None:
            driver.hear(kind, tally.t, data.get("phase", ""), data.get("action", ""))

    def tree_changed(why: str) -> None:
        tally.befallen.hear("rebuilt", tally.t, {})
        recorder.tree(machine.mission.root, why)

    driver = None
    if options.disturb or scenario.disturbances:
        driver = Driver(scenario.disturbances, options.disturb, options.seed, report)
    seams = driver.seams if driver else REAL
    machine = build(scenario, options, report, tree_changed, seams if start is None else entering(start, seams))
    if driver is not None:
        driver.bind(machine)
    audits = Audits.of(machine)
    # Until what was held is in the fingers again, things stand as they stood.
    stood = start
    begun = {"scene": scenario.name, "seed": scenario.seed, "choices": choices_of(options)}
    report("run_started", **begun, resumed=start is not None)
    recorder.state(stood or state_of(machine))
    try:
        try:
            if start is not None:
                take_up(machine, start)
                stood = None
            ending = _run(machine, options, recorder, audits, tally)
        except KeyboardInterrupt:
            ending = Ending("interrupted", _brake(machine, recorder, audits, tally))
    except Exception as error:  # Whatever it is: the run's folder is worth most when something went wrong.
        ending = Ending("crashed", f"{type(error).__name__}: {one_line_of(error)}")
        recorder.crash(traceback.format_exc())
    with uninterrupted():
        result = _result(machine, scenario, ending, audits, tally)
        recorder.tree(machine.mission.root, "end", tally.results)
        if driver is not None:
            driver.close()
        report("run_ended", outcome=result.outcome, sentence=result.reason)
        recorder.finish(result, stood or state_of(machine))
        machine.plant.close()
    return result


def _run(
    machine: Machine,
    options: RunOptions,
    recorder: RunRecorder,
    audits: Audits,
    tally: Tally,
) -> Ending:
    n = 0
    while True:
        look(machine, tally, n)
        if n % TREE_EVERY == 0:
            ending = _ending(machine, options, tally)
            if ending:
                return ending
        act(machine, recorder, audits, tally, n)
        n += 1


def _brake(machine: Machine, recorder: RunRecorder, audits: Audits, tally: Tally) -> str:
    """Bring the arm to rest, for a bounded time; how that went, in a sentence. A second one ends it at once."""
    try:
        machine.agenda.act.stop(Status.INVALID)
        machine.context.controller.hold()
        machine.context.controller.acknowledge()
        for n in range(round(BRAKING / (CONTROL_EVERY * machine.plant.timestep))):
            machine.context.observation = machine.plant.observe()
            tally.t = machine.context.observation.t
            act(machine, recorder, audits, tally, n)
            if n % TREE_EVERY == 0:
                machine.context.scene = machine.belief.update(
                    machine.context.observation, machine.context.grip.is_closing
                )
            if machine.context.controller.finished:
                return "the run was interrupted, the arm brought to rest"
    except KeyboardInterrupt:
        return "the run was interrupted twice, and ended at once"
    return f"the run was interrupted, and the arm did not come to rest within {BRAKING:g} s"


def look(machine: Machine, tally: Tally, n: int) -> None:
    """First half of control tick n: observe, and tick the tree when it is due."""
    context = machine.context
    context.observation = machine.plant.observe()
    tally.t = context.observation.t
    machine.plant.lap("observe")
    if n % TREE_EVERY == 0:
        context.scene = machine.belief.update(context.observation, context.grip.is_closing)
        # BehaviourTree.tick would walk through the whole tree once more, for visitors of a kind that is not here.
        for node in machine.mission.root.tick():
            node.visit(tally.results)
        tally.befallen.look(tally.t, context.controller.is_still)
        machine.plant.lap("tree")


def act(machine: Machine, recorder: RunRecorder, audits: Audits, tally: Tally, n: int) -> None:
    """Second half of control tick n: control, record, and let the world go on."""
    plant, context = machine.plant, machine.context
    tau = context.controller.update(context.observation)
    limits = zip(tau.tolist(), machine.robot.tau_max.tolist(), strict=True)
    # Written so that a command of NaN is counted too.
    tally.unlawful += not all(abs(torque) <= most for torque, most in limits)
    plant.apply(Command(tau, context.grip.command(context.observation)))
    plant.lap("apply")
    _account(machine, recorder, audits, tally, n)
    plant.lap("record")
    for _ in range(CONTROL_EVERY):
        plant.step()


def _account(machine: Machine, recorder: RunRecorder, audits: Audits, tally: Tally, n: int) -> None:
    context = machine.context
    controller, observation = context.controller, context.observation
    force = controller.contact_force if controller.contact else 0.0
    tally.peak_felt_n = max(tally.peak_felt_n, force)
    is_due = n % SAMPLE_EVERY == 0
    if is_due or controller.felt > WORTH_A_LOOK or controller.is_struck:
        contacts = machine.plant.contacts()
        held = context.scene.held
        audits.peaks.look(contacts, _truth(machine), held.name if held is not None else None)
    if is_due:
        rates = zip(observation.tau.tolist(), observation.v.tolist(), strict=True)
        power = sum(abs(torque * rate) for torque, rate in rates)
        tally.energy_j += power * SAMPLE_EVERY * CONTROL_EVERY * machine.plant.timestep
        reference = controller.reference
        wanted = reference.force if reference else 0.0
        q_ref = reference.course.at(controller.time_in_reference)[0] if reference else observation.q
        p_ref = machine.robot.X_WG(q_ref).translation if wanted else None
        # What is recorded is what was, not what was sensed.
        recorder.sample(_truth(machine), Reference(q_ref, p_ref, wanted), force)
        running = str(machine.agenda.running or "planning")
        audits.contacts.look(observation.t, contacts, context, running)
        audits.forces.look(observation.t, contacts, context, running)
        if recorder.contacts_due(observation.t):
            recorder.contacts(
                observation.t,
                [Contact(c.first, c.second, c.position, c.force) for c in audits.contacts.of_robot(contacts, context)],
            )


def _truth(machine: Machine) -> Observation:
    return machine.plant.truth() if isinstance(machine.plant, DisturbedPlant) else machine.context.observation


def _ending(machine: Machine, options: RunOptions, tally: Tally) -> Ending | None:
    verdict = machine.planner.thinking.verdict
    if machine.mission.goal.status == Status.SUCCESS:
        machine.context.report("goal_reached")
        return Ending("goal_reached", "every literal of the goal holds")
    if verdict is not None:
        return Ending("proven_infeasible" if verdict.verdict == "proven" else "no_plan", verdict.reason)
    if not options.replan:
        blind = _blind_ending(machine, tally)
        if blind is not None:
            return blind
    waits = machine.mission.goal.waits
    if waits is not None and waits[1] and machine.context.observation.t - waits[0] > LOST_PATIENCE:
        names = ", ".join(waits[1])
        return Ending(
            "no_plan", f"{names} {'is' if len(waits[1]) == 1 else 'are'} nowhere to be seen; the rest is done"
        )
    restless = machine.mission.goal.restless
    if restless is not None and machine.context.observation.t - restless[0] > REST_PATIENCE:
        return Ending("gave_up", f"{', '.join(restless[1])} did not come to rest within {REST_PATIENCE:g} s")
    if machine.planner.thinking.plans > MAX_REPLANS:
        return Ending("gave_up", f"planning {MAX_REPLANS} times did not lead to the goal{_most_often(tally)}")
    if len(machine.agenda.executed) > MAX_ACTIONS:
        return Ending("gave_up", f"{MAX_ACTIONS} actions were carried out and the goal still does not hold")
    if machine.context.observation.t > options.max_sim_time:
        return Ending("gave_up", f"{options.max_sim_time:g} s of simulated time have passed")
    return None


def _blind_ending(machine: Machine, tally: Tally) -> Ending | None:
    """The end of a run that carries out its first plan whatever it sees."""
    agenda, context = machine.agenda, machine.context
    if context.failure is not None:
        return Ending("gave_up", f"open loop: {context.failure.action} failed: {context.failure.reason}")
    if not agenda.is_over:
        return None
    tally.over_since = context.observation.t if tally.over_since is None else tally.over_since
    if context.observation.t - tally.over_since < BLIND_PATIENCE:
        return None
    return Ending("gave_up", "open loop: the plan was carried out, and the goal does not hold")


def _most_often(tally: Tally) -> str:
    """Which action failed most often in execution, and why it did last."""
    if not tally.failed:
        return ""
    (action, times), *_ = tally.failed.most_common(1)
    return f"; {action} failed {counted(times, 'time')}, at last because {tally.reasons[action]}"


def _result(machine: Machine, scenario: Scenario, ending: Ending, audits: Audits, tally: Tally) -> RunResult:
    context, agenda, thinking = machine.context, machine.agenda, machine.planner.thinking
    known = agenda.facts(context.scene)
    held = context.scene.held
    places = {name: _place(context.scene, name) for name in scenario.bodies if name not in agenda.unseen}
    if held is not None:
        places[held.name] = "hand"
    return RunResult(
        scenario=scenario.name,
        seed=scenario.seed,
        outcome=ending.outcome,
        reason=ending.reason,
        goal={str(fact): fact in known for fact in sorted(agenda.goal)},
        plan=tuple(str(action) for action in agenda.plan.actions) if agenda.plan else (),
        executed=tuple(str(action) for action in agenda.executed),
        executed_s=tally.befallen.durations,
        learned=tuple(tally.learned),
        places=places,
        rounds=thinking.rounds,
        replans=max(0, thinking.plans - 1),
        planning_cpu_s=thinking.cpu_s,
        planning_wall_s=thinking.wall_s,
        robot_s=context.observation.t,
        wall_s=time.perf_counter() - tally.started,
        peak_contact_force_n=tally.peak_felt_n,
        peak_force_n=audits.peaks.peak,
        torque_limit_violations=context.controller.torque_limit_violations,
        unlawful_commands=tally.unlawful,
        unintended_contacts=tuple(audits.contacts.found),
        pressed=audits.forces.found,
        peak_rss_mb=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        energy_j=tally.energy_j,
        disturbances=tally.befallen.found,
    )


def _place(scene: SceneState, name: str) -> str:
    """Where a body lies that isn't in the hand, in a word."""
    if name not in scene.poses:
        return "nowhere"
    return place_of(scene, name) or ("floor" if is_on_floor(scene, name) else "elsewhere")


def _report(recorder: RunRecorder, t: float, kind: str, data: dict[str, Any], earlier_rounds: int) -> None:
    if kind in ("round", "proof_sought"):
        data["round"] += earlier_rounds
        name = f"round-{data['round']:02d}" + ("-proof" if kind == "proof_sought" else "")
        recorder.pddl(name, data.pop("domain"), data.pop("problem"))
        recorder.plan(name, "no plan" if data["plan"] is None else "\n".join(data["plan"]))
    recorder.event(kind, t, **data)
