"""Names and messages of files and instruments take no effect as markup or control characters."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import Qt as Text, QTextDocument

from vibench.gui.widgets import ElidedLabel, Notice, NoticeKind, ReadTable, SentenceLabel
from vibench.gui.window._message_strip import MessageStrip
from vibench.gui.window._status_line import StatusField, StatusLine

HOSTILE = "<img src='x'><h1>a\x1b[2J\u202eb\x9d</h1>"
SHOWN = r"<img src='x'><h1>a\x1b[2J\u202eb\x9d</h1>"


def read(tip):
    """What a tooltip shows."""
    document = QTextDocument()
    if Text.mightBeRichText(tip):
        document.setHtml(tip)
    else:
        document.setPlainText(tip)
    return document.toPlainText()


@pytest.mark.parametrize("kind", [ElidedLabel, SentenceLabel])
def test_a_label_shows_foreign_text_as_it_is_written(qtbot, kind):
    label = kind(HOSTILE)
    qtbot.addWidget(label)
    label.setToolTip(HOSTILE)
    assert label.text() == SHOWN
    assert label.textFormat() is Qt.TextFormat.PlainText
    assert read(label.toolTip()) == SHOWN


def test_a_table_shows_foreign_text_as_it_is_written(qtbot):
    table = ReadTable("findings", ("what",))
    qtbot.addWidget(table)
    table.show_rows([(HOSTILE,)])
    assert table.item(0, 0).text() == SHOWN
    assert read(table.item(0, 0).toolTip()) == SHOWN


def test_messages_and_status_show_foreign_text_as_it_is_written(qtbot):
    strip, status = MessageStrip(), StatusLine()
    qtbot.addWidget(strip)
    qtbot.addWidget(status)
    strip.say(Notice(NoticeKind.FAULT, HOSTILE))
    status.show_fields({StatusField.FILE: HOSTILE})
    assert SHOWN in strip._text.text()
    assert SHOWN in read(strip._text.toolTip())
    assert status.text_of(StatusField.FILE) == SHOWN
    assert read(status.tip_of(StatusField.FILE)) == SHOWN
