"""A message shows event, reaction and advice, and stays until it is dismissed."""

import pytest
from PySide6.QtCore import QPoint
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QLabel, QPlainTextEdit, QPushButton

from vibench.acquisition import LimitExceeded
from vibench.gui.widgets.notice import Notice, NoticeKind, notice_of
from vibench.gui.window.banner import MessageStrip


def shown_text(strip):
    return strip.findChild(QLabel).text()


def button(strip, text):
    return next(each for each in strip.findChildren(QPushButton) if each.text() == text)


def test_the_message_strip_shows_the_event_the_reaction_and_advice(closing):
    strip = closing(MessageStrip())
    strip.say(Notice(NoticeKind.WARNING, "The disk is nearly full.", "Recording goes on.", "Make room."))
    text = shown_text(strip)
    assert (
        text.index("The disk is nearly full.") < text.index("Recording goes on.") < text.index("Make room.")
    )
    assert text.startswith("⚠")


def test_the_copy_button_puts_the_whole_message_on_the_clipboard(closing):
    strip = closing(MessageStrip())
    strip.say(notice_of(LimitExceeded("noise: the stroke would be 5 mm")))
    button(strip, "Copy").click()
    assert QGuiApplication.clipboard().text() == "FAULT: [LimitExceeded] noise: the stroke would be 5 mm"


def test_dismissed_messages_remain_in_the_details(closing):
    strip = closing(MessageStrip())
    strip.say(Notice(NoticeKind.INFO, "first"))
    button(strip, "Dismiss").click()
    assert not strip.is_said
    strip.say(Notice(NoticeKind.INFO, "second"))
    button(strip, "Details").click()
    details = strip.findChild(QPlainTextEdit)
    assert not details.isHidden()
    assert details.toPlainText() == "INFO: second\n\nINFO: first"


def test_a_message_disappears_after_a_success_and_remains_in_the_details(closing):
    strip = closing(MessageStrip())
    for kind in NoticeKind:
        strip.say(Notice(kind, "Nothing is armed."))
        assert strip.is_said
        strip.dismiss()
        assert not strip.is_said
    assert len(strip.notices) == 3


@pytest.mark.thorough
def test_messages_that_appear_do_not_move_clickable_widgets(window, qapp):
    """The page moved down and put "Check bench" in the place of "Find instruments"."""

    def places():
        qapp.processEvents()
        return {
            each: each.mapTo(window, QPoint(0, 0)) for each in window.page.findChildren(QPushButton)
        }  # fmt: skip

    before = places()
    for text in ("short", "a long one, " * 60):
        window.strip.say(Notice(NoticeKind.FAULT, text, text, text))
        assert places() == before
        button(window.strip, "Details").click()
        assert places() == before
    window.strip.dismiss()
    assert places() == before
    assert window.strip.isVisible()
    window.tick()
    assert "Alt+O" in shown_text(window.strip)
