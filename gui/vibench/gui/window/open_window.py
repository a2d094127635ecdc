"""Creates the application and the window, and explains why no window can be shown."""

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

from vibench.acquisition import printable

from ..page.app_context import AppContext, SettingKey, Settings, default_settings_path
from .window import PAGES, Window

FONT_FILES = ("DejaVuSans.ttf", "DejaVuSans-Bold.ttf", "DejaVuSansMono.ttf")
FONT_POINTS = 10
SMALLEST_POINTS, LARGEST_POINTS = 7, 24


def application(arguments: list[str]) -> QApplication:
    """Return the application, with the same style and font on every machine."""
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
    """Return DejaVu Sans, which has all characters used and is installed with matplotlib."""
    folder = Path(mpl.get_data_path()) / "fonts" / "ttf"
    for name in FONT_FILES:
        QFontDatabase.addApplicationFont(str(folder / name))
    return QFont("DejaVu Sans", FONT_POINTS)


def open_window(bench: Path | None, settings: Path | None, starting: QLabel | None = None) -> int:
    """Show the window until it is closed and return the exit code; ``starting`` is the label to close."""
    app = application(["vibench"])
    stored = Settings(settings or default_settings_path())
    context = AppContext(stored)
    context.first_bench = None if bench is None else bench.resolve()
    font = app.font()
    font.setPointSize(int(stored.number(SettingKey.FONT, FONT_POINTS, SMALLEST_POINTS, LARGEST_POINTS)))
    app.setFont(font)
    window = Window(context, PAGES)
    # Exclude existing objects from garbage collection, which would block the event loop.
    gc.freeze()
    window.show()
    if starting is not None:
        starting.close()
    QTimer.singleShot(0, window.context.background.prepare)
    QTimer.singleShot(0, window.look_for_left_campaign)
    QTimer.singleShot(0, Thread(target=load_ahead).start)
    code = app.exec()
    if complaint := stored.complaint:
        sys.stderr.write(f"{printable(complaint)}\n")
        code = code or 1
    return code


def load_ahead() -> None:
    """Import what the first prediction and the first curves need, after the window was painted."""
    import_module("scipy.signal")
    getattr(import_module("vibench.analysis"), "MeasurementPrediction")  # noqa: B009


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
"""Debian packages for an X11 window, by the library that is missing first."""
ON_X11 = " ".join(sorted(PACKAGES.values()))
ELSEWHERE = "or run it without a window: QT_QPA_PLATFORM=offscreen"


def display_trouble() -> str:
    """Return in one sentence why no window can be shown, and what to do; empty if one can."""
    try:
        import PySide6.QtWidgets  # noqa: F401, PLC0415 - whether it loads is the question
    except ImportError as error:
        return f"Qt cannot be loaded ({error}); on Debian: apt-get install {LINKED}"
    # Held in a variable, because type checkers for another system would find the rest unreachable.
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
