"""The menus: everything that a key or a click can do, in words."""

from collections.abc import Callable
from pathlib import Path

from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QFileDialog, QMainWindow, QMessageBox

from ..page import Desk, Orders
from ..widgets import DARK, LIGHT, Theme
from ._key_list import key_text

EMERGENCY = "STOP is not an emergency stop: in an emergency, switch the amplifier off."


def build_menus(
    window: QMainWindow, desk: Desk, orders: Orders, pages: tuple[str, ...], reset_layout: Callable[[], None]
) -> None:
    """Put the menus on a window."""
    bar = window.menuBar()
    bar.setAccessibleName("Menus")
    file = bar.addMenu("&File")
    _add(file.addAction("Recordings &folder…"), "", lambda: choose_folder(window, desk))
    _add(file.addAction("&Quit"), "Ctrl+Q", window.close)
    test = bar.addMenu("&Test")
    _add(test.addAction("&Check the bench"), "F6", orders.check)
    _add(test.addAction("&Arm the test"), "Ctrl+Return", orders.arm_test)
    _add(test.addAction("S&tart"), "F5", orders.start)
    _add(test.addAction("&Hold or go on"), "", orders.hold_or_resume)
    _add(test.addAction("&Stop (ramp down)"), "", orders.stop)
    _add(test.addAction("A&bort (Esc)"), "", orders.abort)
    view = bar.addMenu("&View")
    for number, name in enumerate(pages, start=1):
        _add(view.addAction(f"&{number}  {name}"), f"Ctrl+{number}", _showing(desk, name))
    view.addSeparator()
    _add(view.addAction("&Light or dark"), "Ctrl+T", lambda: desk.choose_theme(_other(desk)))
    _add(view.addAction("&Reset layout"), "", reset_layout)
    help_menu = bar.addMenu("Hel&p")
    _add(help_menu.addAction("&Keys"), "F1", lambda: show_keys(window))


def choose_folder(window: QMainWindow, desk: Desk) -> None:
    """Ask where recordings go from now on."""
    chosen = QFileDialog.getExistingDirectory(window, "Folder for recordings", str(desk.folder))
    if chosen:
        desk.choose_folder(Path(chosen))


def show_keys(window: QMainWindow) -> None:
    """List the keys beside the window, which goes on meanwhile."""
    box = QMessageBox(QMessageBox.Icon.NoIcon, "Keys", f"{key_text()}<p>{EMERGENCY}</p>", parent=window)
    box.setModal(False)
    box.show()


def _add(action: QAction, key: str, act: Callable[[], object]) -> None:
    if key:
        action.setShortcut(QKeySequence(key))
    action.triggered.connect(lambda _checked=False: act())


def _showing(desk: Desk, name: str) -> Callable[[], None]:
    return lambda: desk.page_wanted.emit(name)


def _other(desk: Desk) -> Theme:
    return DARK if desk.theme is LIGHT else LIGHT
