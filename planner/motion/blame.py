"""What to hold against a motion that hits something: a reason for people, and the culprits."""

from collections.abc import Sequence

from planner.failure import MotionFailure
from planner.motion.exact import Contact


def blame(what: str, contacts: Sequence[Contact], movable: frozenset[str]) -> MotionFailure:
    """A failure whose culprits are the movable bodies hit, or nobody if something is hit that can't be moved aside."""
    hits = ["–".join(_ordered(contact, movable)) for contact in contacts]
    culprits = frozenset().union(*(contact.pair & movable for contact in contacts))
    immovable = any(not contact.pair & movable for contact in contacts)
    return MotionFailure(f"{what} {', '.join(dict.fromkeys(hits))}", frozenset() if immovable else culprits)


def _ordered(contact: Contact, movable: frozenset[str]) -> list[str]:
    return sorted(contact.pair, key=lambda name: (name in movable, name))
