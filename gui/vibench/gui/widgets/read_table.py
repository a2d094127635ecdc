"""Read-only table whose cells can be copied, and bars in its cells."""

from collections.abc import Callable, Iterable, Sequence

from PySide6.QtCore import QAbstractItemModel, QModelIndex, QPersistentModelIndex, QRectF, Qt, QTimer
from PySide6.QtGui import QAction, QColor, QGuiApplication, QKeySequence, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTableView,
    QTableWidget,
    QTableWidgetItem,
)

from .boxes import hint_in_list, plain_lines, plain_tip
from .units import UNITS

Cell = QModelIndex | QPersistentModelIndex


def make_readable(table: QTableView, name: str) -> None:
    """Make a table read-only; add actions that copy the selected cells, or all cells with headings."""
    table.setAccessibleName(name)
    table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
    table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
    table.setAlternatingRowColors(True)
    table.setShowGrid(False)
    table.setTabKeyNavigation(False)
    table.verticalHeader().hide()
    header = table.horizontalHeader()
    header.setDefaultAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
    header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
    chosen = _copy_action(
        table, "Copy", lambda: _lines(table.selectionModel().selectedIndexes()) or whole_text(table.model())
    )
    chosen.setShortcut(QKeySequence.StandardKey.Copy)
    chosen.setShortcutContext(Qt.ShortcutContext.WidgetShortcut)
    _copy_action(table, "Copy the whole table", lambda: whole_text(table.model()))
    table.setContextMenuPolicy(Qt.ContextMenuPolicy.ActionsContextMenu)


def whole_text(model: QAbstractItemModel) -> str:
    """Return headings and all cells as text, separated by tabs."""
    rows, columns = range(model.rowCount()), range(model.columnCount())
    headings = (str(model.headerData(column, Qt.Orientation.Horizontal) or "") for column in columns)
    return "\t".join(headings) + "\n" + _lines(model.index(row, column) for row in rows for column in columns)


def _lines(cells: Iterable[Cell]) -> str:
    rows: dict[int, list[str]] = {}
    for row, _, text in sorted((each.row(), each.column(), str(each.data() or "")) for each in cells):
        rows.setdefault(row, []).append(text)
    return "\n".join("\t".join(texts) for texts in rows.values())


def _copy_action(table: QTableView, text: str, clipboard_text: Callable[[], str]) -> QAction:
    action = QAction(text, table)
    action.triggered.connect(lambda: QGuiApplication.clipboard().setText(clipboard_text()))
    table.addAction(action)
    return action


_WIDEST_LETTERS = 36
"""Largest width of a column that fits its content, in letters; longer text is wrapped."""
_LEAST_LETTERS = 14
"""Smallest width of the wide column, in letters; if there is less space, the table scrolls."""
_ROW_ROOM = 8
"""Extra height of rows with several lines [pixels], so that neighbouring rows do not touch."""


class ReadTable(QTableWidget):
    """Read-only table. One column takes the remaining width and wraps its text.

    Parameters
    ----------
    name
        Name for screen readers.
    columns
        Headings.
    hint
        Text shown while the table is empty.
    wide
        Index of the column that takes the remaining width; by default the last column.
    """

    def __init__(
        self,
        name: str,
        columns: Sequence[str],
        hint: str = "",
        wide: int = -1,
    ) -> None:
        super().__init__(0, len(columns))
        make_readable(self, name)
        self.setHorizontalHeaderLabels(list(columns))
        self.setWordWrap(True)
        self._wide = range(len(columns))[wide]
        widest = _WIDEST_LETTERS * self.fontMetrics().averageCharWidth()
        self.horizontalHeader().setMaximumSectionSize(widest)
        self._hint = hint
        self._shown: tuple[tuple[tuple[str, ...], ...], tuple[str, ...]] = ((), ())
        UNITS.on_change(self._write)
        # The width changes in many steps: fit the row heights only after the last step.
        self._later = QTimer(self, interval=0, singleShot=True)
        self._later.timeout.connect(self._fit)

    def show_rows(self, rows: Sequence[Sequence[str]], tips: Sequence[str] = ()) -> None:
        """Show rows, each with an optional tooltip; unchanged rows are not rewritten."""
        wanted = tuple(tuple(row) for row in rows), tuple(tips)
        if wanted == self._shown:
            return
        self._shown = wanted
        self.setRowCount(len(rows))
        for number, row in enumerate(rows):
            for column in range(len(row)):
                self.setItem(number, column, QTableWidgetItem())
        self._write()

    def _write(self) -> None:
        rows, tips = self._shown
        for number, row in enumerate(rows):
            for column, text in enumerate(row):
                item = self.item(number, column)
                if isinstance(item, QTableWidgetItem):
                    item.setText(UNITS.convert(plain_lines(text)))
                    item.setToolTip(plain_tip(UNITS.convert(tips[number] if tips else text)))
        self._later.start()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Fit the row heights to the new width."""
        super().resizeEvent(event)
        self._later.start()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the hint in an empty table."""
        super().paintEvent(event)
        if self._hint and self.rowCount() == 0:
            hint_in_list(self, self._hint)

    def _fit(self) -> None:
        header, wide = self.horizontalHeader(), self._wide
        least = _LEAST_LETTERS * self.fontMetrics().averageCharWidth()
        others = sum(header.sectionSize(each) for each in range(self.columnCount()) if each != wide)
        if self.viewport().width() - others < least:
            header.setSectionResizeMode(wide, QHeaderView.ResizeMode.Fixed)
            header.resizeSection(wide, least)
        else:
            header.setSectionResizeMode(wide, QHeaderView.ResizeMode.Stretch)
        self.resizeRowsToContents()
        one_line = self.verticalHeader().defaultSectionSize()
        for row in range(self.rowCount()):
            if self.rowHeight(row) > one_line:
                self.setRowHeight(row, self.rowHeight(row) + _ROW_ROOM)


SHARE_ROLE = Qt.ItemDataRole.UserRole + 1
"""Item role under which a table cell stores the length of its bar; 1 is the cell's whole width."""
OVER = "#b3261e"
NEAR = "#a06a00"
WELL = "#00694d"
NEAR_SHARE = 0.8


class BarDelegate(QStyledItemDelegate):
    """Delegate that paints a bar in a table cell; for a value above 1 the bar is full and red."""

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Cell) -> None:
        """Paint the bar below the text."""
        share = index.data(SHARE_ROLE)
        if isinstance(share, float):
            area = QRectF(option.rect).adjusted(2, 3, -2, -3)
            area.setWidth(area.width() * min(share, 1.0))
            painter.save()
            colour = QColor(OVER if share > 1 + 1e-9 else NEAR if share > NEAR_SHARE else WELL)
            colour.setAlphaF(0.35)
            painter.fillRect(area, colour)
            painter.restore()
        super().paint(painter, option, index)
