"""The menus, the list of keys (F1), dialogs for settings and information, and the abort key."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import AfterValidator, Field
from PySide6.QtCore import QEvent, QObject, Qt, QUrl, Signal
from PySide6.QtGui import QFont, QKeyEvent, QKeySequence, QTextCursor, QTextDocument, QTextOption
from PySide6.QtWidgets import (
    QApplication,
    QDialog,
    QDialogButtonBox,
    QFileDialog,
    QMenu,
    QMessageBox,
    QTextBrowser,
    QVBoxLayout,
    QWidget,
)

from vibench.acquisition import ConfigurationError, printable, shipped_folder
from vibench.acquisition.engine import LONGEST_PATIENCE_S, VIEWER_PATIENCE_S
from vibench.sim import FrozenModel

from ..forms.model_form import ValidatedForm
from ..page.app_context import AppContext, SettingKey
from ..widgets.boxes import fill_box, push_button
from ..widgets.theme import DARK, LIGHT, THEMES
from ..widgets.units import UNITS

if TYPE_CHECKING:
    from .window import Window


def whole_path(folder: str) -> str:
    """Return an absolute path; raise ValueError for a path relative to the working directory."""
    if not Path(folder).expanduser().is_absolute():
        raise ValueError(f"{folder!r} is not an absolute path; give {Path.home() / 'vibench'}, for example")
    return folder


class Preferences(FrozenModel):
    """Settings of the user."""

    theme: Literal["light", "dark"]
    """Colours of the window; exported figures always have light colours."""
    font_pt: Annotated[int, Field(ge=7, le=24)]
    """Font size."""
    displacements_in: Literal["automatic", "µm", "mm", "m"]
    """Unit of displacements in the window, not in files and reports. Any unit may be typed into fields."""
    velocities_in: Literal["mm/s", "m/s"]
    """Unit of velocities on axes, in tables and in sentences."""
    accelerations_in: Literal["m/s²", "g"]
    """Unit of accelerations; g is 9.80665 m/s²."""
    patience_s: Annotated[float, Field(ge=VIEWER_PATIENCE_S, le=LONGEST_PATIENCE_S)]
    """How long a test far from all limits may continue while the window does not respond."""
    recordings_folder: Annotated[str, AfterValidator(whole_path)]
    """Folder of new recordings."""


class SettingsDialog(QDialog):
    """Dialog that applies valid settings; Cancel discards the changes."""

    def __init__(self, context: AppContext, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle("Settings")
        self._context = context
        self.form: ValidatedForm[Preferences] = ValidatedForm(Preferences, "settings")
        self.buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.Ok | QDialogButtonBox.StandardButton.Cancel
        )
        self.buttons.accepted.connect(self.accept)
        self.buttons.rejected.connect(self.reject)
        fill_box(QVBoxLayout(self), self.form, self.buttons)
        self.setMinimumWidth(30 * self.fontMetrics().height())
        self.form.changed.connect(self._validate)
        self.form.show_value(
            Preferences(
                theme=context.theme.name,
                font_pt=QApplication.font().pointSize(),
                displacements_in=UNITS.chosen_units["m"],
                velocities_in=UNITS.chosen_units["m/s"],
                accelerations_in=UNITS.chosen_units["m/s²"],
                patience_s=context.patience_s,
                recordings_folder=str(context.folder),
            )
        )

    def accept(self) -> None:
        """Apply the settings to the window and store them."""
        wanted = self.form.value
        if wanted is None:
            return
        if wanted.theme != self._context.theme.name:
            self._context.choose_theme(THEMES[wanted.theme])
        self._context.settings.keep_text(SettingKey.PATIENCE, f"{wanted.patience_s:g}")
        self._context.settings.keep_text(SettingKey.FONT, str(wanted.font_pt))
        self._context.choose_units(
            {"m": wanted.displacements_in, "m/s": wanted.velocities_in, "m/s²": wanted.accelerations_in}
        )
        font = QFont(QApplication.font())
        font.setPointSize(wanted.font_pt)
        QApplication.setFont(font)
        folder = Path(wanted.recordings_folder).expanduser()
        if folder != self._context.folder:
            self._context.choose_folder(folder)
        super().accept()

    def _validate(self) -> None:
        self.buttons.button(QDialogButtonBox.StandardButton.Ok).setEnabled(self.form.value is not None)


LONGEST_S = 60
"""Time limit for collecting the versions of this installation [s]."""


class Reader(QDialog):
    """Window that shows a text and does not block the main window; Ctrl+C copies the selection."""

    def __init__(self, title: str, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle(title)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.browser = QTextBrowser()
        self.browser.setAccessibleName(title)
        self.browser.setOpenExternalLinks(False)
        self.browser.setWordWrapMode(QTextOption.WrapMode.WrapAtWordBoundaryOrAnywhere)
        self.browser.sourceChanged.connect(self._fit)
        self.buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        self.buttons.rejected.connect(self.reject)
        fill_box(QVBoxLayout(self), self.browser, self.buttons)
        em = self.fontMetrics().height()
        self.resize(50 * em, 38 * em)

    def _fit(self, *_: object) -> None:
        """Wrap lines of code as well, so that the manual needs no horizontal scrolling."""
        block = self.browser.document().begin()
        while block.isValid():
            wrapped = block.blockFormat()
            wrapped.setNonBreakableLines(False)
            QTextCursor(block).setBlockFormat(wrapped)
            block = block.next()


def show_manual(parent: QWidget) -> Reader:
    """Show the manual's page about the window; its links lead to the other pages."""
    reader = Reader("Manual", parent)
    try:
        page = shipped_folder("docs") / "gui.md"
        reader.browser.setSource(QUrl.fromLocalFile(str(page)), QTextDocument.ResourceType.MarkdownResource)
    except ConfigurationError as error:
        reader.browser.setPlainText(str(error))
    back = push_button("&Back", "Back to the previous page", reader.browser.backward)
    reader.buttons.addButton(back, QDialogButtonBox.ButtonRole.ActionRole)
    reader.show()
    return reader


