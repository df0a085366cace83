"""A behaviour tree as plain data: names, kinds, statuses and messages at one moment."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal, get_args
from uuid import UUID

import py_trees
from py_trees.visitors import VisitorBase

Kind = Literal["sequence", "selector", "parallel", "decorator", "condition", "action"]
Status = Literal["SUCCESS", "FAILURE", "RUNNING", "INVALID"]


@dataclass(frozen=True)
class TreeNode:
    """One node. `memory` is only true for a sequence or selector that goes on where it was.

    A leaf whose name ends with "?" is a condition, every other leaf an action.
    """

    name: str
    kind: Kind
    memory: bool
    status: Status
    message: str
    children: tuple["TreeNode", ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """The subtree as nested dictionaries."""
        own = {"name": self.name, "kind": self.kind, "memory": self.memory, "status": self.status}
        return {**own, "message": self.message, "children": [child.to_dict() for child in self.children]}

    def to_json(self) -> str:
        """The subtree as JSON text."""
        return json.dumps(self.to_dict(), indent=1, ensure_ascii=False) + "\n"

    @staticmethod
    def from_dict(data: Any) -> "TreeNode":
        """Read what `to_dict` gave. Raises ValueError naming what is missing or wrong."""
        try:
            node = TreeNode(
                name=str(data["name"]),
                kind=data["kind"],
                memory=bool(data["memory"]),
                status=data["status"],
                message=str(data["message"]),
                children=tuple(TreeNode.from_dict(child) for child in data["children"]),
            )
        except (KeyError, TypeError) as error:
            raise ValueError(f"not a tree's node: {error}") from None
        for what, value, known in (("kind", node.kind, get_args(Kind)), ("status", node.status, get_args(Status))):
            if value not in known:
                raise ValueError(f"node {node.name!r}: {what} {value!r}, expected one of {', '.join(known)}")
        return node

    @staticmethod
    def from_json(text: str) -> "TreeNode":
        """Read what `to_json` wrote. Raises ValueError for anything else."""
        return TreeNode.from_dict(json.loads(text))

    def walk(self) -> Iterator["TreeNode"]:
        """This node and everything below it, parents first."""
        yield self
        for child in self.children:
            yield from child.walk()


class Results(VisitorBase):
    """Remembers how each node ended last: a finished part of a tree forgets it as soon as the tree above is stopped."""

    def __init__(self) -> None:
        super().__init__(full=False)
        self.of: dict[UUID, py_trees.common.Status] = {}

    def run(self, behaviour: py_trees.behaviour.Behaviour) -> None:
        """Look at a node that was just ticked."""
        if behaviour.status == py_trees.common.Status.RUNNING:
            self.of.pop(behaviour.id, None)
        else:
            self.of[behaviour.id] = behaviour.status


def snapshot(root: py_trees.behaviour.Behaviour, results: Results | None = None) -> TreeNode:
    """The tree under `root` as it stands now; nodes that were stopped since show how they ended, if `results` knows."""
    status = root.status
    if results is not None and status == py_trees.common.Status.INVALID:
        status = results.of.get(root.id, status)
    return TreeNode(
        name=root.name,
        kind=_kind(root),
        memory=bool(getattr(root, "memory", False)),
        status=status.value,
        message=root.feedback_message or "",
        children=tuple(snapshot(child, results) for child in root.children),
    )


def _kind(node: py_trees.behaviour.Behaviour) -> Kind:
    match node:
        case py_trees.composites.Sequence():
            return "sequence"
        case py_trees.composites.Selector():
            return "selector"
        case py_trees.composites.Parallel():
            return "parallel"
        case py_trees.decorators.Decorator():
            return "decorator"
    return "condition" if node.name.rstrip().endswith("?") else "action"
