"""Functions that create the application and the window."""

import gc
import sys
from importlib import import_module
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
    """Return the application, with the same style and font on every computer."""
    existing = QCoreApplication.instance()
    if existing is None:
        QApplication.setHighDpiScaleFactorRoundingPolicy(Qt.HighDpiScaleFactorRoundingPolicy.PassThrough)
        existing = QApplication(arguments)
    assert isinstance(existing, QApplication)
    existing.setApplicationName("vibench")
    existing.setStyle(QStyleFactory.create("Fusion"))
    # DejaVu Sans has all required characters and is installed with matplotlib.
    folder = Path(mpl.get_data_path()) / "fonts" / "ttf"
    for name in FONT_FILES:
        QFontDatabase.addApplicationFont(str(folder / name))
    existing.setFont(QFont("DejaVu Sans", FONT_POINTS))
    return existing


def open_window(bench: Path | None, settings: Path | None, starting: QLabel | None = None) -> int:
    """Show the window in place of the label ``starting`` until it is closed; return the exit code."""
    app = application(["vibench"])
    stored = Settings(settings or default_settings_path())
    context = AppContext(stored)
    context.first_bench = None if bench is None else bench.resolve()
    font = app.font()
    font.setPointSize(int(stored.number(SettingKey.FONT, FONT_POINTS, SMALLEST_POINTS, LARGEST_POINTS)))
    app.setFont(font)
    window = Window(context, PAGES)
    # Exempt existing objects from garbage collection, which would block the event loop.
    gc.freeze()
    window.show()
    if starting is not None:
        starting.close()
    QTimer.singleShot(0, window.context.background.prepare)
    QTimer.singleShot(0, window.adopt_left_campaign)
    QTimer.singleShot(0, Thread(target=load_ahead).start)
    code = app.exec()
    if complaint := stored.complaint:
        sys.stderr.write(f"{printable(complaint)}\n")
        code = code or 1
    return code


def load_ahead() -> None:
    """Import the modules for the first prediction and its curves, after the window has been painted."""
    import_module("scipy.signal")
    getattr(import_module("vibench.analysis"), "MeasurementPrediction")  # noqa: B009
