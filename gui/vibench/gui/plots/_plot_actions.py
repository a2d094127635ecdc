"""What can be done with a plot: by a key while it has the focus, and by its context menu."""

from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QGuiApplication, QKeySequence

from ._saved_plot import numbers_of, save_plot

if TYPE_CHECKING:
    from ._plot import Plot


def add_actions(plot: "Plot") -> None:
    """Offer everything; the page keeps its own keys, which a plot hands on."""
    clipboard = QGuiApplication.clipboard()
    for text, key, act in (
        ("Show everything", "A", plot.show_everything),
        ("Linear or logarithmic", "L", plot.turn_scale),
        ("Read values", "G", plot.reading.on_or_off),
        ("Differences from here", "D", plot.reading.mark_or_unmark),
        ("Copy the picture", "Ctrl+C", lambda: clipboard.setPixmap(plot.grab())),
        ("Copy the numbers", "", lambda: clipboard.setText(numbers_of(plot, "\t"))),
        ("Save picture or numbers…", "", lambda: save_plot(plot)),
    ):
        action = QAction(text, plot)
        action.setShortcut(QKeySequence(key))
        action.setShortcutContext(Qt.ShortcutContext.WidgetShortcut)
        action.setShortcutVisibleInContextMenu(True)
        action.triggered.connect(act)
        plot.addAction(action)
    plot.setContextMenuPolicy(Qt.ContextMenuPolicy.ActionsContextMenu)
