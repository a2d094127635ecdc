"""What the window remembers: its shape, its theme, the last files. Never that anything was armed."""

from enum import StrEnum
from pathlib import Path

from PySide6.QtCore import QByteArray, QSettings, QStandardPaths


class Remembered(StrEnum):
    """Keys of the settings file."""

    GEOMETRY = "window/geometry"
    SPLITTERS = "window/splitters"
    THEME = "window/theme"
    PAGE = "window/page"
    BENCH = "rig/configuration"
    TEST = "test/last"
    CAMPAIGN = "queue/last"
    FOLDER = "recordings/folder"
    PATIENCE = "run/patience_s"
    FONT = "window/font_points"
    UNITS = "window/units"
    RECENT = "files/recent"
    SCENES = "simulate/scene"


class Settings:
    """An INI file that people may read and delete."""

    def __init__(self, path: Path) -> None:
        self._store = QSettings(str(path), QSettings.Format.IniFormat)

    def text(self, key: Remembered, otherwise: str = "") -> str:
        """Text that was kept, or ``otherwise``."""
        value = self._store.value(key.value)
        return value if isinstance(value, str) and value else otherwise

    def number(self, key: Remembered, otherwise: float, low: float, high: float) -> float:
        """Give a number that was kept, between its bounds; ``otherwise`` where it is none."""
        try:
            return min(max(float(self.text(key)), low), high)
        except ValueError:
            return otherwise

    def keep_text(self, key: Remembered, value: str) -> None:
        """Keep a text."""
        self._store.setValue(key.value, value)

    def state(self, key: Remembered, name: str = "") -> QByteArray:
        """Shape of a window or splitter that was kept, empty when there is none."""
        value = self._store.value(f"{key.value}/{name}" if name else key.value)
        return value if isinstance(value, QByteArray) else QByteArray()

    def keep_state(self, key: Remembered, state: QByteArray, name: str = "") -> None:
        """Keep the shape of a window or splitter."""
        self._store.setValue(f"{key.value}/{name}" if name else key.value, state)

    def forget_layout(self) -> None:
        """Drop shapes, for a window that comes up as new."""
        for key in (Remembered.GEOMETRY, Remembered.SPLITTERS):
            self._store.remove(key.value)


def default_settings_path() -> Path:
    """Where the settings file lies for this user."""
    folder = QStandardPaths.writableLocation(QStandardPaths.StandardLocation.GenericConfigLocation)
    return Path(folder) / "vibench" / "window.ini"
