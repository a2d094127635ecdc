"""The menus, and the keys as F1 lists them; Esc and Pause abort from dialogs and open menus too."""

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QEvent, QObject, Qt, Signal
from PySide6.QtGui import QAction, QKeyEvent, QKeySequence
from PySide6.QtWidgets import QApplication, QFileDialog, QMainWindow, QMessageBox

from ..page import AppContext, UserActions
from ..widgets import DARK, LIGHT, Theme

ABORT_KEYS = frozenset({Qt.Key.Key_Escape, Qt.Key.Key_Pause})


class AbortKey(QObject):
    """Receives every key press of the application before any widget does.

    A shortcut does not act while a modal dialog is open; a filter on the application does. The key goes
    on to whoever has the focus, so that Esc still closes a dialog.
    """

    pressed = Signal()

    def __init__(self, application: QApplication, parent: QObject) -> None:
        super().__init__(parent)
        self._last_seen: tuple[int, int] | None = None
        application.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Watch for the keys, and let everything pass."""
        if event.type() is QEvent.Type.KeyRelease:
            self._last_seen = None
        elif event.type() in (QEvent.Type.KeyPress, QEvent.Type.ShortcutOverride):
            assert isinstance(event, QKeyEvent)
            if event.key() in ABORT_KEYS and not event.isAutoRepeat() and self._is_new(event):
                self.pressed.emit()
        return super().eventFilter(watched, event)

    def _is_new(self, event: QKeyEvent) -> bool:
        """One press comes by several times: as an override, at the window, and at its widget."""
        seen = (event.timestamp(), event.key())
        is_new = seen != self._last_seen
        self._last_seen = seen
        return is_new


KEYS: tuple[tuple[str, str], ...] = (
    ("Esc, Pause", "abort: ramp down as fast as the shaker bears, from anywhere"),
    ("Ctrl+1 … Ctrl+7", "show a page"),
    ("F1", "this list"),
    ("F5", "start what is armed"),
    ("F6", "check the bench"),
    ("Ctrl+Return", "arm"),
    ("Space", "freeze the picture (Run page); the recording goes on"),
    ("M", "mark an event in the recording (Run page)"),
    ("A, L", "autoscale, logarithmic axis (in a plot)"),
    ("Ctrl+T", "light or dark"),
    ("Ctrl+C", "copy the message, or the picture of a plot"),
    ("Ctrl+Q", "quit"),
)
"""No bare letter ever starts an output."""


def key_text() -> str:
    """Lay the keys out as rows of a table, for rich text."""
    rows = "".join(f"<tr><td><b>{key}</b>&nbsp;&nbsp;</td><td>{what}</td></tr>" for key, what in KEYS)
    return f"<table>{rows}</table>"


EMERGENCY = "STOP is not an emergency stop: in an emergency, switch the amplifier off."


def build_menus(
    window: QMainWindow,
    context: AppContext,
    actions: UserActions,
    pages: tuple[str, ...],
    reset_layout: Callable[[], None],
) -> None:
    """Put the menus on a window."""
    bar = window.menuBar()
    bar.setAccessibleName("Menus")
    file = bar.addMenu("&File")
    _add(file.addAction("Recordings &folder…"), "", lambda: choose_folder(window, context))
    _add(file.addAction("&Quit"), "Ctrl+Q", window.close)
    test = bar.addMenu("&Test")
    _add(test.addAction("&Check the bench"), "F6", actions.check)
    _add(test.addAction("&Arm the test"), "Ctrl+Return", actions.arm_test)
    _add(test.addAction("S&tart"), "F5", actions.start)
    _add(test.addAction("&Hold or go on"), "", actions.hold_or_resume)
    _add(test.addAction("&Stop (ramp down)"), "", actions.stop)
    _add(test.addAction("A&bort (Esc)"), "", actions.abort)
    view = bar.addMenu("&View")
    for number, name in enumerate(pages, start=1):
        _add(view.addAction(f"&{number}  {name}"), f"Ctrl+{number}", _showing(context, name))
    view.addSeparator()
    _add(view.addAction("&Light or dark"), "Ctrl+T", lambda: context.choose_theme(_other(context)))
    _add(view.addAction("&Reset layout"), "", reset_layout)
    help_menu = bar.addMenu("Hel&p")
    _add(help_menu.addAction("&Keys"), "F1", lambda: show_keys(window))


def choose_folder(window: QMainWindow, context: AppContext) -> None:
    """Ask where recordings go from now on."""
    chosen = QFileDialog.getExistingDirectory(window, "Folder for recordings", str(context.folder))
    if chosen:
        context.choose_folder(Path(chosen))


def show_keys(window: QMainWindow) -> None:
    """List the keys beside the window, which goes on meanwhile."""
    box = QMessageBox(QMessageBox.Icon.NoIcon, "Keys", f"{key_text()}<p>{EMERGENCY}</p>", parent=window)
    box.setModal(False)
    box.show()


def _add(action: QAction, key: str, act: Callable[[], object]) -> None:
    if key:
        action.setShortcut(QKeySequence(key))
    action.triggered.connect(lambda _checked=False: act())


def _showing(context: AppContext, name: str) -> Callable[[], None]:
    return lambda: context.page_wanted.emit(name)


def _other(context: AppContext) -> Theme:
    return DARK if context.theme is LIGHT else LIGHT
