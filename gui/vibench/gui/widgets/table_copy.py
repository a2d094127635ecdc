"""Copying from a table, by Ctrl+C and by its context menu: tabs between cells, as spreadsheets take them."""

from collections.abc import Callable, Iterable

from PySide6.QtCore import QAbstractItemModel, QModelIndex, QPersistentModelIndex, Qt
from PySide6.QtGui import QAction, QGuiApplication, QKeySequence
from PySide6.QtWidgets import QTableView

Cell = QModelIndex | QPersistentModelIndex


def offer_copies(table: QTableView) -> None:
    """Let a table's cells be copied: those that are chosen, or all of them below their headings."""
    chosen = _offered(table, "Copy", lambda: chosen_text(table))
    chosen.setShortcut(QKeySequence.StandardKey.Copy)
    chosen.setShortcutContext(Qt.ShortcutContext.WidgetShortcut)
    _offered(table, "Copy the whole table", lambda: whole_text(table.model()))
    table.setContextMenuPolicy(Qt.ContextMenuPolicy.ActionsContextMenu)


def chosen_text(table: QTableView) -> str:
    """Give the chosen cells, rows by lines; everything while nothing is chosen."""
    return _lines(table.selectionModel().selectedIndexes()) or whole_text(table.model())


def whole_text(model: QAbstractItemModel) -> str:
    """Give the headings and all cells."""
    rows, columns = range(model.rowCount()), range(model.columnCount())
    headings = (str(model.headerData(column, Qt.Orientation.Horizontal) or "") for column in columns)
    return "\t".join(headings) + "\n" + _lines(model.index(row, column) for row in rows for column in columns)


def _lines(cells: Iterable[Cell]) -> str:
    rows: dict[int, list[str]] = {}
    for row, _, text in sorted((each.row(), each.column(), str(each.data() or "")) for each in cells):
        rows.setdefault(row, []).append(text)
    return "\n".join("\t".join(texts) for texts in rows.values())


def _offered(table: QTableView, text: str, said: Callable[[], str]) -> QAction:
    action = QAction(text, table)
    action.triggered.connect(lambda: QGuiApplication.clipboard().setText(said()))
    table.addAction(action)
    return action
