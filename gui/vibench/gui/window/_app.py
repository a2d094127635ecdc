"""The application around the window: style, font, settings."""

from pathlib import Path

import matplotlib as mpl
from PySide6.QtCore import QCoreApplication, Qt
from PySide6.QtGui import QFont, QFontDatabase
from PySide6.QtWidgets import QApplication, QStyleFactory

FONT_FILES = ("DejaVuSans.ttf", "DejaVuSans-Bold.ttf", "DejaVuSansMono.ttf")
FONT_POINTS = 10


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
