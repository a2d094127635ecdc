"""Services of all pages: bridge, current selection, settings, background work, signals to the window."""

from collections.abc import Callable, Mapping
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QByteArray, QObject, QSettings, QStandardPaths, Signal

from vibench.acquisition.engine import LONGEST_PATIENCE_S, VIEWER_PATIENCE_S, start_engine
from vibench.acquisition.plan import Campaign, Measurement
from vibench.acquisition.rig import Rig

from ..background import Background
from ..engine_link import Bridge, Starter
from ..widgets.notice import Notice, NoticeKind, notice_of
from ..widgets.theme import LIGHT, THEMES, Theme
from ..widgets.units import CHOICES, UNITS

if TYPE_CHECKING:
    from vibench.analysis import MeasurementPrediction


class SettingKey(StrEnum):
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
    """Settings file of the window, in INI format; users may read and delete it."""

    def __init__(self, path: Path) -> None:
        self._store = QSettings(str(path), QSettings.Format.IniFormat)

    @property
    def complaint(self) -> str:
        """Error message if the settings file cannot be written; empty if it can be written."""
        self._store.sync()
        if self._store.status() is QSettings.Status.NoError:
            return ""
        return (
            f"{self._store.fileName()} could not be written: the last test, campaign and layout are not "
            "saved. Make room on the disk, or give another file with --settings"
        )

    def text(self, key: SettingKey, otherwise: str = "") -> str:
        """Return a stored text of the settings; ``otherwise`` if no text is stored."""
        value = self._store.value(key.value)
        return value if isinstance(value, str) and value else otherwise

    def number(self, key: SettingKey, otherwise: float, low: float, high: float) -> float:
        """Return a stored number, limited to ``low`` and ``high``; ``otherwise`` if no number is stored."""
        try:
            return min(max(float(self.text(key)), low), high)
        except ValueError:
            return otherwise

    def keep_text(self, key: SettingKey, value: str) -> None:
        """Store a text in the settings file."""
        self._store.setValue(key.value, value)

    def state(self, key: SettingKey, name: str = "") -> QByteArray:
        """Return the stored layout of a window or splitter; empty if no layout is stored."""
        value = self._store.value(f"{key.value}/{name}" if name else key.value)
        return value if isinstance(value, QByteArray) else QByteArray()

    def keep_state(self, key: SettingKey, state: QByteArray, name: str = "") -> None:
        """Store the layout of a window or splitter."""
        self._store.setValue(f"{key.value}/{name}" if name else key.value, state)

    def forget_layout(self) -> None:
        """Delete stored layouts, so that the window opens with its default layout."""
        for key in (SettingKey.GEOMETRY, SettingKey.SPLITTERS):
            self._store.remove(key.value)


def default_settings_path() -> Path:
    """Return the path of this user's settings file."""
    folder = QStandardPaths.writableLocation(QStandardPaths.StandardLocation.GenericConfigLocation)
    return Path(folder) / "vibench" / "window.ini"


class Selection(QObject):
    """Objects that several pages edit or show; each object is complete and valid, or None."""

    rig_changed = Signal()
    measurement_changed = Signal()
    campaign_changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.rig: Rig | None = None
        """Rig that the user has selected; the rig's bench need not be open."""
        self.measurement: Measurement | None = None
        """Test on the Test page; None while it is not valid."""
        self.campaign: Campaign | None = None
        self.prediction: MeasurementPrediction | None = None
        """Predicted response of the specimen to the current test; None until it is computed."""

    def choose_rig(self, rig: Rig | None) -> None:
        """Select another rig for all pages."""
        if rig != self.rig:
            self.rig = rig
            self.rig_changed.emit()

    def choose_measurement(self, measurement: Measurement | None) -> None:
        """Select another test for all pages."""
        if measurement != self.measurement:
            self.measurement, self.prediction = measurement, None
            self.measurement_changed.emit()

    def choose_campaign(self, campaign: Campaign | None) -> None:
        """Select another campaign for all pages."""
        if campaign != self.campaign:
            self.campaign = campaign
            self.campaign_changed.emit()


