"""A tree as an SVG picture: shape by kind, colour and mark by status. Needs nothing but a browser.

Every node is a group inside its parent's group, moved by its offset from the parent, so that the
page made by `html.py` can fold a subtree away.
"""

from collections.abc import Iterator, Mapping
from xml.sax.saxutils import escape, quoteattr

from bt_tamp.export.layout import (
    BADGE,
    BOX,
    BUS,
    FONT,
    NAME_LIMIT,
    NOTE,
    Placed,
    arrange,
    shortened,
    text_width,
)
from bt_tamp.export.snapshot import Kind, Status, TreeNode
from bt_tamp.export.text import is_forgetful

MARGIN = 28.0
SPINE = 17.0
FONTS = "'Segoe UI', 'Helvetica Neue', Arial, 'DejaVu Sans', sans-serif"

COLOURS: Mapping[Status, tuple[str, str, str]] = {
    "SUCCESS": ("#e5f5ea", "#2f9e5b", "#14532d"),
    "FAILURE": ("#fdeaea", "#d64550", "#7f1d1d"),
    "RUNNING": ("#fff3d6", "#dd8a00", "#6b4300"),
    "INVALID": ("#f5f7fa", "#a7b1be", "#3d4753"),
}
"""Fill, line and text colour by status."""

_MARKS: Mapping[Status, str] = {
    "SUCCESS": "M-4.5,0.5 L-1.5,3.8 L4.8,-3.8",
    "FAILURE": "M-3.8,-3.8 L3.8,3.8 M3.8,-3.8 L-3.8,3.8",
    "RUNNING": "M-2.8,-4.2 L4.2,0 L-2.8,4.2 Z",
    "INVALID": "M-3,0 L3,0",
}

_SYMBOLS: Mapping[Kind, str] = {
    "sequence": "M-6,0 H6 M2,-4 L6,0 L2,4",
    "selector": "M-3.4,-2.8 C-3.4,-7.4 3.6,-7.2 3.4,-2.8 C3.2,-0.2 0,-0.4 0,2.4 M0,5.6 v0.3",
    "parallel": "M-6,-3 H5 M2,-6 L5.5,-3 L2,0 M-6,4 H5 M2,1 L5.5,4 L2,7",
    "decorator": "M0,-6 L6,0 L0,6 L-6,0 Z",
    "condition": "M-5,0 a5,5 0 1,0 10,0 a5,5 0 1,0 -10,0",
    "action": "M-4.5,-4.5 h9 v9 h-9 Z",
}

_FORGET = "M3.6,-2.4 A4.3,4.3 0 1,0 4.2,1.2 M4.6,-5.4 L3.8,-2.1 L0.6,-2.9"

_NAMES: Mapping[Kind, str] = {
    "sequence": "sequence: all, in order",
    "selector": "selector: the first that works",
    "parallel": "parallel: all at once",
    "decorator": "decorator",
    "condition": "condition",
    "action": "action",
}
_STATUS_NAMES: Mapping[Status, str] = {
    "SUCCESS": "success",
    "FAILURE": "failure",
    "RUNNING": "running",
    "INVALID": "not ticked",
}


def to_svg(root: TreeNode) -> str:
    """The tree as a standalone SVG document with a legend."""
    return draw(arrange(root))


def draw(placed: Placed) -> str:
    """A placed tree as a standalone SVG document with a legend."""
    legend = list(_legend())
    width = max(placed.right, 640.0) + 2 * MARGIN
    legend_rows, legend_body = _flow(legend, width - 2 * MARGIN)
    tree_height = placed.bottom
    height = tree_height + 2 * MARGIN + 24 + 26 * legend_rows
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="0 0 {width:.0f} {height:.0f}" font-family="{FONTS}" font-size="{FONT:g}">',
        '<rect class="paper" width="100%" height="100%" fill="#ffffff"/>',
        f'<g transform="translate({MARGIN:g},{MARGIN:g})" fill="none" stroke-linecap="round" stroke-linejoin="round">',
        *_group(placed, None),
        "</g>",
        f'<g class="legend" transform="translate({MARGIN:g},{MARGIN + tree_height + 24:.1f})" fill="none" '
        'stroke-linecap="round" stroke-linejoin="round">',
        f'<path d="M0,0 H{width - 2 * MARGIN:.0f}" stroke="#e3e7ec"/>',
        *legend_body,
        "</g>",
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


