"""Pictures of a scene without a window: recorded states go in, pixels come out.

Nothing is simulated: bodies and joints are put where they were recorded. Shadows are ours, from
depth pictures taken from the light, so that both engines give the same.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import TracebackType

import numpy as np
from PIL import Image, ImageChops, ImageFilter

from scenarios.scenario import Scenario
from scenarios.shapes import Box, bounding_radius, extents, middle
from sim.render_camera import VIEW_FROM, Camera, Window
from sim.render_egl import egl_is_faster
from sim.render_stage import LIGHT_FROM, LINK_REACH, ArmOnStage, Engine, Stage, add_room

WIDTH, HEIGHT = 1280, 720
ARM_HEIGHT = 0.85
"""Metres above the base up to which the camera shows the arm."""

LIGHT_SIZE = 560
OUT_OF_SIGHT = np.array([0.0, 0.0, -100.0, 0.0, 0.0, 0.0, 1.0])
"""Pose of a body that isn't there."""

BIAS = np.float32(0.012)
"""Metres by which something must be nearer to the light than a point in order to shade it."""

SHADE = 72
"""How much of 255 a shadow takes away."""


@dataclass(frozen=True)
class Backdrop:
    """What never moves: `colours` (height, width, 3) uint8, `distance` (height, width) in metres ahead of
    `camera`, and `from_light` (LIGHT_SIZE²,) in metres ahead of the light."""

    camera: Camera
    light: Camera
    colours: np.ndarray
    distance: np.ndarray
    from_light: np.ndarray

    @staticmethod
    def of(scenario: Scenario, width: int = WIDTH, height: int = HEIGHT, foot: float = 0.0) -> "Backdrop":
        """Render a scene's room at twice the size. `foot`: part of the height kept free at the bottom."""
        return Backdrop.seen(scenario, overview(scenario, width, height, foot), overlook(scenario))

    @staticmethod
    def seen(scenario: Scenario, camera: Camera, light: Camera) -> "Backdrop":
        """The same as `camera` sees it, and the light."""
        width, height = camera.width, camera.height
        with Stage("tiny") as room:
            add_room(room, scenario)
            fine = room.look(twice(camera))[0].astype(np.uint16).reshape(height, 2, width, 2, 3)
            colours = (fine[:, 0, :, 0] + fine[:, 0, :, 1] + fine[:, 1, :, 0] + fine[:, 1, :, 1]) // 4
            distance = room.look(camera)[1]
            return Backdrop(camera, light, colours.astype(np.uint8), distance, room.look(light)[1].ravel())