def installation_text() -> str:
    """Return the output of `vibench doctor`."""
    command = [sys.executable, "-m", "vibench.cli", "doctor"]
    result = subprocess.run(  # noqa: S603 - this interpreter, and our own package
        command, capture_output=True, text=True, check=False, timeout=LONGEST_S
    )
    return result.stdout or result.stderr


def show_about(parent: QWidget, context: AppContext) -> Reader:
    """Show the versions of this installation, as text that can be copied into a report."""
    reader = Reader("About vibench", parent)
    reader.browser.setPlainText("collecting the versions…")

    def copy() -> None:
        reader.browser.selectAll()
        reader.browser.copy()

    reader.buttons.addButton(
        push_button("&Copy", "Copy the whole text", copy), QDialogButtonBox.ButtonRole.ActionRole
    )
    job = context.background.ask(installation_text, reader.browser.setPlainText, context.fail)
    reader.finished.connect(lambda _result: job.drop())
    reader.show()
    return reader


ABORT_KEYS = frozenset({Qt.Key.Key_Escape, Qt.Key.Key_Pause})


class AbortKey(QObject):
    """Event filter that detects the abort key before any widget receives it.

    Unlike a shortcut, a filter of the whole application also works while a modal dialog is open. The key is
    passed on to the focused widget, so that Esc still closes a dialog.
    """

    pressed = Signal()

    def __init__(self, application: QApplication, parent: QObject) -> None:
        super().__init__(parent)
        self._last_seen: tuple[int, int] | None = None
        application.installEventFilter(self)

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        """Emit `pressed` for an abort key; pass every event on to its widget."""
        kind = event.type()
        if kind is QEvent.Type.KeyRelease:
            self._last_seen = None
        elif kind in (QEvent.Type.KeyPress, QEvent.Type.ShortcutOverride):
            assert isinstance(event, QKeyEvent)
            if event.key() in ABORT_KEYS and not event.isAutoRepeat() and self._is_new(event):
                self.pressed.emit()
        return False

    def _is_new(self, event: QKeyEvent) -> bool:
        """Return whether an event is a new key press; Qt delivers the same press several times."""
        seen = (event.timestamp(), event.key())
        is_new = seen != self._last_seen
        self._last_seen = seen
        return is_new


@dataclass(frozen=True)
class MenuAction:
    """Menu entry: its menu, its key, and its description in the list of keys."""

    menu: str
    text: str
    act: Callable[[], object]
    key: str = ""
    about: str = ""


OTHER_KEYS: tuple[tuple[str, str], ...] = (
    ("Esc, Pause", "abort from any page, with the fastest ramp of the shaker"),
    ("Space", "freeze the plots (Run page); the recording continues"),
    ("PgDn, PgUp", "scroll the description of the test (Run page)"),
    ("M", "mark an event in the recording (Run page)"),
    ("A, L", "in a plot: show everything, logarithmic axis"),
    ("G, D", "in a plot: read values; mark a point to read differences"),
    ("Ctrl+C", "copy a plot as a picture, or the selected cells of a table"),
    ("Menu key", "context menu of the focused plot or table"),
    ("F4, Alt+Down", "open the list of a combo box"),
)
"""Keys without a menu entry. No single letter starts the drive."""
EMERGENCY = "STOP is not an emergency stop: in an emergency, switch the amplifier off."