def _group(placed: Placed, parent: Placed | None) -> Iterator[str]:
    node = placed.node
    x, y = (placed.x, placed.y) if parent is None else (placed.x - parent.x, placed.y - parent.y)
    yield f'<g class="node" transform="translate({x:.1f},{y:.1f})">'
    if parent is not None:
        yield _edge(placed, parent, x, y)
    yield f"<g class={quoteattr('box ' + node.kind)}><title>{_text(_tooltip(node))}</title>"
    yield from _box(node, placed.width)
    yield "</g>"
    if node.message:
        yield _note(placed)
    # Later siblings first: the line to a running child lies on top of the lines to its siblings.
    for child in sorted(placed.children, key=lambda c: c.node.status == "RUNNING"):
        yield from _group(child, placed)
    yield "</g>"


def _edge(placed: Placed, parent: Placed, x: float, y: float) -> str:
    running = placed.node.status == "RUNNING"
    stroke = 'stroke="#dd8a00" stroke-width="2"' if running else 'stroke="#c3cbd5" stroke-width="1.5"'
    if placed.edge == "curve":
        start, end = parent.width / 2 - x, placed.width / 2
        top = BOX - y + (16 if parent.node.message else 0)
        middle = (top - 2) / 2
        curve = f"M{start:.1f},{top:.1f} C{start:.1f},{middle:.1f} {end:.1f},{middle:.1f} {end:.1f},-1"
        return f'<path class="edge" d="{curve}" {stroke}/>'
    if placed.edge == "bus":
        return f'<path class="edge" d="{bus(x, y)}" {stroke}/>'
    return f'<path class="edge" d="{elbow(x, y)}" {stroke}/>'


def elbow(x: float, y: float) -> str:
    """The line from the spine below a parent's box to a child at offset (x, y)."""
    return f"M{SPINE - x:.1f},{BOX - y:.1f} V{BOX / 2 - 7:.1f} q0,7 7,7 H0"


def bus(x: float, y: float) -> str:
    """The line from the spine below a parent's box along a line above a child at offset (x, y), and down to it."""
    return f"M{SPINE - x:.1f},{BOX - y:.1f} V{-BUS:g} H{SPINE - 7:g} q7,0 7,7 V0"


def _box(node: TreeNode, width: float) -> Iterator[str]:
    fill, line, ink = COLOURS[node.status]
    weight = 2.2 if node.status == "RUNNING" else 1.4
    paint = f'fill="{fill}" stroke="{line}" stroke-width="{weight}"'
    match node.kind:
        case "condition":
            yield f'<rect width="{width:.1f}" height="{BOX:g}" rx="{BOX / 2:g}" {paint}/>'
        case "decorator":
            cut = 11
            right = f"{width - cut:.1f},0 {width:.1f},{BOX / 2:g} {width - cut:.1f},{BOX:g}"
            points = f"{cut},0 {right} {cut},{BOX:g} 0,{BOX / 2:g}"
            yield f'<polygon points="{points}" {paint}/>'
        case "action":
            yield f'<rect width="{width:.1f}" height="{BOX:g}" rx="6" {paint}/>'
        case _:
            yield f'<rect width="{width:.1f}" height="{BOX:g}" rx="3" {paint}/>'
            yield f'<path d="M0,3 a3,3 0 0,1 3,-3 H{BADGE:g} V{BOX:g} H3 a3,3 0 0,1 -3,-3 Z" fill="{line}"/>'
    inset = 6.0 if node.kind in ("condition", "decorator") else 0.0
    is_composite = node.kind in ("sequence", "selector", "parallel")
    yield _symbol(
        _SYMBOLS[node.kind], inset + BADGE / 2, "#ffffff" if is_composite else line, 2.0 if is_composite else 1.6
    )
    if is_forgetful(node):
        yield _forget_mark(BADGE, 0.0, line)
    bold = ' font-weight="600"' if is_composite else ""
    name = _text(shortened(node.name, NAME_LIMIT))
    yield f'<text x="{BADGE + inset + 7:.1f}" y="{BOX / 2 + 4.6:.1f}" fill="{ink}"{bold}>{name}</text>'
    if not node.name:
        return
    mark = line if node.status == "RUNNING" else "none"
    yield (
        f'<path transform="translate({width - 14 - inset:.1f},{BOX / 2:g})" d="{_MARKS[node.status]}" '
        f'stroke="{line}" stroke-width="2" fill="{mark}"/>'
    )


