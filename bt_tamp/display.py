"""Is there a display to open a window on?"""

import ctypes
import os


def has_display() -> bool:
    """Can the X server that DISPLAY names be reached?

    Asked before PyBullet opens its window, because it ends the whole process when it can't.
    """
    if not os.environ.get("DISPLAY"):
        return False
    try:
        x11 = ctypes.CDLL("libX11.so.6")
    except OSError:
        return False
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XOpenDisplay.argtypes = [ctypes.c_char_p]
    x11.XCloseDisplay.argtypes = [ctypes.c_void_p]
    display = x11.XOpenDisplay(None)
    if not display:
        return False
    x11.XCloseDisplay(display)
    return True
