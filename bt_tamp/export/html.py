"""A tree as one page: the SVG with zoom, pan, and subtrees that fold away. It asks for nothing from outside."""

from html import escape

from bt_tamp.export.snapshot import TreeNode
from bt_tamp.export.svg import to_svg

_STYLE = """
html, body { margin: 0; height: 100%; overflow: hidden; background: #fff; font: 14px sans-serif; color: #3d4753; }
#view { width: 100%; height: 100%; cursor: grab; touch-action: none; }
#view.held { cursor: grabbing; }
#view > svg { transform-origin: 0 0; overflow: visible; display: block; }
.node > .box.folds { cursor: pointer; }
.node.folded > .node { display: none; }
.node.folded > .box { stroke-dasharray: 5 3; }
#hints { position: fixed; right: 14px; top: 12px; display: flex; gap: 8px; align-items: center; }
#hints button { font: inherit; padding: 4px 10px; border: 1px solid #c3cbd5; border-radius: 6px; background: #fff; }
"""

_SCRIPT = """
const view = document.getElementById('view'), svg = view.querySelector('svg');
let x = 0, y = 0, scale = 1, from = null, moved = false;
const show = () => { svg.style.transform = `translate(${x}px, ${y}px) scale(${scale})`; };
const fit = () => {
  const wide = svg.width.baseVal.value, high = svg.height.baseVal.value;
  scale = Math.min(1, view.clientWidth / wide);
  if (high * scale < 1.6 * view.clientHeight) scale = Math.min(scale, view.clientHeight / high);
  x = Math.max(0, (view.clientWidth - wide * scale) / 2); y = 0;
  show();
};
view.addEventListener('wheel', event => {
  event.preventDefault();
  const factor = Math.exp(-event.deltaY * 0.0015), next = Math.min(6, Math.max(0.08, scale * factor));
  x = event.clientX - (event.clientX - x) * next / scale;
  y = event.clientY - (event.clientY - y) * next / scale;
  scale = next;
  show();
}, { passive: false });
view.addEventListener('pointerdown', event => {
  from = [event.clientX - x, event.clientY - y, event.clientX, event.clientY]; moved = false;
});
window.addEventListener('pointermove', event => {
  if (!from) return;
  moved = moved || Math.hypot(event.clientX - from[2], event.clientY - from[3]) > 4;
  if (moved) { view.classList.add('held'); x = event.clientX - from[0]; y = event.clientY - from[1]; show(); }
});
window.addEventListener('pointerup', () => { from = null; view.classList.remove('held'); });
const inner = [...document.querySelectorAll('.node')].filter(node => node.querySelector(':scope > .node'));
for (const node of inner) {
  const box = node.querySelector(':scope > .box');
  box.classList.add('folds');
  box.addEventListener('click', () => { if (!moved) node.classList.toggle('folded'); });
}
document.getElementById('fit').onclick = fit;
document.getElementById('open').onclick = () => inner.forEach(node => node.classList.remove('folded'));
fit();
"""


def to_html(root: TreeNode) -> str:
    """The tree as a self-contained page."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f"<title>{escape(root.name)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n"
        f'<div id="view">{to_svg(root)}</div>\n'
        '<div id="hints"><span>wheel zooms, dragging moves, a click folds</span>'
        '<button id="open">unfold all</button><button id="fit">fit</button></div>\n'
        f"<script>{_SCRIPT}</script>\n</body>\n</html>\n"
    )
