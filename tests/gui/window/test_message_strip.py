"""A message says what happened, what was done and what to do, and stays until it is read."""

from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QLabel, QPlainTextEdit, QPushButton

from vibench.acquisition import LimitExceeded
from vibench.gui.widgets import Notice, NoticeKind, notice_of
from vibench.gui.window._message_strip import MessageStrip


def shown(strip):
    return strip.findChild(QLabel).text()


def button(strip, text):
    return next(each for each in strip.findChildren(QPushButton) if each.text() == text)


def test_the_three_parts_stand_in_the_strip(qtbot):
    strip = MessageStrip()
    qtbot.addWidget(strip)
    strip.say(Notice(NoticeKind.WARNING, "The disk is nearly full.", "Recording goes on.", "Make room."))
    text = shown(strip)
    assert (
        text.index("The disk is nearly full.") < text.index("Recording goes on.") < text.index("Make room.")
    )
    assert text.startswith("⚠")


def test_copy_puts_everything_on_the_clipboard(qtbot):
    strip = MessageStrip()
    qtbot.addWidget(strip)
    strip.say(notice_of(LimitExceeded("noise: the stroke would be 5 mm")))
    button(strip, "Copy").click()
    assert QGuiApplication.clipboard().text() == "FAULT: [LimitExceeded] noise: the stroke would be 5 mm"


def test_dismissed_messages_can_still_be_read_in_details(qtbot):
    strip = MessageStrip()
    qtbot.addWidget(strip)
    strip.say(Notice(NoticeKind.INFO, "first"))
    button(strip, "Dismiss").click()
    assert strip.isHidden()
    strip.say(Notice(NoticeKind.INFO, "second"))
    button(strip, "Details").click()
    details = strip.findChild(QPlainTextEdit)
    assert not details.isHidden()
    assert details.toPlainText() == "INFO: second\n\nINFO: first"


def test_information_gives_way_to_what_begins_and_a_warning_does_not(qtbot):
    strip = MessageStrip()
    qtbot.addWidget(strip)
    for kind, stays in ((NoticeKind.INFO, False), (NoticeKind.WARNING, True), (NoticeKind.FAULT, True)):
        strip.say(Notice(kind, "The campaign before this one ended."))
        strip.give_way()
        assert strip.isVisibleTo(None) is stays
    assert len(strip.notices) == 3
