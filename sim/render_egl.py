"""Is there a graphics card for PyBullet's EGL renderer? Run as a script, this file answers.

Where no device can be opened the plugin ends its process, so it is tried in another one first. EGL
computed by the processor is no gain: `render.py` needs less with PyBullet's own software renderer.
"""

import importlib.util
import subprocess
import sys
from functools import cache

import numpy as np
import pybullet as p

PROBE_SECONDS = 30.0
SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software rasterizer")
"""Names by which Mesa's renderers without a graphics card go."""


@cache
def egl_is_faster() -> bool:
    """Does EGL give right pictures here, by a graphics card? About a second the first time."""
    try:
        probe = subprocess.run(
            [sys.executable, __file__], capture_output=True, text=True, timeout=PROBE_SECONDS, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return probe.returncode == 0 and not any(name in probe.stdout.lower() for name in SOFTWARE)


def load_egl(client: int) -> bool:
    """Load the plugin into a client; did that work?"""
    plugin = importlib.util.find_spec("eglRenderer")
    if plugin is None or plugin.origin is None:
        return False
    return p.loadPlugin(plugin.origin, "_eglRendererPlugin", physicsClientId=client) >= 0


def _red_in_the_middle() -> bool:
    """Render a red box with EGL and look at the middle of the picture."""
    client = p.connect(p.DIRECT)
    if not load_egl(client):
        return False
    red = p.createVisualShape(p.GEOM_BOX, halfExtents=[0.2] * 3, rgbaColor=[1, 0, 0, 1], physicsClientId=client)
    p.createMultiBody(0, -1, red, physicsClientId=client)
    view = p.computeViewMatrix([1, 0, 0], [0, 0, 0], [0, 0, 1])
    projection = p.computeProjectionMatrixFOV(40, 1, 0.1, 5)
    picture = p.getCameraImage(64, 64, view, projection, renderer=p.ER_BULLET_HARDWARE_OPENGL, physicsClientId=client)[
        2
    ]
    r, g, b = (int(value) for value in np.reshape(picture, (64, 64, 4))[32, 32, :3])
    return r > 2 * g + 20 and r > 2 * b + 20


if __name__ == "__main__":
    sys.exit(0 if _red_in_the_middle() else 1)
