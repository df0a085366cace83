"""A tree in Graphviz's language, for whoever has its programs."""

from collections.abc import Iterator, Mapping

from bt_tamp.export.snapshot import Kind, Status, TreeNode
from bt_tamp.export.text import is_forgetful

_SHAPES: Mapping[Kind, str] = {
    "sequence": "box",
    "selector": "octagon",
    "parallel": "parallelogram",
    "decorator": "hexagon",
    "condition": "ellipse",
    "action": "box",
}
_SIGNS: Mapping[Kind, str] = {"sequence": "→ ", "selector": "? ", "parallel": "⇉ "}
_COLOURS: Mapping[Status, tuple[str, str]] = {
    "SUCCESS": ("#e5f5ea", "#2f9e5b"),
    "FAILURE": ("#fdeaea", "#d64550"),
    "RUNNING": ("#fff3d6", "#dd8a00"),
    "INVALID": ("#f5f7fa", "#8a94a2"),
}


def to_dot(root: TreeNode) -> str:
    """The tree as a directed graph, children in their order from left to right."""
    lines = [
        "digraph tree {",
        '  graph [ordering="out", nodesep="0.15", ranksep="0.35", fontname="sans-serif"];',
        '  node [style="filled", fontname="sans-serif", fontsize="11", height="0.3"];',
        '  edge [arrowhead="none", color="#8a94a2"];',
        *_lines(root, "n"),
        "}",
    ]
    return "\n".join(lines) + "\n"


def quoted(text: str) -> str:
    """A string literal: quotes and backslashes escaped, lines broken as Graphviz reads it, no control characters."""
    plain = "".join(c for c in text if c.isprintable() or c == "\n")
    return '"' + plain.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'


def _lines(node: TreeNode, name: str) -> Iterator[str]:
    fill, line = _COLOURS[node.status]
    label = _SIGNS.get(node.kind, "") + node.name + (" *" if is_forgetful(node) else "")
    attributes = {
        "label": label,
        "tooltip": node.message or f"{node.kind}, {node.status.lower()}",
        "shape": _SHAPES[node.kind],
        "fillcolor": fill,
        "color": line,
        "peripheries": "2" if is_forgetful(node) else "1",
    }
    yield f"  {name} [{', '.join(f'{key}={quoted(value)}' for key, value in attributes.items())}];"
    for place, child in enumerate(node.children):
        below = f"{name}_{place}"
        yield from _lines(child, below)
        yield f"  {name} -> {below};"
