"""Esc and Pause are heard once, wherever the focus is."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QDialog, QLineEdit, QMenu, QVBoxLayout, QWidget

from vibench.gui.window.menus import AbortKey


@pytest.fixture
def heard(qapp):
    presses = []
    owner = QWidget()
    key = AbortKey(qapp, owner)
    key.pressed.connect(lambda: presses.append("abort"))
    yield presses
    qapp.removeEventFilter(key)


@pytest.mark.parametrize("key", [Qt.Key.Key_Escape, Qt.Key.Key_Pause])
def test_the_abort_key_works_in_a_field(qtbot, heard, key):
    window = QWidget()
    field = QLineEdit(window)
    qtbot.addWidget(window)
    window.show()
    field.setFocus()
    qtbot.keyClick(field, key)
    assert heard == ["abort"]


def test_the_abort_key_works_in_a_modal_dialog_and_closes_it(qtbot, heard):
    window = QWidget()
    qtbot.addWidget(window)
    window.show()
    dialog = QDialog(window)
    dialog.setModal(True)
    field = QLineEdit(dialog)
    QVBoxLayout(dialog).addWidget(field)
    dialog.open()
    assert QApplication.activeModalWidget() is dialog
    qtbot.keyClick(field, Qt.Key.Key_Escape)
    assert heard == ["abort"]
    assert not dialog.isVisible()


def test_the_abort_key_works_in_an_open_menu(qtbot, heard):
    menu = QMenu()
    menu.addAction("one")
    qtbot.addWidget(menu)
    menu.popup(menu.pos())
    qtbot.keyClick(menu, Qt.Key.Key_Escape)
    assert heard == ["abort"]


def test_other_keys_do_not_abort(qtbot, heard):
    field = QLineEdit()
    qtbot.addWidget(field)
    qtbot.keyClicks(field, "stop 123")
    assert heard == []


def test_repeated_presses_all_count(qtbot, heard):
    field = QLineEdit()
    qtbot.addWidget(field)
    for _ in range(3):
        qtbot.keyClick(field, Qt.Key.Key_Escape)
    assert len(heard) == 3