class Renderer:
    """Renders one scene. `engine` is "egl" (the graphics library) or "tiny" (plain software).

    A picture costs the robot and the bodies only, as the backdrop is given. A context manager;
    `close` frees the engine.
    """

    def __init__(self, scenario: Scenario, backdrop: Backdrop | None = None, engine: Engine | None = None) -> None:
        """`engine` None: EGL where it is faster."""
        self.engine: Engine = engine or ("egl" if egl_is_faster() else "tiny")
        self._ground = backdrop or Backdrop.of(scenario)
        self.camera, self._light = self._ground.camera, self._ground.light
        self._rays = self.camera.rays()
        points = self._rays * self._ground.distance.reshape(-1, 1) + self.camera.eye.astype(np.float32)
        self._ground_index, self._ground_lit = self._light.look_up(points)
        self._stage = Stage(self.engine)
        self._bodies = {
            name: self._stage.add(body.shape, body.X_WO, body.color) for name, body in scenario.bodies.items()
        }
        self._radii = {name: bounding_radius(body.shape) for name, body in scenario.bodies.items()}
        self._robot = ArmOnStage(self._stage, scenario)

    def __enter__(self) -> "Renderer":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the engine. The renderer can't be used afterwards."""
        self._stage.close()

    def picture(
        self, q: np.ndarray, opening: float, poses: Mapping[str, np.ndarray], window: Window | None = None
    ) -> np.ndarray:
        """Pixels (height, width, 3) uint8 of a state: q (7,) rad, opening in m, poses (7,) as position and
        quaternion xyzw in W by body; bodies left out aren't there. `window`: where something that moves may
        be seen (None: found out)."""
        self._robot.put(q, opening)
        for name, body in self._bodies.items():
            self._stage.put(body, poses.get(name, OUT_OF_SIGHT))
        left, top, width, height = window = window or self.window(q, opening, poses)
        here = np.s_[top : top + height, left : left + width]
        front, distance = self._stage.look(self.camera, window)
        is_front = distance < self._ground.distance[here]
        picture = self._ground.colours.copy()
        picture[here][is_front] = front[is_front]
        rows, columns = np.nonzero(is_front)
        shown = (rows + top) * self.camera.width + columns + left
        return shaded(picture, self._shadow(shown, distance[is_front]))

    def window(self, q: np.ndarray, opening: float, poses: Mapping[str, np.ndarray]) -> Window:
        """The part of the picture that shows the arm and the bodies."""
        links = self._robot.places(q, opening)
        centres = np.vstack([links, *(pose[:3] for pose in poses.values())])
        radii = [LINK_REACH] * len(links) + [self._radii[name] for name in poses]
        return self.camera.window(centres, np.array(radii))

    def _shadow(self, shown: np.ndarray, distance: np.ndarray) -> np.ndarray:
        """Which pixels (height, width) lie behind something, as the light sees it? Pixels `shown` (n,) show
        something that moves, at `distance` (n,) in metres ahead of the camera."""
        from_light = np.minimum(self._ground.from_light, self._stage.look(self._light)[1].ravel())
        shadow = from_light[self._ground_index] < self._ground_lit - BIAS
        points = self._rays[shown] * distance[:, None] + self.camera.eye.astype(np.float32)
        index, away = self._light.look_up(points)
        shadow[shown] = from_light[index] < away - BIAS
        return shadow.reshape(self.camera.height, self.camera.width)


def shaded(picture: np.ndarray, shadow: np.ndarray) -> np.ndarray:
    """The picture darkened where `shadow` (height, width) says so, with soft rims."""
    keep = Image.fromarray(255 - shadow.astype(np.uint8) * SHADE).filter(ImageFilter.BoxBlur(2))
    return np.asarray(ImageChops.multiply(Image.fromarray(picture), Image.merge("RGB", (keep, keep, keep))))


def overview(scenario: Scenario, width: int, height: int, foot: float = 0.0) -> Camera:
    """The camera that sees arm, table, containers and everything that lies about."""
    base = scenario.robot.X_WB
    points = [base.act(np.array([0.0, 0.0, z])) for z in (0.0, ARM_HEIGHT)]
    solids = [(scenario.table.shape, scenario.table.X_WT)]
    solids += [(Box(region.size), region.X_WR) for region in scenario.regions.values()]
    solids += [(body.shape, body.X_WO) for body in scenario.bodies.values() if body.name not in scenario.late]
    solids += [(fixture.shape, fixture.X_WO) for fixture in scenario.fixtures.values()]
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    for shape, X_WO in solids:
        points += [X_WO.act(corner) for corner in corners * extents(shape) + middle(shape)]
    return Camera.seeing(np.array(points), base.rotation @ VIEW_FROM, width, height, foot)


def overlook(scenario: Scenario) -> Camera:
    """The light as a camera: far above, seeing everything that can cast a shadow."""
    base = scenario.robot.X_WB.translation
    reach = np.array([[x, y, z] for x in (-0.6, 1.1) for y in (-1.0, 1.0) for z in (-0.2, ARM_HEIGHT)])
    return Camera.seeing(base + reach, LIGHT_FROM, LIGHT_SIZE, LIGHT_SIZE, tan_half=0.16)


def twice(camera: Camera) -> Camera:
    """The same view with twice as many pixels each way."""
    return replace(camera, width=2 * camera.width, height=2 * camera.height)
