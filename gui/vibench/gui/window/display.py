"""Find out why no window can be shown. This module does not import Qt, which may be impossible to load."""

import ctypes
import os
import sys
from importlib.util import find_spec
from pathlib import Path

LINKED = "libglib2.0-0 libgl1 libegl1 libxkbcommon0 libdbus-1-3 libfontconfig1"
"""Debian packages that Qt needs, even without a display."""
PACKAGES = {
    "libxcb-cursor": "libxcb-cursor0",
    "libxcb-icccm": "libxcb-icccm4",
    "libxcb-image": "libxcb-image0",
    "libxcb-keysyms": "libxcb-keysyms1",
    "libxcb-render-util": "libxcb-render-util0",
    "libxcb-shape": "libxcb-shape0",
    "libxcb-util": "libxcb-util1",
    "libxcb-xkb": "libxcb-xkb1",
    "libxkbcommon-x11": "libxkbcommon-x11-0",
}
"""Debian packages needed for a window on X11, by the name of the missing library."""
ON_X11 = " ".join(sorted(PACKAGES.values()))
ELSEWHERE = "or run it without a window: QT_QPA_PLATFORM=offscreen"


def display_trouble() -> str:
    """Return in one sentence why no window can be shown, and what to do; empty if one can."""
    try:
        import PySide6.QtWidgets  # noqa: F401, PLC0415 - whether it loads is the question
    except ImportError as error:
        return f"Qt cannot be loaded ({error}); on Debian: apt-get install {LINKED}"
    # A variable, because type checkers run for another system would report the rest as unreachable.
    system: str = sys.platform
    if system != "linux" or os.environ.get("QT_QPA_PLATFORM", "xcb").partition(":")[0] != "xcb":
        return ""
    if os.environ.get("WAYLAND_DISPLAY"):
        return ""
    if not os.environ.get("DISPLAY"):
        return (
            "there is no display (neither DISPLAY nor WAYLAND_DISPLAY is set); start it on a desktop, with "
            f"'ssh -X' or under xvfb-run, {ELSEWHERE}"
        )
    return _plugin_trouble() or _server_trouble()


def _plugin_trouble() -> str:
    """Load Qt's X11 plugin to find out which library is missing; Qt reports only the failure."""
    found = find_spec("PySide6")
    folders = [] if found is None else list(found.submodule_search_locations or [])
    for plugin in (Path(folder, "Qt", "plugins", "platforms", "libqxcb.so") for folder in folders):
        if plugin.exists():
            try:
                ctypes.CDLL(str(plugin))
            except OSError as error:
                missing = next((PACKAGES[each] for each in PACKAGES if each in str(error)), "")
                named = f"{missing} is missing" if missing else str(error)
                return f"Qt cannot open a window on X11 ({named}); on Debian: apt-get install {ON_X11}"
    return ""


def _server_trouble() -> str:
    """Connect to the X server first, because Qt would end the process if it does not answer."""
    try:
        xcb = ctypes.CDLL("libxcb.so.1")
    except OSError:
        return ""
    xcb.xcb_connect.restype = ctypes.c_void_p
    xcb.xcb_connection_has_error.argtypes = xcb.xcb_disconnect.argtypes = [ctypes.c_void_p]
    connection = xcb.xcb_connect(None, None)
    failed = xcb.xcb_connection_has_error(connection)
    xcb.xcb_disconnect(connection)
    display = os.environ.get("DISPLAY")
    return f"the display {display} does not answer; check DISPLAY, {ELSEWHERE}" if failed else ""
