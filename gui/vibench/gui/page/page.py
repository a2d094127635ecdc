"""Base class of the pages, layout of pages in two parts, their simulations, and the undo history."""

import tomllib
from collections.abc import Callable, Mapping
from enum import Enum, auto
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar, cast

from PySide6.QtCore import QEvent, QObject, Qt, QTimer
from PySide6.QtGui import QHideEvent, QResizeEvent
from PySide6.QtWidgets import QLayout, QSplitter, QWidget

from vibench.acquisition import ConfigurationError, RecordingError, open_recording
from vibench.analysis.prediction.progress import PartialResult
from vibench.analysis.prediction.worker import Asked, answer
from vibench.sim.background import Job

from ..background import Background
from ..widgets.boxes import ScrollArea, column, push_button, title_of
from ..widgets.notice import Notice, NoticeKind
from ..widgets.theme import Theme
from .app_context import AppContext, SettingKey


class FileKind(Enum):
    """Kind of file that the window can open; each page declares which kinds it opens."""

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
"""Keys of a TOML file that identify its kind."""


def file_kind(path: Path) -> FileKind:
    """Return the kind of a file or folder; raise ConfigurationError if the window cannot open it."""
    if path.is_dir():
        return FileKind.FOLDER
    if path.name.endswith((".h5", ".h5.part")):
        try:
            open_recording(path).close()
        except RecordingError:
            # Accept the file here; the Compare page opens the file or reports why this is impossible.
            return FileKind.BRANCHES if path.exists() else FileKind.RECORDING
        return FileKind.RECORDING
    allowed = "open a recording (.h5), or a test, campaign or hardware configuration (.toml)"
    if path.suffix != ".toml":
        raise ConfigurationError(f"{path} cannot be opened here; {allowed}")
    try:
        keys = tomllib.loads(path.read_text("utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise ConfigurationError(f"{path} cannot be read ({error}); {allowed}") from error
    found = next((kind for key, kind in _TABLES.items() if key in keys), None)
    if found is None:
        raise ConfigurationError(f"{path} is not a test, campaign or hardware configuration; {allowed}")
    return found


class DisplayedResult:
    """Result and its widgets, which are disabled while the result's inputs differ from the present inputs."""

    def __init__(self, wanted: Callable[[], object], *widgets: QWidget) -> None:
        self.wanted, self.widgets = wanted, widgets
        self.inputs: object = None
        """Inputs from which the result was computed; None if nothing is shown."""

    @property
    def is_outdated(self) -> bool:
        """Whether the result shown was computed from inputs other than the present inputs."""
        return self.inputs is not None and self.inputs != self.wanted()

    def show(self, inputs: object) -> None:
        """Store the inputs of the result that the widgets now show; None if the widgets show nothing."""
        self.inputs = inputs
        self.mark()

    def mark(self) -> None:
        """Disable the widgets if the result is outdated; otherwise enable them."""
        for widget in self.widgets:
            widget.setEnabled(not self.is_outdated)


class ThemedPart(Protocol):
    """A part of a page that is drawn in the theme's colours."""

    def retheme(self, theme: Theme) -> None:
        """Change to the colours of a theme."""


class Page(QWidget):
    """Page of the window. A page keeps no state of a run; every tick reads the bridge again."""

    def __init__(self, context: AppContext) -> None:
        super().__init__()
        self.context = context
        self.edits: History[Any] = History(lambda _plan: None)
        """Undo history of the plan; empty on pages without a plan."""
        self.displayed_results: tuple[DisplayedResult, ...] = ()

    @property
    def is_done(self) -> bool:
        """Whether the page's task is done; the navigation bar shows this by a tick."""
        return False

    def refresh(self) -> None:
        """Update the page; called about twenty times a second while it is visible."""

    @property
    def opens(self) -> Mapping[FileKind, Callable[[Path], object]]:
        """Functions that open files on this page, by kind."""
        return {}

    @property
    def styled_parts(self) -> tuple[QWidget, ...]:
        """Parts that are restyled one by one, because restyling the whole page would block the event loop."""
        return (self,)

    def retheme(self, theme: Theme) -> None:
        """Change the colours of plots; other widgets follow the palette."""
        for part in self.findChildren(QWidget):
            # Use hasattr, because isinstance takes 80 µs and a page has hundreds of parts.
            if hasattr(type(part), "retheme"):
                cast(ThemedPart, part).retheme(theme)

    def enter(self) -> None:
        """Prepare the page before the window shows it."""

    def leave(self) -> None:
        """Store the user's input; called when another page is shown or the window closes."""


class PageParts(QSplitter):
    """Two parts of a page with a movable divider, whose position is stored when the page is hidden."""

    def __init__(self, context: AppContext, page: str, orientation: Qt.Orientation) -> None:
        super().__init__(orientation)
        self._settings, self._page = context.settings, page
        self._was_moved = False
        self.setChildrenCollapsible(False)

    def show_parts(self, first: QWidget, second: QWidget, sizes: tuple[int, int] = (0, 0)) -> None:
        """Add the two parts with the user's last sizes, or with ``sizes``; zeros mean preferred sizes."""
        self.addWidget(first)
        self.addWidget(second)
        if any(sizes):
            self.setSizes(sizes)
        self.setStretchFactor(1, 1)
        self.splitterMoved.connect(self._move)
        kept = self._settings.state(SettingKey.SPLITTERS, self._page)
        self._was_moved = not kept.isEmpty() and self.restoreState(kept)

    def hideEvent(self, event: QHideEvent) -> None:
        """Store the position of the divider if the user has moved it."""
        super().hideEvent(event)
        if self._was_moved:
            self._settings.keep_state(SettingKey.SPLITTERS, self.saveState(), self._page)

    def _move(self, *_: object) -> None:
        self._was_moved = True


class SideAndPicture(PageParts):
    """Page in two scrolling parts: choices on the left, plots on the right.

    Parameters
    ----------
    context
        The page's services.
    page
        Name of the page, used as the title of the left part.
    side
        Left part, below the title.
    picture
        Right part.
    foot
        Buttons below the left part, which do not scroll.
    """

    WIDEST_SIDE = 0.55
    """Largest width of the left part relative to the page, unless the user moves the divider."""

    def __init__(
        self,
        context: AppContext,
        page: str,
        side: QWidget,
        picture: QWidget,
        foot: QWidget | QLayout | None = None,
    ) -> None:
        super().__init__(context, page, Qt.Orientation.Horizontal)
        self.setAccessibleName(f"Parts of the {page} page")
        self.side = ScrollArea(f"Choices of the {page} page", side)
        feet = () if foot is None else (foot,)
        pictures = ScrollArea(f"Pictures of the {page} page", picture)
        self.show_parts(column(title_of(page), (self.side, 1), *feet), pictures)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Give the left part its preferred width, unless the user has moved the divider."""
        super().resizeEvent(event)
        self._divide()

    def event(self, event: QEvent) -> bool:
        """Adapt the width to a new font, even while the page is hidden."""
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.Show):
            # Adapt the width in the next pass: the child widgets do not have the new font yet.
            QTimer.singleShot(0, self, self._divide)
        return super().event(event)

    def _divide(self) -> None:
        if not self._was_moved:
            wanted = min(self.side.sizeHint().width(), round(self.WIDEST_SIDE * self.width()))
            self.setSizes([wanted, self.width() - wanted])


State = TypeVar("State")
MOST_KEPT = 200


class History(Generic[State]):
    """Undo history: earlier and later states of a plan; ``show`` displays one state on the page."""

    def __init__(self, show: Callable[[State], None]) -> None:
        self._show = show
        self._states: list[State] = []
        self._now = -1

    def note(self, state: State) -> None:
        """Append a state of the plan; states that the user has undone are discarded."""
        if self._states and self._states[self._now] == state:
            return
        self._states = [*self._states[: self._now + 1], state][-MOST_KEPT:]
        self._now = len(self._states) - 1

    def undo(self) -> None:
        """Show the previous state of the plan, if it exists."""
        self._go(-1)

    def redo(self) -> None:
        """Show the next state of the plan, if it exists."""
        self._go(1)

    def _go(self, step: int) -> None:
        if 0 <= self._now + step < len(self._states):
            self._now += step
            self._show(self._states[self._now])


class Simulator(QObject):
    """Process that computes the newest request of a page; it ends when the page is deleted.

    ``grown`` receives the results so far, ``ended`` is called after the last result, and ``said`` receives
    messages about starting, cancelling and failures.
    """

    def __init__(
        self,
        page: QWidget,
        context: AppContext,
        grown: Callable[[tuple[PartialResult, ...]], None],
        ended: Callable[[], None],
        said: Callable[[str], None],
    ) -> None:
        super().__init__(page)
        self._context = context
        self._grown, self._ended, self._said = grown, ended, said
        self._job: Job | None = None
        self.cancel_button = push_button("&Cancel", "Stop at once; keep the results so far", self.cancel)
        self.cancel_button.setEnabled(False)
        self.background = Background(1, self)
        page.destroyed.connect(self.background.close)

    @property
    def is_busy(self) -> bool:
        """Whether a request is still being computed."""
        return self._job is not None and not self._job.is_over

    def begin(self, request: Asked) -> None:
        """Start a request, and cancel an earlier one."""
        self._drop()
        self._job = self.background.stream(answer, self._grown, self._end, self._die, request)
        self.cancel_button.setEnabled(True)
        self._said("Computing; the first result appears once the program is loaded…")

    def cancel(self) -> None:
        """Cancel the request; the results obtained so far stay on the page."""
        self._drop()
        self._said("Cancelled; the results so far are shown.")

    def _drop(self) -> None:
        if self._job is not None:
            self._job.drop()
        self.cancel_button.setEnabled(False)

    def _end(self, _answer: None) -> None:
        self.cancel_button.setEnabled(False)
        self._ended()

    def _die(self, error: BaseException) -> None:
        self.cancel_button.setEnabled(False)
        what, done = f"The simulation failed: {error}.", "The results so far are shown."
        self._context.say(Notice(NoticeKind.FAULT, what, done, "Compute again.", "SIMULATOR"))
        self._said("The simulation failed.")