def key_text(actions: tuple[MenuAction, ...]) -> str:
    """Return the keys as a table in rich text."""
    keys = (
        *OTHER_KEYS,
        *((each.key, each.about or each.text.replace("&", "")) for each in actions if each.key),
    )
    rows = "".join(f"<tr><td><b>{key}</b>&nbsp;&nbsp;</td><td>{what}</td></tr>" for key, what in keys)
    return f"<table>{rows}</table>"


def menu_actions(window: "Window") -> tuple[MenuAction, ...]:
    """Return the actions of all menus, menu by menu."""
    context, actions = window.context, window.user_actions
    return (
        MenuAction("&File", "&Open…", lambda: _open(window), "Ctrl+O", "open any file"),
        MenuAction("&File", "Recordings &folder…", lambda: choose_folder(window, context)),
        MenuAction(
            "&File", "&Settings…", lambda: SettingsDialog(context, window).open(), "Ctrl+,", "settings"
        ),
        MenuAction("&File", "&Quit", window.close, "Ctrl+Q"),
        MenuAction("Edit", "&Undo", window.undo, "Ctrl+Z", "undo an edit of the test or campaign"),
        MenuAction("Edit", "&Redo", window.redo, "Ctrl+Shift+Z", "redo an undone edit"),
        MenuAction("&Test", "&Check the bench", actions.check, "F6"),
        MenuAction("&Test", "Check as a new &reference", partial(actions.check, new_reference=True)),
        MenuAction("&Test", "&Arm the test", actions.arm_test, "Ctrl+Return", "arm"),
        MenuAction("&Test", "S&tart", actions.start, "F5", "start what is armed"),
        MenuAction("&Test", "&Hold or go on", actions.hold_or_resume),
        MenuAction("&Test", "&Stop (ramp down)", actions.stop),
        MenuAction("&Test", "A&bort (Esc)", actions.abort),
        *(
            MenuAction(
                "&View", f"&{number}  {name}", partial(context.page_requested.emit, name), f"Ctrl+{number}"
            )
            for number, name in enumerate(window.pages, start=1)
        ),
        MenuAction(
            "&View",
            "&Light or dark",
            lambda: context.choose_theme(DARK if context.theme is LIGHT else LIGHT),
            "Ctrl+T",
        ),
        MenuAction("&View", "&Reset layout", window.reset_layout),
        MenuAction("Hel&p", "&Manual", lambda: show_manual(window), "Shift+F1", "the manual, offline"),
        MenuAction("Hel&p", "&About…", lambda: show_about(window, context), "", ""),
    )


def build_menus(window: "Window") -> None:
    """Add the menu bar to a window."""
    bar = window.menuBar()
    bar.setAccessibleName("Menus")
    table = menu_actions(window)
    keys = MenuAction("Hel&p", "&Keys", lambda: show_keys(window, (*table, keys)), "F1", "this list")
    menus = {name: bar.addMenu(name) for name in dict.fromkeys(each.menu for each in table)}
    for row in (*table, keys):
        action = menus[row.menu].addAction(row.text)
        action.setShortcut(QKeySequence(row.key))
        action.triggered.connect(lambda _checked=False, row=row: row.act())
    recent = QMenu("Open &recent", menus["&File"])
    menus["&File"].insertMenu(menus["&File"].actions()[1], recent)
    recent.aboutToShow.connect(lambda: _list_recent(recent, window))


def _list_recent(menu: QMenu, window: "Window") -> None:
    menu.clear()
    for path in window.context.recent_files:
        name = printable(str(path)).replace("&", "&&")
        menu.addAction(name).triggered.connect(lambda _checked=False, path=path: window.open_path(path))
    if not window.context.recent_files:
        menu.addAction("nothing yet").setEnabled(False)


def _open(window: "Window") -> None:
    given, _ = QFileDialog.getOpenFileName(
        window,
        "Open",
        str(window.context.folder),
        "Recordings, tests, campaigns, configurations (*.h5 *.part *.toml)",
    )
    if given:
        window.open_path(Path(given))


def choose_folder(parent: QWidget, context: AppContext) -> None:
    """Ask the user for the folder of new recordings."""
    chosen = QFileDialog.getExistingDirectory(parent, "Folder for recordings", str(context.folder))
    if chosen:
        context.choose_folder(Path(chosen))


def show_keys(parent: QWidget, actions: tuple[MenuAction, ...]) -> None:
    """Show the list of keys in a separate window, which does not block the main window."""
    text = f"{key_text(actions)}<p>{EMERGENCY}</p>"
    box = QMessageBox(QMessageBox.Icon.NoIcon, "Keys", text, parent=parent)
    box.setModal(False)
    box.show()
