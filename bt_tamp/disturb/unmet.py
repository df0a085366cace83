"""Why something that was to befall a run did not."""

from collections.abc import Iterable

from bt_tamp.report.sentences import counted
from scenarios.disturbance import Moment


def why_declared(number: int, moment: Moment, met: int, tries: int, began: Iterable[str]) -> str:
    """Of the scene's entry `number` (from 0), in a sentence. met: how many phases of the kind awaited there were until
    its moment came; tries: how often it was looked for something to do; began: the names of all phases that there were.
    """
    said = f"disturbances[{number}] of the scene did not come"
    if tries:
        return f"{said}: there was nothing that it could be done to, or no room"
    if moment.at is not None:
        return f"{said}: the run was over before {moment.at:g} s"
    of = f"{moment.action}'s phase" if moment.action is not None else "phase"
    if met == moment.nth:
        return f"{said}: the run was over before {of} {moment.phase!r} had lasted {moment.after:g} s"
    if met:
        return f"{said}: {of} {moment.phase!r} began {counted(met, 'time')}, {moment.nth} were waited for"
    names = ", ".join(sorted(set(began)))
    return f"{said}: {of} {moment.phase!r} did not begin" + (f"; those that did: {names}" if names else "")


def why_drawn(name: str, tries: int, is_due: bool) -> str:
    """Of a class that was to come at random, in a sentence. tries: how often it was looked for something to do; is_due:
    had its moment been set?"""
    if tries:
        return f"the class {name} did not come: there was nothing that it could be done to"
    when = "its moment came" if is_due else "a phase for it came"
    return f"the class {name} did not come: the run was over before {when}"
