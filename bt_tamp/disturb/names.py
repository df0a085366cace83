"""The names of the classes of disturbances, with nothing heavy to import."""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Declared:
    """What is said of a class before any run: a sentence, and whether the goal can still be reached."""

    sentence: str
    is_reachable: bool = True


CLASSES: dict[str, Declared] = {
    "moved": Declared("an object of this or a later action is moved by 4 to 15 cm"),
    "rotated": Declared("an object is turned on the spot by 30° to 90°"),
    "toppled": Declared("an object that stands is laid on its side"),
    "taken-and-returned": Declared("an object is taken away and brought back 2 to 5 s later"),
    "new-object": Declared("one more object appears, wanted in a bin"),
    "new-crumb": Declared("one more crumb appears, wanted in the dustpan"),
    "path-blocked": Declared("a post is put where the arm is going to come"),
    "stroke-blocked": Declared("a post is put where a stroke or a drag is going to come"),
    "knocked-from-hand": Declared("what is held is knocked from the hand onto the table"),
    "slipping": Declared("the fingers' pads turn slippery for 1 s while something is held"),
    "sponge-far": Declared("the sponge is put at another end of the table"),
    "sponge-covered": Declared("a box is put on the sponge"),
    "bin-shifted": Declared("a bin that is still needed is shifted by a third of its width or more"),
    "crumbs-beside-pan": Declared("a crumb comes to lie on the table beside the dustpan's opening"),
    "goal-changed": Declared("something is wanted in another bin than before"),
    "push": Declared("100 N for 0.1 s somewhere on the arm"),
    "closes-on-nothing": Declared("what the fingers are about to close on is pulled away"),
    "weak-grip": Declared("the fingers lose their force for 0.5 s"),
    "force-bias": Declared("the force sensor is off by 6 N and 0.18 Nm from some moment on"),
    "force-noise": Declared("the force sensor is noisy by 0.5 N from some moment on"),
    "force-missing": Declared("the force sensor says NaN for 1 s"),
    "force-frozen": Declared("the force sensor says the same for 1 s"),
    "joint-delay": Declared("the joints' state comes 10 ms late for 2 s"),
    "joint-friction": Declared("a joint rubs with 3 Nm from some moment on"),
    "pose-noise": Declared("objects are seen with 5 mm and 3° of noise from some moment on"),
    "pose-delay": Declared("objects are seen 0.3 s late from some moment on, and one is moved"),
    "pose-missing": Declared("no object is seen for 1 s, and one is moved meanwhile"),
    "qp-infeasible": Declared("the controller's QP has no solution for 40 ms, a dozen times"),
    "qp-iterations": Declared("the controller's QP runs out of iterations for 40 ms, a dozen times"),
    "motion-budget": Declared("the motion planner is out of budget in every fourth query"),
    "task-planner": Declared("the task planner crashes, talks nonsense or runs out of budget up to three times"),
    "taken-for-good": Declared("an object that the goal is about is taken away for good", is_reachable=False),
    "sponge-out-of-reach": Declared("the sponge is thrown on the floor, out of reach", is_reachable=False),
}


def chosen(text: str) -> tuple[str, ...]:
    """The classes of "CLASS,…", "all" or "none". Raises ValueError for an unknown one."""
    from scenarios.names import known

    if text in ("all", "none"):
        return tuple(CLASSES) if text == "all" else ()
    names = tuple(dict.fromkeys(part.strip() for part in text.split(",")))
    for name in names:
        if name not in CLASSES:
            if name in ("all", "none"):
                raise ValueError(f"{name!r} stands alone, without other classes")
            raise ValueError(f"unknown class of disturbance {name!r}, {known(name, CLASSES)}")
    return names


def can_be_reached(classes: Iterable[str]) -> bool:
    """Can the goal still be reached, whatever instance of these classes befalls the run?"""
    return all(CLASSES[name].is_reachable for name in classes)
