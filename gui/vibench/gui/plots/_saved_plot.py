"""Writing a plot down: its picture as PNG or SVG, its numbers as CSV."""

from pathlib import Path

from PySide6.QtCore import QRect
from PySide6.QtGui import QPainter
from PySide6.QtSvg import QSvgGenerator
from PySide6.QtWidgets import QFileDialog, QGraphicsView, QMessageBox

FILTERS = "PNG (*.png);;SVG (*.svg);;Numbers as CSV (*.csv)"


def save_plot(plot: QGraphicsView) -> None:
    """Ask where to, and write picture or numbers there."""
    wish = f"{plot.accessibleName().lower().replace(' ', '_')}.png"
    options = QFileDialog.Option.DontConfirmOverwrite
    given, kind = QFileDialog.getSaveFileName(plot, "Save picture or numbers", wish, FILTERS, options=options)
    if not given:
        return
    path = Path(given)
    path = path if path.suffix else path.with_suffix(kind[kind.index("*") + 1 : kind.index(")")])
    try:
        write_plot(plot, path)
    except OSError as error:
        QMessageBox.warning(
            plot, "Not written", f"{path} was not written: {error.strerror}. Choose another name."
        )


def write_plot(plot: QGraphicsView, path: Path) -> None:
    """Write picture or numbers, as the ending says; nothing is overwritten.

    Raises
    ------
    OSError
        When something of that name is there, or the file cannot be written.

    """
    path.open("xb").close()
    match path.suffix.lower():
        case ".csv":
            path.write_text(plot.numbers(), encoding="utf-8")  # type: ignore[attr-defined] # a Plot
        case ".svg":
            _write_svg(plot, path)
        case _:
            if not plot.grab().save(str(path)):
                path.unlink()
                raise OSError(0, "give an ending: .png, .svg or .csv")


def _write_svg(plot: QGraphicsView, path: Path) -> None:
    generator = QSvgGenerator()
    generator.setFileName(str(path))
    generator.setSize(plot.size())
    generator.setViewBox(QRect(0, 0, plot.width(), plot.height()))
    # With the usual resolution axes and curves would be shifted against each other.
    generator.setResolution(plot.logicalDpiX())
    painter = QPainter(generator)
    plot.render(painter)
    painter.end()
