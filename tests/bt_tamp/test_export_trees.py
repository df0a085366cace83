import re
import xml.etree.ElementTree as ET
from itertools import combinations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bt_tamp.export.dot import quoted, to_dot
from bt_tamp.export.html import to_html
from bt_tamp.export.layout import BOX, COLUMNS_WIDTH, MAX_HEIGHT, Placed, arrange, outline, top_down
from bt_tamp.export.snapshot import TreeNode
from bt_tamp.export.svg import COLOURS, to_svg

SVG = "{http://www.w3.org/2000/svg}"


def leaf(name: str, status: str = "INVALID", message: str = "") -> TreeNode:
    return TreeNode(name, "condition" if name.endswith("?") else "action", False, status, message)


def composite(name: str, *children: TreeNode, kind: str = "sequence", memory: bool = True) -> TreeNode:
    return TreeNode(name, kind, memory, "RUNNING", "", children)


def long_plan(actions: int) -> TreeNode:
    acts = [composite(f"pick(thing{i}, table)", *(leaf(f"phase {k}") for k in range(8))) for i in range(actions)]
    return composite("mission", leaf("goal reached?"), composite("act", *acts), kind="selector", memory=False)


def walk(placed: Placed):
    yield placed
    for child in placed.children:
        yield from walk(child)


def overlap(a: Placed, b: Placed) -> bool:
    return a.x < b.x + b.width and b.x < a.x + a.width and a.y < b.y + BOX and b.y < a.y + BOX


names = st.text(min_size=1, max_size=12)
statuses = st.sampled_from(["SUCCESS", "FAILURE", "RUNNING", "INVALID"])
leaves = st.builds(leaf, names, statuses, st.sampled_from(["", "waiting", 'a <b> & "c"']))
trees = st.recursive(
    leaves, lambda below: st.builds(lambda n, c: composite(n, *c), names, st.lists(below, max_size=4)), max_leaves=14
)


@settings(derandomize=True, max_examples=60, deadline=None)
@given(trees)
def test_no_two_boxes_lie_on_each_other(tree):
    spread = max(tree.walk(), key=lambda node: len(node.children))
    for drawing in (top_down(tree), outline(tree), outline(tree, spread if spread.children else None)):
        assert not [pair for pair in combinations(walk(drawing), 2) if overlap(*pair)]


@settings(derandomize=True, max_examples=60, deadline=None)
@given(trees)
def test_any_name_gives_a_picture_that_parses(tree):
    drawn = ET.fromstring(to_svg(tree))
    assert len(list(drawn.iter(f"{SVG}title"))) == len(list(tree.walk()))


def test_a_small_tree_stands_below_its_root():
    drawing = arrange(composite("root", leaf("a"), leaf("b")))
    assert [child.edge for child in drawing.children] == ["curve", "curve"]
    assert drawing.children[0].y == drawing.children[1].y > drawing.y


def test_a_long_plan_is_laid_out_in_columns_rather_than_a_mile_long():
    tree = long_plan(9)
    drawing = arrange(tree)
    assert outline(tree).bottom > MAX_HEIGHT
    assert drawing.bottom < outline(tree).bottom / 2
    assert drawing.right <= COLUMNS_WIDTH


def test_each_composite_without_memory_is_marked_and_no_other():
    tree = composite("root", composite("kept", leaf("a")), composite("fresh", leaf("b"), memory=False))
    marks = re.findall('class="forget"', to_svg(tree))
    assert len(marks) == 2  # the node and the legend


@pytest.mark.parametrize("status", list(COLOURS))
def test_a_box_has_the_colour_of_its_status(status):
    drawn = ET.fromstring(to_svg(leaf("a", status)))
    box = next(group for group in drawn.iter(f"{SVG}g") if (group.get("class") or "").startswith("box"))
    assert box.find(f"{SVG}rect").get("fill") == COLOURS[status][0]


def test_the_message_of_a_node_is_shown():
    assert "lost the &lt;sponge&gt;" in to_svg(composite("root", leaf("a", "FAILURE", "lost the <sponge>")))


def test_the_page_asks_for_nothing_from_outside():
    page = to_html(long_plan(3)).replace('xmlns="http://www.w3.org/2000/svg"', "")
    assert not re.search(r"https?:|//\w+\.|src=|href=|@import|url\(", page)


def test_a_name_cannot_break_out_of_the_page():
    page = to_html(leaf("</script><script>alert(1)</script>"))
    assert page.count("<script>") == 1


def test_dot_escapes_quotes_backslashes_and_line_breaks():
    assert quoted('a "b" \\ c\nd\x00') == '"a \\"b\\" \\\\ c\\nd"'


def test_dot_has_a_line_for_every_node_and_every_edge():
    tree = long_plan(2)
    text = to_dot(tree)
    count = len(list(tree.walk()))
    assert len(re.findall(r"^  n[_\d]* \[", text, re.M)) == count
    assert len(re.findall(r"^  n[_\d]* -> n[_\d]*;$", text, re.M)) == count - 1


def test_dot_marks_what_keeps_no_memory():
    assert '"→ fresh *"' in to_dot(composite("fresh", leaf("a"), memory=False))
