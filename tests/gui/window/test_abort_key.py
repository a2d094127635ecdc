"""Esc and Pause abort once from any focus."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QDialog, QLineEdit, QVBoxLayout, QWidget

from vibench.gui.window.menus import AbortKey


@pytest.fixture
def abort_signals(qapp):
    presses = []
    owner = QWidget()
    key = AbortKey(qapp, owner)
    key.pressed.connect(lambda: presses.append("abort"))
    yield presses
    qapp.removeEventFilter(key)


@pytest.mark.parametrize("key", [Qt.Key.Key_Escape, Qt.Key.Key_Pause])
def test_the_abort_key_works_in_a_field(qtbot, abort_signals, key):
    window = QWidget()
    field = QLineEdit(window)
    qtbot.addWidget(window)
    window.show()
    field.setFocus()
    qtbot.keyClick(field, key)
    assert abort_signals == ["abort"]


def test_the_abort_key_works_in_a_modal_dialog_and_closes_the_dialog(qtbot, closing, abort_signals):
    window = closing(QWidget())
    window.show()
    dialog = QDialog(window)
    dialog.setModal(True)
    field = QLineEdit(dialog)
    QVBoxLayout(dialog).addWidget(field)
    dialog.open()
    assert QApplication.activeModalWidget() is dialog
    qtbot.keyClick(field, Qt.Key.Key_Escape)
    assert abort_signals == ["abort"]
    assert not dialog.isVisible()


def test_other_keys_do_not_abort_a_run(qtbot, closing, abort_signals):
    field = closing(QLineEdit())
    qtbot.keyClicks(field, "stop 123")
    assert abort_signals == []


def test_every_press_of_the_abort_key_sends_an_abort(qtbot, closing, abort_signals):
    field = closing(QLineEdit())
    for _ in range(3):
        qtbot.keyClick(field, Qt.Key.Key_Escape)
    assert len(abort_signals) == 3
