"""What is drawn over a rendered picture: forces as arrows, set-points as dots, words on a strip."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from bt_tamp.report.timeline import Caption
from sim.render_camera import Camera

STRIP = 92
"""Height in pixels of the strip with the words, at the bottom of a picture 720 high."""

METRES_PER_NEWTON = 0.011
LONGEST = 0.32
FINE = 2
"""Arrows and dots are drawn this many times larger and then reduced, for smooth rims."""

ROOM = 24
"""Pixels around arrows and dots that their rims may take."""

_GREEN, _GREEN_RIM = (32, 178, 74, 255), (10, 84, 34, 255)
_BLUE, _PALE = (30, 96, 235, 255), (150, 186, 250, 255)
_INK, _WHITE, _QUIET, _AMBER = (22, 27, 34, 255), (250, 250, 250, 255), (166, 176, 190, 255), (255, 190, 92, 255)


@dataclass(frozen=True)
class Arrow:
    """A force (3,) in N at a point (3,) in W."""

    point: np.ndarray
    force: np.ndarray


@dataclass(frozen=True)
class Path3:
    """Set-points (n,3) in W of one spell of contact; the first `done` of them have been passed."""

    points: np.ndarray
    done: int


@dataclass(frozen=True)
class Words:
    """What the strip says. t in simulated seconds, force in N (None: nothing is touched), speed as a factor."""

    caption: Caption
    t: float
    force: float | None
    speed: float
    told: tuple[str, ...] = ()


def draw(
    picture: np.ndarray, camera: Camera, arrows: Sequence[Arrow], path: Path3 | None, words: Words | None
) -> np.ndarray:
    """The picture (height, width, 3) uint8 with everything drawn over it."""
    image = Image.fromarray(picture).convert("RGBA")
    if arrows or path is not None:
        _draw_marks(image, camera, arrows, path)
    if words is not None:
        strip = Image.new("RGBA", image.size)
        pen = ImageDraw.Draw(strip)
        _draw_strip(pen, image.width, image.height, words)
        if words.told:
            _draw_told(pen, words.told, image.width)
        image.alpha_composite(strip)
    return np.asarray(image.convert("RGB"))


def _draw_marks(image: Image.Image, camera: Camera, arrows: Sequence[Arrow], path: Path3 | None) -> None:
    marks = [camera.project(np.vstack([a.point, a.point + METRES_PER_NEWTON * a.force])) for a in arrows]
    spots = camera.project(path.points) if path is not None else np.empty((0, 2))
    covered = np.vstack([*marks, spots])
    covered = covered[np.isfinite(covered).all(axis=1)]
    if not len(covered):
        return
    left, top = np.clip(covered.min(axis=0) - ROOM, 0, image.size).astype(int)
    right, bottom = np.clip(covered.max(axis=0) + ROOM, 0, image.size).astype(int)
    if right <= left or bottom <= top:
        return
    corner = np.array([left, top])
    fine = Image.new("RGBA", (int(right - left) * FINE, int(bottom - top) * FINE))
    pen = ImageDraw.Draw(fine)
    for place, (x, y) in enumerate((spots - corner) * FINE):
        if path is not None and np.isfinite(x):
            radius = 3.2 * FINE
            colour = _BLUE if place < path.done else _PALE
            pen.ellipse((x - radius, y - radius, x + radius, y + radius), fill=colour, outline=_WHITE, width=1)
    for arrow in arrows:
        _draw_arrow(pen, camera, arrow, corner)
    image.alpha_composite(fine.reduce(FINE), (int(left), int(top)))


def _draw_arrow(pen: ImageDraw.ImageDraw, camera: Camera, arrow: Arrow, corner: np.ndarray) -> None:
    size = float(np.linalg.norm(arrow.force))
    length = min(size * METRES_PER_NEWTON, LONGEST)
    ends = camera.project(np.vstack([arrow.point, arrow.point + arrow.force / size * length]))
    tail, tip = (ends - corner) * FINE
    along = tip - tail
    seen = float(np.linalg.norm(along))
    if not np.isfinite(seen) or seen < 4 * FINE:
        return
    along = along / seen
    across = np.array([-along[1], along[0]])
    head = min(15.0 * FINE, 0.6 * seen)
    neck = tip - along * head
    for wider, colour in ((1.6 * FINE, _GREEN_RIM), (0.0, _GREEN)):
        shaft, side = 3.0 * FINE + wider, 8.5 * FINE + wider
        end, point = tail - along * wider, tip + along * wider * 1.7
        base = neck - along * wider
        outline = [
            end + across * shaft,
            base + across * shaft,
            base + across * side,
            point,
            base - across * side,
            base - across * shaft,
            end - across * shaft,
        ]
        pen.polygon([(float(x), float(y)) for x, y in outline], fill=colour)


def _draw_strip(pen: ImageDraw.ImageDraw, width: int, height: int, words: Words) -> None:
    top = height - STRIP
    pen.rectangle((0, top, width, height), fill=(20, 25, 33, 255))
    caption = words.caption
    pen.text((32, top + 14), caption.action, font=_font(27, bold=True), fill=_WHITE)
    step = f"{caption.step} of {caption.steps}" if caption.step else ""
    left = 32.0
    if step:
        pen.text((left, top + 56), step, font=_font(19), fill=_QUIET)
        left += pen.textlength(step, font=_font(19)) + 18
    pen.text((left, top + 56), caption.phase, font=_font(19), fill=_AMBER)
    right = width - 32
    pen.text((right, top + 15), f"{words.t:.1f} s", font=_font(25), fill=_WHITE, anchor="ra")
    pen.text((right, top + 56), f"×{words.speed:g}", font=_font(19), fill=_QUIET, anchor="ra")
    x = right - 150
    pen.text((x, top + 56), "contact force", font=_font(19), fill=_QUIET, anchor="ra")
    shown = "–" if words.force is None else f"{words.force:.1f} N"
    pen.text(
        (x, top + 15), shown, font=_font(25), fill=_QUIET if words.force is None else (94, 222, 132, 255), anchor="ra"
    )


def _draw_told(pen: ImageDraw.ImageDraw, told: Sequence[str], width: int) -> None:
    font, room = _font(20), width * 0.38
    lines = [line for words in told for line in _wrapped(pen, words, font, room)]
    widest = max(pen.textlength(line, font=font) for line in lines)
    box = (26, 24, 26 + widest + 44, 24 + 30 * len(lines) + 24)
    pen.rounded_rectangle(box, 10, fill=(255, 255, 255, 236), outline=(196, 203, 212, 255))
    pen.rounded_rectangle((26, 24, 33, box[3]), 3, fill=(221, 138, 0, 255))
    for place, line in enumerate(lines):
        pen.text((50, 34 + 30 * place), line, font=font, fill=_INK)


def _wrapped(pen: ImageDraw.ImageDraw, words: str, font: ImageFont.FreeTypeFont, room: float) -> list[str]:
    lines = [""]
    for word in words.split():
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and pen.textlength(longer, font=font) > room:
            lines.append("    " + word)
        else:
            lines[-1] = longer if not lines[-1].startswith("    ") else f"{lines[-1]} {word}"
    return lines


@cache
def _font(size: int, bold: bool = False) -> ImageFont.FreeTypeFont:
    """DejaVu Sans as it comes with matplotlib, which is not imported for it."""
    package = find_spec("matplotlib")
    if package is None or not package.submodule_search_locations:
        raise ModuleNotFoundError("matplotlib is not installed; its fonts are needed for captions")
    folder = Path(package.submodule_search_locations[0]) / "mpl-data" / "fonts" / "ttf"
    return ImageFont.truetype(folder / ("DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"), size)
