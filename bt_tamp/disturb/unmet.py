"""Why something that was to befall a run did not."""

from collections.abc import Iterable

from bt_tamp.report.sentences import counted
from scenarios.disturbance import Moment


def why_declared(number: int, moment: Moment, met: int, is_due: bool, began: Iterable[str]) -> str:
    """Of the scene's entry `number` (from 0), in a sentence. met: how many phases of the kind awaited there were;
    is_due: its moment came; began: the names of all phases that there were."""
    said = f"disturbances[{number}] of the scene did not come"
    if is_due:
        return f"{said}: there was nothing that it could be done to, or its moment was the run's last"
    if moment.at is not None:
        return f"{said}: the run was over before {moment.at:g} s"
    of = f"{moment.action}'s phase" if moment.action is not None else "phase"
    if met:
        return f"{said}: {of} {moment.phase!r} began {counted(met, 'time')}, {moment.nth} were waited for"
    names = ", ".join(sorted(set(began)))
    return f"{said}: {of} {moment.phase!r} did not begin" + (f"; those that did: {names}" if names else "")


def why_drawn(name: str, tries: int) -> str:
    """Of a class that was to come at random, in a sentence. tries: how often it was looked for something to do."""
    nothing = "there was nothing that it could be done to" if tries else "the phase that it waited for did not come"
    return f"the class {name} did not come: {nothing}"
