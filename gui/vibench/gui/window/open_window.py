"""From nothing to a window on the screen, and from its end to the end of the process."""

import gc
from importlib import import_module
from pathlib import Path
from threading import Thread

import matplotlib as mpl
from PySide6.QtCore import QCoreApplication, Qt, QTimer
from PySide6.QtGui import QFont, QFontDatabase
from PySide6.QtWidgets import QApplication, QLabel, QStyleFactory

from ..page.app_context import AppContext, Remembered, Settings, default_settings_path
from .page_catalogue import PAGES
from .window import Window

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
