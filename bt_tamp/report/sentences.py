"""What an event says to a person, in one sentence."""

from bt_tamp.report.events import Event

GONE_ON = "gone on from where another run ended; nothing that was to befall that one comes again"


def sentence(event: Event) -> str | None:
    """The event as a sentence without a full stop; None for events that only mark progress."""
    data = event.data
    match event.kind:
        case "run_started":
            said = f"{data['scene']}, seed {data['seed']}: planning (a first run compiles too; times are the robot's)"
            return f"{said}; {GONE_ON}" if data.get("resumed") else said
        case "round":
            return f"round {data['round']}: {planner_failed(event) or _proposal(data['plan'])}"
        case "proof_sought":
            return planner_failed(event) or _proof(data["plan"])
        case "refinement_failed":
            return f"{data['action']} can't be done like this: {data['reason']}{in_the_way(event)}"
        case "planner_crashed":
            return f"{data['doing']} {data['action']} crashed: {'; '.join(data['crashes'])}"
        case "backtracked":
            return f"another choice for {data['to']}, so that {data['action']} may work"
        case "learned":
            return f"learned: {data['sentence']}"
        case "widened":
            return f"nothing left to try so: {data['tries']} samples for each action from now on"
        case "plan_installed":
            return f"plan: {' → '.join(data['actions']) or 'nothing to do'}"
        case "action_failed":
            return f"{data['action']} failed: {data['reason']}"
        case "refined_again":
            return f"{data['action']} is worked out anew: {data['reason']}"
        case "skipped":
            return f"skipped, as it is done already: {', '.join(data['actions'])}"
        case "redone":
            return f"{', '.join(data['actions'])} again: {', '.join(data['lacking']) or 'its effect'} no longer holds"
        case "pressed_harder":
            return f"{data['action']} slips: pressed with {data['force']:.0f} N from now on"
        case "put_off":
            return f"no way to {', '.join(data['goal'])}: the rest is done first"
        case "replan":
            return f"planning again: {data['reason']}"
        case "disturbed":
            return f"disturbance: {data['sentence']}"
        case "never_came":
            return data["sentence"]
        case "missing":
            return f"waiting for {', '.join(data['bodies'])} to turn up again"
        case "waiting":
            return f"waiting for {', '.join(data['bodies'])} to come to rest"
        case "goal_reached":
            return "goal reached"
        case "run_ended" if data["outcome"] != "goal_reached":
            return f"{data['outcome'].replace('_', ' ')}: {data['sentence']}"
    return None


def in_the_way(event: Event) -> str:
    """The culprits of a failure, to be put after its reason; nothing without culprits."""
    culprits = event.data.get("culprits") or ()
    return f"; in the way: {', '.join(culprits)}" if culprits else ""


def planner_failed(event: Event) -> str:
    """That the task planner failed in a round, which says nothing about the goal; "" if it didn't."""
    failure = event.data.get("failure")
    return f"the task planner failed ({failure})" if failure else ""


def counted(number: int, what: str) -> str:
    """A number with its noun, in the plural where it is due."""
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _proposal(plan: list[str] | None) -> str:
    if plan is None:
        return "by what is known, no sequence of actions leads to the goal"
    return f"the task planner proposes {' → '.join(plan) or 'nothing to do'}"


def _proof(plan: list[str] | None) -> str:
    if plan is None:
        return "even by what is proven alone, no sequence of actions leads to the goal"
    return "by what is proven alone, the goal isn't out of reach"
