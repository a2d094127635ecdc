"""What all pages share: the bridge, what is meant, settings, background work, and the way to the window."""

from collections.abc import Callable, Mapping
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QByteArray, QObject, QSettings, QStandardPaths, Signal

from vibench.acquisition.engine import LONGEST_PATIENCE_S, VIEWER_PATIENCE_S, start_engine
from vibench.acquisition.plan import Campaign, Measurement
from vibench.acquisition.rig import Rig

from ..background.background import Background
from ..engine_link.bridge import Bridge, Starter
from ..widgets.notice import Notice
from ..widgets.theme import LIGHT, THEMES, Theme
from ..widgets.units import CHOICES, UNITS

if TYPE_CHECKING:
    from vibench.analysis import MeasurementPrediction


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
        """Return a number that was kept, between its bounds; ``otherwise`` where it is none."""
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


class Selection(QObject):
    """Values that several pages work on; each is whole and valid, or None."""

    rig_changed = Signal()
    measurement_changed = Signal()
    campaign_changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.rig: Rig | None = None
        """The rig that was chosen, open or not."""
        self.measurement: Measurement | None = None
        """The test on the Test page; None while something in it is not allowed."""
        self.campaign: Campaign | None = None
        """The campaign on the Queue page."""
        self.prediction: MeasurementPrediction | None = None
        """What the specimen is predicted to do under the test; None while nobody knows."""

    def choose_rig(self, rig: Rig | None) -> None:
        """Mean another rig."""
        if rig != self.rig:
            self.rig = rig
            self.rig_changed.emit()

    def choose_measurement(self, measurement: Measurement | None) -> None:
        """Mean another test."""
        if measurement != self.measurement:
            self.measurement, self.prediction = measurement, None
            self.measurement_changed.emit()

    def keep_prediction(self, prediction: "MeasurementPrediction") -> None:
        """Keep what is predicted of the test."""
        self.prediction = prediction

    def choose_campaign(self, campaign: Campaign | None) -> None:
        """Mean another campaign."""
        if campaign != self.campaign:
            self.campaign = campaign
            self.campaign_changed.emit()


USUAL_PATIENCE_S = 2.0
MOST_RECENT = 12
WORKERS = 2
"""For whatever takes long: predictions, analyses, overviews, exports."""


class AppContext(QObject):
    """Handed to every page; pages know each other by name only."""

    folder_chosen = Signal(object)
    """Recordings go to another folder."""
    noticed = Signal(object)
    """A `Notice` for the message strip."""
    page_wanted = Signal(str)
    """Name of a page to show."""
    recording_wanted = Signal(object)
    """Path of a recording that somebody wants to look at; Files opens it."""
    recording_made = Signal(object)
    """Path of a recording that has just been finished."""
    comparison_wanted = Signal(object)
    """Paths of recordings to lay over one another; Compare takes them."""
    prediction_made = Signal(object)
    """Curves of a prediction to lay over recordings; Compare takes them."""
    scene_wanted = Signal(float, float)
    """Drive frequency [Hz] and base amplitude [m] of a scene to simulate; Simulate takes them."""
    theme_changed = Signal(object)
    """The `Theme` from now on."""

    def __init__(
        self, settings: Settings, start: Starter = start_engine, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self.settings = settings
        self.first_bench: Path | None = None
        """Named on the command line; remembered only when it can be used."""
        self.is_armed_read: Callable[[], bool] = lambda: True
        """Whether somebody could read to the end what is armed; the page that shows it answers."""
        self.selection = Selection(self)
        self.bridge = Bridge(start, self)
        self.bridge.noticed.connect(self.noticed)
        self.bridge.recording_ended.connect(self.recording_made)
        self.background = Background(WORKERS, self)
        self.looks = Background(1, self.background)
        """For what must come at once, whatever takes long beside it: previews."""
        UNITS.choose(dict(zip(CHOICES, settings.text(Remembered.UNITS).split(), strict=False)))
        self.theme = THEMES.get(settings.text(Remembered.THEME), LIGHT)
        """Colours to draw in."""

    def choose_theme(self, theme: Theme) -> None:
        """Draw in other colours from now on, and next time."""
        self.theme = theme
        self.settings.keep_text(Remembered.THEME, theme.name)
        self.theme_changed.emit(theme)

    def choose_units(self, chosen: Mapping[str, str]) -> None:
        """Show quantities in these units from now on, and next time; by the SI unit of each."""
        UNITS.choose(chosen)
        self.settings.keep_text(Remembered.UNITS, " ".join(UNITS.chosen.values()))

    @property
    def patience_s(self) -> float:
        """How long a drive far from every limit may go on while the window does not answer [s]."""
        return self.settings.number(
            Remembered.PATIENCE, USUAL_PATIENCE_S, VIEWER_PATIENCE_S, LONGEST_PATIENCE_S
        )

    @property
    def folder(self) -> Path:
        """Where recordings go and are looked for."""
        return Path(self.settings.text(Remembered.FOLDER, str(Path.home() / "vibench")))

    def choose_folder(self, folder: Path) -> None:
        """Put recordings elsewhere from now on."""
        self.settings.keep_text(Remembered.FOLDER, str(folder))
        self.folder_chosen.emit(folder)

    @property
    def recent_files(self) -> tuple[Path, ...]:
        """What was opened or saved last, the newest first."""
        return tuple(Path(each) for each in self.settings.text(Remembered.RECENT).split("\n") if each)

    def note_file(self, path: Path) -> None:
        """Remember a file that somebody opened or saved."""
        known = [str(each) for each in self.recent_files if each != path]
        self.settings.keep_text(Remembered.RECENT, "\n".join([str(path), *known][:MOST_RECENT]))

    def say(self, notice: Notice) -> None:
        """Put a message on the strip."""
        self.noticed.emit(notice)
