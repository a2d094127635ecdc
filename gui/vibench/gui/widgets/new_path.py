"""Where a new file goes: nothing is overwritten, so the dialog does not ask about it."""

from pathlib import Path

from PySide6.QtWidgets import QFileDialog, QWidget


def new_path(parent: QWidget, title: str, wish: Path, filters: str) -> Path | None:
    """Ask for the path of a new file, with the ending of the chosen filter where none is typed."""
    options = QFileDialog.Option.DontConfirmOverwrite
    given, kind = QFileDialog.getSaveFileName(parent, title, str(wish), filters, options=options)
    if not given:
        return None
    path = Path(given)
    return path if path.suffix else path.with_suffix(kind[kind.index("*") + 1 : kind.index(")")])
