"""Actions of a plot by key or context menu, such as saving it as a picture or as numbers."""

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QBuffer, QRect, Qt
from PySide6.QtGui import QAction, QGuiApplication, QKeySequence, QPainter
from PySide6.QtSvg import QSvgGenerator
from PySide6.QtWidgets import QMessageBox

from vibench.sim.operating_system.this import replace_file

from ..widgets.boxes import new_path, plain_tip

if TYPE_CHECKING:
    from .plot import Plot

FILTERS = "PNG (*.png);;SVG (*.svg);;Numbers as CSV (*.csv)"


def add_actions(plot: "Plot") -> None:
    """Add all actions to a plot; other keys are passed on to the page."""
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


def save_plot(plot: "Plot") -> None:
    """Ask for a path; save the picture or the numbers there."""
    wish = Path(f"{plot.accessibleName().lower().replace(' ', '_')}.png")
    path = new_path(plot, "Save picture or numbers", wish, FILTERS)
    if path is None:
        return
    try:
        write_plot(plot, path)
    except OSError as error:
        why = plain_tip(f"{path} was not written: {error.strerror}. Choose another name.")
        QMessageBox.warning(plot, "Not written", why)


def write_plot(plot: "Plot", path: Path) -> None:
    """Write the picture or the numbers, in the format of the path's suffix.

    Raises OSError when the file exists, cannot be written, or has another suffix.
    """
    if path.exists():
        raise FileExistsError(0, "it exists already")
    memory = QBuffer()  # Qt writes to memory, because it does not report every disk error
    match path.suffix.lower():
        case ".csv":
            memory.setData(numbers_of(plot, ",").encode())
        case ".svg":
            generator = QSvgGenerator()
            generator.setOutputDevice(memory)
            generator.setSize(plot.size())
            generator.setViewBox(QRect(0, 0, plot.width(), plot.height()))
            # With any other resolution of the picture, axes and curves would not line up.
            generator.setResolution(plot.logicalDpiX())
            painter = QPainter(generator)
            plot.render(painter)
            painter.end()
        case ending:
            if not plot.grab().save(memory, ending.removeprefix(".")):
                raise OSError(0, "the name must end in .png, .svg or .csv")
    with replace_file(path) as coming:
        coming.write_bytes(memory.data().data())


def numbers_of(plot: "Plot", separator: str) -> str:
    """Return the curves as text lines with name, x and y, in the displayed units."""
    across, up = plot.across.axis, plot.up.axis
    rows = [separator.join(("Curve", across.text, up.text))]
    for number, (name, item) in enumerate(plot.named_curves):
        if item.xData is not None and item.yData is not None:
            called = (name or f"{plot.accessibleName()} {number + 1}").replace(separator, ";")
            rows += [
                f"{called}{separator}{x * across.display.per_si:.9g}{separator}{y * up.display.per_si:.9g}"
                for x, y in zip(item.xData.tolist(), item.yData.tolist(), strict=True)
            ]
    return "\n".join(rows) + "\n"
