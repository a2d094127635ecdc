"""PySide6 must not release references that it does not own: 6.12.0 crashes that way."""

import sys

import pytest
from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QWidget

CALLS = 1000
MOST = 50


class Bell(QObject):
    rang = Signal()


@pytest.mark.skipif(sys.version_info >= (3, 12), reason="None and True are immortal from Python 3.12 on")
def test_qt_calls_do_not_change_the_reference_counts_of_none_and_true(qtbot):
    widget, bell = QWidget(), Bell()
    qtbot.addWidget(widget)
    before = sys.getrefcount(None), sys.getrefcount(True)
    for _ in range(CALLS):
        widget.setEnabled(True)
        bell.rang.emit()
    after = sys.getrefcount(None), sys.getrefcount(True)
    assert abs(after[0] - before[0]) < MOST
    assert abs(after[1] - before[1]) < MOST