USUAL_PATIENCE_S = 2.0
MOST_RECENT = 12
WORKERS = 2
"""Number of worker processes for long jobs: predictions, analyses, overviews, exports."""


class AppContext(QObject):
    """Services for every page; pages refer to other pages by name only."""

    folder_chosen = Signal(object)
    """Emitted with the folder of new recordings after the user has chosen another folder."""
    noticed = Signal(object)
    page_requested = Signal(str)
    """Emitted with the name of the page to show."""
    recording_requested = Signal(object)
    """Path of a recording to open on the Files page."""
    recording_made = Signal(object)
    """Path of a recording that has just ended."""
    comparison_requested = Signal(object)
    """Paths of recordings to overlay on the Compare page."""
    prediction_made = Signal(object)
    """Predicted curves to overlay on the Compare page."""
    scene_requested = Signal(float, float)
    """Drive frequency [Hz] and base amplitude [m] of a scene for the Simulate page."""
    theme_changed = Signal(object)

    def __init__(
        self, settings: Settings, start: Starter = start_engine, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self.settings = settings
        self.first_bench: Path | None = None
        """Hardware configuration from the command line; stored in the settings only after it was opened."""
        self.is_armed_read: Callable[[], bool] = lambda: True
        """Whether the user has read the description of the armed test; set by the Run page."""
        self.selection = Selection(self)
        self.bridge = Bridge(start, self)
        self.bridge.noticed.connect(self.noticed)
        self.bridge.recording_ended.connect(self.recording_made)
        self.background = Background(WORKERS, self)
        self.looks = Background(1, self.background)
        """Worker process for previews, because previews must not wait behind long jobs."""
        UNITS.choose(dict(zip(CHOICES, settings.text(SettingKey.UNITS).split(), strict=False)))
        self.theme = THEMES.get(settings.text(SettingKey.THEME), LIGHT)

    def choose_theme(self, theme: Theme) -> None:
        """Change the colour theme and store the choice."""
        self.theme = theme
        self.settings.keep_text(SettingKey.THEME, theme.name)
        self.theme_changed.emit(theme)

    def choose_units(self, chosen: Mapping[str, str]) -> None:
        """Change the displayed units and store the choice; ``chosen`` maps SI units to displayed units."""
        UNITS.choose(chosen)
        self.settings.keep_text(SettingKey.UNITS, " ".join(UNITS.chosen_units.values()))

    @property
    def patience_s(self) -> float:
        """Time for which a run far from all limits may continue while the window does not respond [s]."""
        return self.settings.number(
            SettingKey.PATIENCE, USUAL_PATIENCE_S, VIEWER_PATIENCE_S, LONGEST_PATIENCE_S
        )

    @property
    def folder(self) -> Path:
        """Folder into which new recordings are written."""
        return Path(self.settings.text(SettingKey.FOLDER, str(Path.home() / "vibench")))

    def choose_folder(self, folder: Path) -> None:
        """Change the folder of new recordings."""
        self.settings.keep_text(SettingKey.FOLDER, str(folder))
        self.folder_chosen.emit(folder)

    @property
    def recent_files(self) -> tuple[Path, ...]:
        """Latest opened or saved files, the newest first."""
        return tuple(Path(each) for each in self.settings.text(SettingKey.RECENT).split("\n") if each)

    def note_file(self, path: Path) -> None:
        """Put a file first in the list of recent files."""
        known = [str(each) for each in self.recent_files if each != path]
        self.settings.keep_text(SettingKey.RECENT, "\n".join([str(path), *known][:MOST_RECENT]))

    def say(self, notice: Notice) -> None:
        """Show a message in the message strip."""
        self.noticed.emit(notice)

    def warn(self, what: str, done: str = "", next_step: str = "", details: str = "") -> None:
        """Show a warning with the parts of a `Notice`."""
        self.say(Notice(NoticeKind.WARNING, what, done, next_step, details=details))

    def fail(self, error: BaseException) -> None:
        """Show an error in the message strip."""
        self.say(notice_of(error))
