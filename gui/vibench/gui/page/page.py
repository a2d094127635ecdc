"""What a page of the window is: a widget that follows the engine and the theme, whole or in two parts."""

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum, auto
from pathlib import Path
from typing import Generic, Protocol, TypeVar, runtime_checkable

from PySide6.QtCore import QEvent, Qt, QTimer
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QLayout, QSplitter, QWidget

from vibench.acquisition import ConfigurationError, RecordingError, open_recording

from ..widgets.boxes import Scrolled, column, title_of
from ..widgets.theme import Theme
from .app_context import AppContext, Remembered


class FileKind(Enum):
    """What the window can open; each page says which of them it takes."""

    FOLDER = auto()
    RECORDING = auto()
    BRANCHES = auto()
    TEST = auto()
    CAMPAIGN = auto()
    RIG = auto()


_TABLES = {
    "excitation": FileKind.TEST,
    "measurements": FileKind.CAMPAIGN,
    "sweeps": FileKind.CAMPAIGN,
    "generator": FileKind.RIG,
}
"""Keys of a TOML file that tell what it is."""


def file_kind(path: Path) -> FileKind:
    """Look at a file, or a folder.

    Raises
    ------
    ConfigurationError
        In one sentence, when it is nothing that the window opens.
    """
    if path.is_dir():
        return FileKind.FOLDER
    if path.name.endswith((".h5", ".h5.part")):
        try:
            open_recording(path).close()
        except RecordingError:
            # Compare reads it, or says why it cannot.
            return FileKind.BRANCHES if path.exists() else FileKind.RECORDING
        return FileKind.RECORDING
    allowed = "open a recording (.h5), or a test, campaign or hardware configuration (.toml)"
    if path.suffix != ".toml":
        raise ConfigurationError(f"{path} is nothing that can be opened here; {allowed}")
    try:
        keys = tomllib.loads(path.read_text("utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise ConfigurationError(f"{path} cannot be read ({error}); {allowed}") from error
    found = next((kind for key, kind in _TABLES.items() if key in keys), None)
    if found is None:
        raise ConfigurationError(f"{path} is no test, campaign or hardware configuration; {allowed}")
    return found


@dataclass(frozen=True)
class Shown:
    """Numbers or a picture, and what they were computed from.

    ``inputs`` are None while nothing is shown. While they are not ``wanted``, the widget is disabled: a stale
    number must never look like a true one.
    """

    widget: QWidget
    inputs: object
    wanted: object

    @property
    def is_true(self) -> bool:
        """Whether it belongs to what is asked for now, or does not look as if it did."""
        return self.inputs is None or self.inputs == self.wanted or not self.widget.isEnabled()


@runtime_checkable
class Themed(Protocol):
    """A part of a page that draws with colours of the theme."""

    def retheme(self, theme: Theme) -> None:
        """Draw in other colours."""


class Page(QWidget):
    """One step of the job. It keeps no truth of its own: what is shown is asked for at every tick."""

    def __init__(self, context: AppContext) -> None:
        super().__init__()
        self.context = context

    @property
    def is_done(self) -> bool:
        """Whether the rail ticks this page."""
        return False

    def refresh(self) -> None:
        """Show what is true now; called some twenty times a second while the page is in sight."""

    @property
    def opens(self) -> Mapping[FileKind, Callable[[Path], object]]:
        """What this page does with files of which kind."""
        return {}

    def undo(self) -> None:
        """Take back the last edit of the plan; pages without one have none."""

    def redo(self) -> None:
        """Make it again."""

    @property
    def shown(self) -> tuple[Shown, ...]:
        """What the page shows that was computed, with what it was computed from."""
        return ()

    @property
    def styled(self) -> tuple[QWidget, ...]:
        """Its parts, for a style sheet: one after the other, where the whole would hold the window up."""
        return (self,)

    def retheme(self, theme: Theme) -> None:
        """Draw in other colours; widgets follow the palette by themselves, plots do not."""
        for part in self.findChildren(QWidget):
            if isinstance(part, Themed):
                part.retheme(theme)

    def entered(self) -> None:
        """Come into sight."""

    def left(self) -> None:
        """Go out of sight, or end with the window: keep what was typed."""


class SideAndPicture(QSplitter):
    """A page in two parts, each of which scrolls by itself; keeps where the line between them was put.

    Parameters
    ----------
    context
        Of the page.
    page
        Its name, which is the title of the left part.
    side
        Scrolled below the title.
    picture
        The right part.
    foot
        What stays in sight below the left part: the buttons that act on it.
    """

    WIDEST_SIDE = 0.55
    """Part of the width that the left part may take by itself."""

    def __init__(
        self,
        context: AppContext,
        page: str,
        side: QWidget,
        picture: QWidget,
        foot: QWidget | QLayout | None = None,
    ) -> None:
        super().__init__(Qt.Orientation.Horizontal)
        self._settings, self._page = context.settings, page
        self._was_moved = False
        self.setAccessibleName(f"Parts of the {page} page")
        self.side = Scrolled(f"Choices of the {page} page", side)
        feet = () if foot is None else (foot,)
        self.addWidget(column(title_of(page), (self.side, 1), *feet))
        self.addWidget(Scrolled(f"Pictures of the {page} page", picture))
        self.setStretchFactor(1, 1)
        self.setChildrenCollapsible(False)
        self.splitterMoved.connect(self._move)
        kept = self._settings.state(Remembered.SPLITTERS, page)
        self._was_moved = not kept.isEmpty() and self.restoreState(kept)

    def keep(self) -> None:
        """Keep how the page is divided, for next time, where somebody has divided it."""
        if self._was_moved:
            self._settings.keep_state(Remembered.SPLITTERS, self.saveState(), self._page)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Give the left part the width that it needs, unless somebody has chosen another."""
        super().resizeEvent(event)
        self._divide()

    def event(self, event: QEvent) -> bool:
        """Follow the font at once, also where it changed while the page was out of sight."""
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.Show):
            # Afterwards: what is inside has not been told yet.
            QTimer.singleShot(0, self, self._divide)
        return super().event(event)

    def _move(self, *_: object) -> None:
        self._was_moved = True

    def _divide(self) -> None:
        if not self._was_moved:
            wanted = min(self.side.sizeHint().width(), round(self.WIDEST_SIDE * self.width()))
            self.setSizes([wanted, self.width() - wanted])


State = TypeVar("State")
MOST_KEPT = 200


class History(Generic[State]):
    """States of a plan in their order, and where in them it stands."""

    def __init__(self) -> None:
        self._states: list[State] = []
        self._now = -1

    def note(self, state: State) -> None:
        """Note a state that was made; what had been taken back before is forgotten."""
        if self._states and self._states[self._now] == state:
            return
        self._states = [*self._states[: self._now + 1], state][-MOST_KEPT:]
        self._now = len(self._states) - 1

    def undo(self) -> State | None:
        """Go back; None where nothing was before."""
        return self._go(-1)

    def redo(self) -> State | None:
        """Go on; None where nothing comes after."""
        return self._go(1)

    def _go(self, step: int) -> State | None:
        if not 0 <= self._now + step < len(self._states):
            return None
        self._now += step
        return self._states[self._now]
