"""Every table can be copied by key and by context menu."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QAbstractItemView, QTableView

from vibench.gui.widgets.read_table import ReadTable


@pytest.fixture
def table(qapp, qtbot, closing):
    made = closing(ReadTable("Loads", ("used", "quantity", "limit")))
    made.show_rows([("12 %", "stroke", "10 mm"), ("3 %", "force", "20 N")])
    made.show()
    made.activateWindow()
    made.setFocus()
    qtbot.waitUntil(made.hasFocus)
    return made


def clipboard():
    return QGuiApplication.clipboard().text()


def test_copying_a_table_copies_the_selected_rows_or_else_all_rows(table, qtbot):
    qtbot.keyClick(table, Qt.Key.Key_C, Qt.KeyboardModifier.ControlModifier)
    whole = "used\tquantity\tlimit\n12 %\tstroke\t10 mm\n3 %\tforce\t20 N"
    assert clipboard() == whole
    table.selectRow(1)
    qtbot.keyClick(table, Qt.Key.Key_C, Qt.KeyboardModifier.ControlModifier)
    assert clipboard() == "3 %\tforce\t20 N"
    next(each for each in table.actions() if "whole" in each.text()).trigger()
    assert clipboard() == whole


@pytest.mark.thorough
def test_every_table_of_the_window_can_be_copied(window):
    tables = [each for each in window.findChildren(QTableView) if isinstance(each, QAbstractItemView)]
    assert len(tables) >= 8
    for each in tables:
        assert [action.text() for action in each.actions()] == ["Copy", "Copy the whole table"], each
        assert each.contextMenuPolicy() is Qt.ContextMenuPolicy.ActionsContextMenu


@pytest.mark.parametrize("width", [120, 240, 900])
def test_the_last_column_stays_readable_in_a_narrow_table(qtbot, closing, width):
    made = closing(ReadTable("Findings", ("finding", "measured", "expected")))
    made.resize(width, 200)
    made.show()
    made.show_rows([("calibration of the converter", "2026-02-10", "at most 730 days before")])
    least = 12 * made.fontMetrics().averageCharWidth()
    qtbot.waitUntil(lambda: made.columnWidth(2) >= least)
