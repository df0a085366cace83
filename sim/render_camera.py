"""A pinhole camera in numpy: where it must stand to see everything, and where points fall in its picture."""

from dataclasses import dataclass

import numpy as np

NEAR, FAR = 0.1, 12.0
RIM = 0.03
"""Part of the picture kept free on every side."""

Window = tuple[int, int, int, int]
"""A part of a picture in pixels: left, top, width, height."""

VIEW_FROM = np.array([0.74, -0.62, 0.60])
"""Direction from the scene to the camera in the robot's base axes: in front, to its right, from above."""


@dataclass(frozen=True)
class Camera:
    """A camera at `eye` (3,) in W with axes R_WC (3,3): x right, y up, z backwards.

    `tan_half` is the tangent of half the vertical angle of view; `width` and `height` in pixels.
    """

    eye: np.ndarray
    R_WC: np.ndarray
    width: int
    height: int
    tan_half: float

    @property
    def view(self) -> np.ndarray:
        """(4,4) from W to camera axes."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.R_WC.T
        matrix[:3, 3] = -self.R_WC.T @ self.eye
        return matrix

    @property
    def projection(self) -> np.ndarray:
        """(4,4) from camera axes to OpenGL's clip space."""
        aspect = self.width / self.height
        depth = FAR - NEAR
        return np.array(
            [
                [1 / (self.tan_half * aspect), 0, 0, 0],
                [0, 1 / self.tan_half, 0, 0],
                [0, 0, -(FAR + NEAR) / depth, -2 * FAR * NEAR / depth],
                [0, 0, -1, 0],
            ]
        )

    def project(self, points_W: np.ndarray) -> np.ndarray:
        """Pixels (n,2) of points (n,3) in W, x to the right and y down; NaN for points behind the camera."""
        seen = (np.atleast_2d(points_W) - self.eye) @ self.R_WC
        distance = np.where(seen[:, 2] < -NEAR, -seen[:, 2], np.nan)
        half = self.height / 2
        x = self.width / 2 + seen[:, 0] / distance / self.tan_half * half
        y = half - seen[:, 1] / distance / self.tan_half * half
        return np.column_stack([x, y])

    def window(self, centres_W: np.ndarray, radii: np.ndarray) -> Window:
        """The part of the picture that shows balls at centres (n,3) in W with radii (n,) in metres."""
        seen = (centres_W - self.eye) @ self.R_WC
        nearest = np.maximum(-seen[:, 2] - radii, NEAR)
        reach = (radii / nearest / self.tan_half * self.height / 2)[:, None]
        pixels = self.project(centres_W)
        size = np.array([self.width, self.height])
        inside = np.isfinite(pixels).all(axis=1)
        if not inside.any():
            return 0, 0, self.width, self.height
        left, top = np.clip((pixels - reach)[inside].min(axis=0), 0, size - 16).astype(int)
        right, bottom = np.clip((pixels + reach)[inside].max(axis=0) + 1, (left + 16, top + 16), size).astype(int)
        return int(left), int(top), int(right - left), int(bottom - top)

    def projection_of(self, window: Window) -> np.ndarray:
        """(4,4) like `projection`, for a part of the picture alone."""
        left, top, width, height = window
        cut = np.eye(4)
        cut[0, 0], cut[0, 3] = self.width / width, (self.width - 2 * left - width) / width
        cut[1, 1], cut[1, 3] = self.height / height, (height - self.height + 2 * top) / height
        return cut @ self.projection

    def rays(self) -> np.ndarray:
        """Points (height * width, 3) one metre in front of the camera, one for each pixel, less the eye, in W."""
        pixel = 2 * self.tan_half / self.height
        x = (np.arange(self.width) + 0.5 - self.width / 2) * pixel
        y = (self.height / 2 - np.arange(self.height) - 0.5) * pixel
        ahead = np.column_stack(
            [np.tile(x, self.height), np.repeat(y, self.width), np.full(self.width * self.height, -1)]
        )
        return (ahead @ self.R_WC.T).astype(np.float32)

    def look_up(self, points_W: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """For points (n,3) in W: flat index (n,) of the pixel that shows each, and the distance (n,) in metres ahead.

        Points beside the picture get distance −1.
        """
        seen = (points_W - self.eye.astype(np.float32)) @ self.R_WC.astype(np.float32)
        distance = -seen[:, 2]
        scale = self.height / 2 / self.tan_half / distance
        column = (self.width / 2 + seen[:, 0] * scale).astype(np.int32)
        row = (self.height / 2 - seen[:, 1] * scale).astype(np.int32)
        inside = (column >= 0) & (column < self.width) & (row >= 0) & (row < self.height)
        return np.where(inside, row * self.width + column, 0), np.where(inside, distance, np.float32(-1))

    @staticmethod
    def seeing(
        points_W: np.ndarray,
        towards: np.ndarray,
        width: int,
        height: int,
        foot: float = 0.0,
        tan_half: float = 0.34,
    ) -> "Camera":
        """The nearest camera that looks along `-towards` (3,) and has all points (n,3) in its picture.

        `foot` is the part of the picture's height kept free at the bottom.
        """
        back = towards / np.linalg.norm(towards)
        right = np.cross([0.0, 0.0, 1.0], back)
        right /= np.linalg.norm(right)
        R_WC = np.column_stack([right, np.cross(back, right), back])
        side = tan_half * width / height * (1 - 2 * RIM)
        above, below = tan_half * (1 - 2 * RIM), tan_half * (1 - 2 * foot - 2 * RIM)
        x, y, z = (points_W @ R_WC).T
        # Each side of the picture is a half-space for the eye; the eye stands where they meet.
        to_right, to_left = (x + side * z).max(), (side * z - x).max()
        to_top, to_bottom = (y + above * z).max(), (below * z - y).max()
        distance = max((to_right + to_left) / (2 * side), (to_top + to_bottom) / (above + below))
        up = ((to_top - above * distance) + (below * distance - to_bottom)) / 2
        eye = R_WC @ np.array([(to_right - to_left) / 2, up, distance])
        return Camera(eye, R_WC, width, height, tan_half)


def distances(depth: np.ndarray) -> np.ndarray:
    """Metres ahead of the camera from OpenGL's depth values (0 at NEAR, 1 at FAR)."""
    return np.float32(FAR * NEAR) / (np.float32(FAR) - depth * np.float32(FAR - NEAR))
