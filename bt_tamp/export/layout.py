"""Where each node of a tree is drawn: below its parent if that stays narrow, else as an outline, and a long
outline in columns.

All lengths in pixels; x to the right, y down, the root's box at the origin's row.
"""

from dataclasses import dataclass, replace
from typing import Literal

from bt_tamp.export.snapshot import TreeNode

FONT = 13.0
NOTE = 11.0
BOX = 30.0
ROW = 40.0
LEVEL = 76.0
GAP = 22.0
INDENT = 38.0
BADGE = 28.0
NAME_LIMIT = 64
NOTE_LIMIT = 110
BELOW_LIMIT = 34
MAX_WIDTH = 1500.0
MAX_HEIGHT = 1100.0
COLUMNS_WIDTH = 1500.0
BAND_GAP = 46.0
BUS = 18.0

_NARROW = frozenset("iljtfr.,:;'|!()[] ")
_WIDE = frozenset("mwMW@%→⇉")


Edge = Literal["curve", "elbow", "bus"]
"""From the middle of the parent's lower edge; from the spine below it; from the spine along a line above a row."""


@dataclass(frozen=True)
class Placed:
    """A node with its box: left edge x, upper edge y, width; `edge` is the kind of line from its parent."""

    node: TreeNode
    x: float
    y: float
    width: float
    edge: Edge
    children: tuple["Placed", ...]

    @property
    def note_below(self) -> bool:
        """Does the message stand under the box, rather than to its right?"""
        return self.edge == "curve"

    @property
    def right(self) -> float:
        """Right edge of everything drawn for this subtree."""
        own = self.x + self.width
        if self.node.message:
            note = text_width(shortened(self.node.message, self.note_limit), NOTE)
            own = self.x + max(self.width, note) if self.note_below else own + 12 + note
        return max([own, *(child.right for child in self.children)])

    @property
    def bottom(self) -> float:
        """Lower edge of everything drawn for this subtree."""
        own = self.y + BOX + (16 if self.note_below and self.node.message else 0)
        return max([own, *(child.bottom for child in self.children)])

    @property
    def note_limit(self) -> int:
        return BELOW_LIMIT if self.note_below else NOTE_LIMIT


def text_width(text: str, size: float) -> float:
    """Estimated width of sans-serif text; a little generous, as the font isn't known."""
    return size * sum(0.36 if c in _NARROW else 0.9 if c in _WIDE else 0.7 if c.isupper() else 0.6 for c in text)


def shortened(text: str, limit: int) -> str:
    """One line of at most `limit` characters."""
    line = " ".join(text.split())
    return line if len(line) <= limit else line[: limit - 1].rstrip() + "…"


def box_width(node: TreeNode) -> float:
    """Width of a node's box: symbol, name, status."""
    ends = 16 if node.kind in ("condition", "decorator") else 4
    bold = 1.12 if node.kind in ("sequence", "selector", "parallel") else 1.0
    return BADGE + text_width(shortened(node.name, NAME_LIMIT), FONT) * bold + 28 + ends


def arrange(root: TreeNode) -> Placed:
    """The tidy drawing if it is at most `MAX_WIDTH` wide, else the outline, in columns if it gets too long."""
    tidy = top_down(root)
    if tidy.right <= MAX_WIDTH:
        return tidy
    plain = outline(root)
    if plain.bottom <= MAX_HEIGHT:
        return plain
    spreads = (outline(root, node) for node in root.walk() if len(node.children) > 1)
    return min(spreads, key=lambda placed: placed.bottom, default=plain)


def outline(root: TreeNode, spread: TreeNode | None = None) -> Placed:
    """One node a row, children indented below their parent; those of `spread` side by side, in several bands."""
    y = 0.0

    def place(node: TreeNode, depth: int) -> Placed:
        nonlocal y
        top = y
        y += ROW
        if node is spread:
            children = _bands(node, depth * INDENT + INDENT, y)
            y = max(child.bottom for child in children) + ROW - BOX
        else:
            children = tuple(place(child, depth + 1) for child in node.children)
        return Placed(node, depth * INDENT, top, box_width(node), "elbow", children)

    return place(root, 0)


def _bands(parent: TreeNode, left: float, top: float) -> tuple[Placed, ...]:
    """The children of a node as outlines side by side, a new band where one is full."""
    placed: list[Placed] = []
    x, y, bottom = left, top + BUS, top
    for child in parent.children:
        own = outline(child)
        if x > left and x + own.right > COLUMNS_WIDTH:
            x, y = left, bottom + BAND_GAP
        placed.append(replace(_moved(own, x, y), edge="bus"))
        x += own.right + GAP
        bottom = max(bottom, placed[-1].bottom)
    return tuple(placed)


def _moved(placed: Placed, x: float, y: float) -> Placed:
    children = tuple(_moved(child, x, y) for child in placed.children)
    return replace(placed, x=placed.x + x, y=placed.y + y, children=children)


def top_down(root: TreeNode) -> Placed:
    """Children side by side below their parent, which stands over their middle."""

    def place(node: TreeNode, left: float, depth: int) -> tuple[Placed, float]:
        note = text_width(shortened(node.message, BELOW_LIMIT), NOTE) if node.message else 0.0
        own = box_width(node)
        need = max(own, note)
        span = _span(node)
        children, cursor = [], left + max(0.0, (need - span) / 2)
        for child in node.children:
            placed, cursor = place(child, cursor, depth + 1)
            children.append(placed)
            cursor += GAP
        if children:
            first, last = children[0], children[-1]
            middle = (first.x + first.width / 2 + last.x + last.width / 2) / 2
            x = max(left, middle - own / 2)
        else:
            x = left + (need - own) / 2
        return Placed(node, x, depth * LEVEL, own, "curve", tuple(children)), max(left + need, cursor - GAP)

    return place(root, 0.0, 0)[0]


def _span(node: TreeNode) -> float:
    """Width that the children of a node need side by side."""
    widths = [_needed(child) for child in node.children]
    return sum(widths) + GAP * (len(widths) - 1) if widths else 0.0


def _needed(node: TreeNode) -> float:
    note = text_width(shortened(node.message, BELOW_LIMIT), NOTE) if node.message else 0.0
    return max(box_width(node), note, _span(node))