def _forget_mark(x: float, y: float, colour: str) -> str:
    return (
        f'<g class="forget" transform="translate({x:g},{y:g})" stroke="{colour}">'
        f'<circle r="8" fill="#ffffff" stroke-width="1.2"/><path d="{_FORGET}" stroke-width="1.5"/></g>'
    )


def _symbol(path: str, x: float, colour: str, weight: float) -> str:
    return f'<path transform="translate({x:.1f},{BOX / 2:g})" d="{path}" stroke="{colour}" stroke-width="{weight}"/>'


def _note(placed: Placed) -> str:
    x, y = (placed.width / 2, BOX + 13) if placed.note_below else (placed.width + 12, BOX / 2 + 4)
    anchor = ' text-anchor="middle"' if placed.note_below else ""
    text = _text(shortened(placed.node.message, placed.note_limit))
    return f'<text class="note" x="{x:.1f}" y="{y:.1f}"{anchor} font-size="{NOTE:g}" fill="#66717f">{text}</text>'


def _tooltip(node: TreeNode) -> str:
    memory = ", no memory" if is_forgetful(node) else ""
    note = f"\n{node.message}" if node.message else ""
    return f"{node.name}\n{node.kind}{memory}, {_STATUS_NAMES[node.status]}{note}"


def _legend() -> Iterator[tuple[float, str]]:
    """Entries as (width, drawing at the origin)."""
    for kind, label in _NAMES.items():
        sample = TreeNode("", kind, True, "INVALID", "")
        drawing = (
            f'<g transform="scale(0.72)">{"".join(_box(sample, BADGE + 4 + (16 if kind == "decorator" else 0)))}</g>'
        )
        yield _entry(drawing, 36.0, label)
    drawing = _forget_mark(12.0, 11.0, "#66717f")
    yield _entry(drawing, 26.0, "no memory: starts over at every tick")
    for status, label in _STATUS_NAMES.items():
        fill, line, _ = COLOURS[status]
        drawing = (
            f'<rect y="2" width="26" height="18" rx="4" fill="{fill}" stroke="{line}" stroke-width="1.4"/>'
            f'<path transform="translate(13,11) scale(0.85)" d="{_MARKS[status]}" stroke="{line}" stroke-width="2"/>'
        )
        yield _entry(drawing, 32.0, label)


def _entry(drawing: str, width: float, label: str) -> tuple[float, str]:
    text = f'<text x="{width:g}" y="15" font-size="{NOTE:g}" fill="#66717f">{_text(label)}</text>'
    return width + text_width(label, NOTE), drawing + text


def _flow(entries: list[tuple[float, str]], width: float) -> tuple[int, list[str]]:
    """Entries one after another, a new line where one is full: number of lines and the drawings."""
    x, row, drawn = 0.0, 0, []
    for wide, drawing in entries:
        if x and x + wide > width:
            x, row = 0.0, row + 1
        drawn.append(f'<g transform="translate({x:.1f},{14 + 26 * row})">{drawing}</g>')
        x += wide + 22
    return row + 1, drawn


def _text(text: str) -> str:
    """Escaped for XML, control characters left out."""
    return escape("".join(c for c in text if c.isprintable() or c == "\n"))
