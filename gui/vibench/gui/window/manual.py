"""Help: the manual as it lies on this computer, and what this installation consists of."""

import subprocess
import sys

from PySide6.QtCore import Qt, QUrl
from PySide6.QtGui import QTextCursor, QTextDocument, QTextOption
from PySide6.QtWidgets import QDialog, QDialogButtonBox, QTextBrowser, QVBoxLayout, QWidget

from vibench.acquisition import ConfigurationError, shipped_folder

from ..page.app_context import AppContext
from ..widgets.boxes import filled
from ..widgets.notice import notice_of
from ..widgets.push_button import push_button

LONGEST_S = 60
"""That the versions may take to be found."""


class Reader(QDialog):
    """A text beside the window, which goes on meanwhile; what is chosen in it is copied with Ctrl+C."""

    def __init__(self, title: str, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle(title)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.browser = QTextBrowser()
        self.browser.setAccessibleName(title)
        self.browser.setOpenExternalLinks(False)
        self.browser.setWordWrapMode(QTextOption.WrapMode.WrapAtWordBoundaryOrAnywhere)
        self.browser.sourceChanged.connect(self._fit)
        self.buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        self.buttons.rejected.connect(self.reject)
        filled(QVBoxLayout(self), self.browser, self.buttons)
        em = self.fontMetrics().height()
        self.resize(50 * em, 38 * em)

    def _fit(self, *_: object) -> None:
        """Break lines of code too: a manual is not read sideways."""
        block = self.browser.document().begin()
        while block.isValid():
            wrapped = block.blockFormat()
            wrapped.setNonBreakableLines(False)
            QTextCursor(block).setBlockFormat(wrapped)
            block = block.next()


def show_manual(parent: QWidget) -> Reader:
    """Open the page on the window; its links lead to the other pages."""
    reader = Reader("Manual", parent)
    try:
        page = shipped_folder("docs") / "gui.md"
        reader.browser.setSource(QUrl.fromLocalFile(str(page)), QTextDocument.ResourceType.MarkdownResource)
    except ConfigurationError as error:
        reader.browser.setPlainText(str(error))
    back = push_button("&Back", "To the page before", reader.browser.backward)
    reader.buttons.addButton(back, QDialogButtonBox.ButtonRole.ActionRole)
    reader.show()
    return reader


def installation_text() -> str:
    """Give what `vibench doctor` says."""
    asked = [sys.executable, "-m", "vibench.cli", "doctor"]
    told = subprocess.run(  # noqa: S603 - this interpreter, and our own package
        asked, capture_output=True, text=True, check=False, timeout=LONGEST_S
    )
    return told.stdout or told.stderr


def show_about(parent: QWidget, context: AppContext) -> Reader:
    """Say what this installation consists of, for a question to others."""
    reader = Reader("About vibench", parent)
    reader.browser.setPlainText("looking at this installation…")

    def copy() -> None:
        reader.browser.selectAll()
        reader.browser.copy()

    def failed(error: BaseException) -> None:
        context.say(notice_of(error))

    reader.buttons.addButton(
        push_button("&Copy", "Copy all of it", copy), QDialogButtonBox.ButtonRole.ActionRole
    )
    job = context.background.ask(installation_text, reader.browser.setPlainText, failed)
    reader.finished.connect(lambda _result: job.drop())
    reader.show()
    return reader
