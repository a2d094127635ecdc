"""The commands `vibench-gui` and `python -m vibench.gui`, which open the window.

Qt is imported inside `main`, because spawned worker processes import this module too.
"""

import argparse
import ctypes
import os
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from vibench.acquisition import ConfigurationError, printable
from vibench.acquisition.rig import load_rig

if TYPE_CHECKING:
    from PySide6.QtWidgets import QLabel

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
"""Debian packages needed for a window on X11, keyed by the name of the missing library."""
ON_X11 = " ".join(sorted(PACKAGES.values()))
ELSEWHERE = "or run without a window: QT_QPA_PLATFORM=offscreen"


def display_trouble() -> str:
    """Return why Qt cannot show a window, and what the user can do; empty if Qt can show a window."""
    try:
        import PySide6.QtWidgets  # noqa: F401, PLC0415 - tests whether Qt can be loaded
    except ImportError as error:
        return f"Qt cannot be loaded ({error}); on Debian: apt-get install {LINKED}"
    # Use a variable: otherwise type checkers on other systems report unreachable code below.
    system: str = sys.platform
    if system != "linux" or os.environ.get("QT_QPA_PLATFORM", "xcb").partition(":")[0] != "xcb":
        return ""
    if os.environ.get("WAYLAND_DISPLAY"):
        return ""
    if not os.environ.get("DISPLAY"):
        return (
            "there is no display (neither DISPLAY nor WAYLAND_DISPLAY is set); start the window on a "
            f"desktop, with 'ssh -X' or under xvfb-run, {ELSEWHERE}"
        )
    return _plugin_trouble() or _server_trouble()


def _plugin_trouble() -> str:
    """Load Qt's X11 plugin only to learn which library is missing; Qt itself does not name the library."""
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
    """Connect to the X server before Qt does, because Qt ends the process if the server does not answer."""
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


NO_WINDOW = 1
"""Exit code when no window can be shown."""


def main(arguments: list[str] | None = None) -> int:
    """Open the window, wait until the user closes it, and return the exit code."""
    parser = argparse.ArgumentParser(prog="vibench gui", description="The window of vibench.")
    parser.add_argument(
        "--bench", type=Path, metavar="BENCH.toml", help="hardware configuration to begin with"
    )
    parser.add_argument(
        "--settings", type=Path, metavar="FILE.ini", help="settings file; by default the user's own"
    )
    parser.add_argument(
        "--screenshots", type=Path, metavar="DIR", help="save a picture of every page in DIR, and exit"
    )
    options = parser.parse_args(arguments)
    # Make pyqtgraph use PySide6 too. Use one thread for linear algebra, because the matrices are small.
    os.environ.setdefault("PYQTGRAPH_QT_LIB", "PySide6")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    trouble = display_trouble()
    if trouble:
        sys.stderr.write(f"The window cannot be opened: {trouble}.\n")
        return NO_WINDOW
    if options.bench is not None:
        try:
            load_rig(options.bench)
        except ConfigurationError as error:
            sys.stderr.write(f"error: {printable(str(error))}\n")
            return NO_WINDOW
    starting = _sign_of_life()
    from .window.window import open_window  # noqa: PLC0415

    if options.screenshots is not None:
        from .window.screenshots import make_screenshots  # noqa: PLC0415

        return make_screenshots(options.bench, options.screenshots)
    return open_window(options.bench, options.settings, starting)


def _sign_of_life() -> "QLabel":
    """Show a "starting" label at once and return it, because loading the window can take seconds."""
    from PySide6.QtCore import Qt  # noqa: PLC0415
    from PySide6.QtWidgets import QApplication, QLabel  # noqa: PLC0415

    QApplication.setHighDpiScaleFactorRoundingPolicy(Qt.HighDpiScaleFactorRoundingPolicy.PassThrough)
    application = QApplication.instance() or QApplication(["vibench"])
    label = QLabel("vibench is starting…", None, Qt.WindowType.SplashScreen)
    label.setWindowTitle("vibench")
    label.setMargin(2 * label.fontMetrics().height())
    label.show()
    application.processEvents()
    return label


if __name__ == "__main__":
    sys.exit(main())
