"""A tree as indented text, in plain ASCII or with Unicode's box lines and symbols."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from bt_tamp.export.snapshot import Kind, Status, TreeNode


@dataclass(frozen=True)
class _Style:
    kinds: Mapping[Kind, str]
    statuses: Mapping[Status, str]
    tee: str
    corner: str
    bar: str
    forget: str


_ASCII = _Style(
    kinds={
        "sequence": "[->]",
        "selector": "[?]",
        "parallel": "[=>]",
        "decorator": "<>",
        "condition": "(?)",
        "action": "(!)",
    },
    statuses={"SUCCESS": "ok", "FAILURE": "FAILED", "RUNNING": "running", "INVALID": "-"},
    tee="|-- ",
    corner="`-- ",
    bar="|   ",
    forget="*",
)

_UNICODE = _Style(
    kinds={
        "sequence": "→",
        "selector": "?",
        "parallel": "⇉",
        "decorator": "◇",
        "condition": "○",
        "action": "▪",
    },
    statuses={"SUCCESS": "✓", "FAILURE": "✗", "RUNNING": "▶", "INVALID": "·"},
    tee="├── ",
    corner="└── ",
    bar="│   ",
    forget="*",
)

LEGEND = "sequence [->], selector [?], parallel [=>], decorator <>, condition (?), action (!); * keeps no memory"


def to_ascii(root: TreeNode) -> str:
    """The tree as ASCII text, one node a line; other characters in names are escaped."""
    text = "\n".join([*_lines(root, _ASCII, "", ""), "", LEGEND])
    return text.encode("ascii", "backslashreplace").decode("ascii")


def to_unicode(root: TreeNode) -> str:
    """The tree as text with box lines, one node a line."""
    legend = "→ sequence  ? selector  ⇉ parallel  ◇ decorator  ○ condition  ▪ action  * no memory"
    return "\n".join([*_lines(root, _UNICODE, "", ""), "", legend])


def _lines(node: TreeNode, style: _Style, lead: str, below: str) -> Iterator[str]:
    forget = style.forget if is_forgetful(node) else ""
    message = " ".join(node.message.split())
    tail = f" -- {message}" if message else ""
    yield f"{lead}{style.kinds[node.kind]}{forget} {node.name}  {style.statuses[node.status]}{tail}"
    for place, child in enumerate(node.children, start=1):
        last = place == len(node.children)
        lead_here, below_here = (style.corner, "    ") if last else (style.tee, style.bar)
        yield from _lines(child, style, below + lead_here, below + below_here)


def is_forgetful(node: TreeNode) -> bool:
    """Does this composite start over from its first child at every tick?"""
    return node.kind in ("sequence", "selector") and not node.memory
