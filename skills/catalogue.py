"""The one place where primitives are registered; `domain.pddl` beside it describes the same ones."""

from importlib.resources import files
from pathlib import Path

from skills.drag import Drag
from skills.drag_aside import DragAside
from skills.pick import Pick
from skills.place import Place
from skills.skill import Skill, Toolkit
from skills.wipe import Wipe

PRIMITIVES = (Pick, Place, Wipe, Drag, DragAside)


def skills(toolkit: Toolkit) -> dict[str, Skill]:
    """Every primitive by the name of its action."""
    return {primitive.name: primitive(toolkit) for primitive in PRIMITIVES}


def phases() -> dict[str, tuple[str, ...]]:
    """The names of every primitive's phases, by the name of its action."""
    return {primitive.name: primitive.phases for primitive in PRIMITIVES}


def domain_path() -> Path:
    """The PDDL domain that describes the primitives."""
    return Path(str(files("skills") / "domain.pddl"))
