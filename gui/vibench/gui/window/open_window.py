"""From nothing to a window on the screen, and from its end to the end of the process."""

import ctypes
import gc
import os
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from threading import Thread

import matplotlib as mpl
from PySide6.QtCore import QCoreApplication, Qt, QTimer
from PySide6.QtGui import QFont, QFontDatabase
from PySide6.QtWidgets import QApplication, QLabel, QStyleFactory

from ..page.app_context import AppContext, Remembered, Settings, default_settings_path
from .window import PAGES, Window

FONT_FILES = ("DejaVuSans.ttf", "DejaVuSans-Bold.ttf", "DejaVuSansMono.ttf")
FONT_POINTS = 10
SMALLEST_POINTS, LARGEST_POINTS = 7, 24


def application(arguments: list[str]) -> QApplication:
    """Make the one application of this process: Fusion, and the same font on every machine."""
    existing = QCoreApplication.instance()
    if existing is None:
        QApplication.setHighDpiScaleFactorRoundingPolicy(Qt.HighDpiScaleFactorRoundingPolicy.PassThrough)
        existing = QApplication(arguments)
    assert isinstance(existing, QApplication)
    existing.setApplicationName("vibench")
    existing.setStyle(QStyleFactory.create("Fusion"))
    existing.setFont(_font())
    return existing


def _font() -> QFont:
    """DejaVu Sans, which has every sign that we write; matplotlib brings its file along."""
    folder = Path(mpl.get_data_path()) / "fonts" / "ttf"
    for name in FONT_FILES:
        QFontDatabase.addApplicationFont(str(folder / name))
    return QFont("DejaVu Sans", FONT_POINTS)


def open_window(bench: Path | None, settings: Path | None, starting: QLabel | None = None) -> int:
    """Show the window, in place of what says that it is starting, until it is closed; gives the exit code."""
    app = application(["vibench"])
    kept = Settings(settings or default_settings_path())
    context = AppContext(kept)
    context.first_bench = None if bench is None else bench.resolve()
    font = app.font()
    font.setPointSize(int(kept.number(Remembered.FONT, FONT_POINTS, SMALLEST_POINTS, LARGEST_POINTS)))
    app.setFont(font)
    window = Window(context, PAGES)
    # None of all this ever is garbage: a collector that looked through it would hold the window up.
    gc.freeze()
    window.show()
    if starting is not None:
        starting.close()
    QTimer.singleShot(0, window.context.background.prepare)
    QTimer.singleShot(0, window.look_for_left_campaign)
    QTimer.singleShot(0, Thread(target=load_ahead).start)
    return app.exec()


def load_ahead() -> None:
    """Load what the first prediction and the first curves are made of; the window has been painted by now."""
    import_module("scipy.signal")
    getattr(import_module("vibench.analysis"), "MeasurementPrediction")  # noqa: B009


LINKED = "libglib2.0-0 libgl1 libegl1 libxkbcommon0 libdbus-1-3 libfontconfig1"
"""Debian's packages that Qt is linked to, without a display too."""
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
"""Debian's packages for a window of the X window system, by the library that is missed first."""
ON_X11 = " ".join(sorted(PACKAGES.values()))
ELSEWHERE = "or run it without a window: QT_QPA_PLATFORM=offscreen"


def display_trouble() -> str:
    """Say in one sentence why no window can be shown here, and what to do; empty where it can."""
    try:
        import PySide6.QtWidgets  # noqa: F401, PLC0415 - whether it loads is the question
    except ImportError as error:
        return f"Qt cannot be loaded ({error}); on Debian: apt-get install {LINKED}"
    # As a variable: a checker of types for another system would find the rest unreachable.
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
    """Load Qt's plugin for X11 as Qt will; it knows only that it failed, the loader knows of what."""
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
    """Ask the X server itself: Qt would end the process where it does not answer."""
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
    return f"the display {display} does not answer; look at DISPLAY, {ELSEWHERE}" if failed else ""
