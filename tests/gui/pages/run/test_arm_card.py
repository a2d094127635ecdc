"""A run can start only after the whole plan was shown, also in a small window."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QFont

from vibench.acquisition.engine import ArmedPlan, EngineState, EngineStatus, Supervision
from vibench.gui.pages.run.run_page import UNREAD
from vibench.gui.widgets.notice import RUN

LINES = tuple(
    f"Line {number}: what is played, how loud, and under which limits it is stopped." for number in range(20)
)


def armed_status(campaign, lines):
    armed = ArmedPlan(
        campaign=campaign,
        folder="recordings",
        lines=lines,
        expires_in_s=60.0,
        attendance=Supervision.ATTENDED,
        patience_s=2.0,
    )
    return EngineStatus(state=EngineState.ARMED, attendance=Supervision.ATTENDED, armed=armed)


@pytest.fixture
def small(lasting_window, qapp, qtbot):
    """The Run page of a small window with a large font; the armed plan does not fit."""
    font = QFont(qapp.font())
    large = QFont(font)
    large.setPointSize(14)
    qapp.setFont(large)
    window = lasting_window
    window._timer.stop()
    window.resize(1024, 700)
    window.show_page(RUN)
    qtbot.waitUntil(lambda: window.is_themed)
    page, status = window.pages[RUN], armed_status("night", LINES)
    page.arm_card.show_status(status, "", "")
    yield page, status
    qapp.setFont(font)


def show(page, status, qapp):
    for _ in range(4):
        qapp.processEvents()
    page.arm_card.show_status(status, "", "")


@pytest.mark.thorough
def test_the_start_button_is_enabled_only_after_the_plan_was_scrolled_to_its_end(small, qapp, qtbot):
    page, status = small
    show(page, status, qapp)
    card, bar = page.arm_card, page._parts.side.verticalScrollBar()
    assert card.words.height() >= card.words.heightForWidth(card.words.width()), "no line is cut"
    assert bar.value() == 0
    assert not card.is_read
    assert not card.start_button.isEnabled()
    assert card.start_button.text() == UNREAD
    assert all(each.isVisible() for each in (card.cancel_button, card.start_button))
    presses = 0
    while not card.is_read:
        qtbot.keyClick(page, Qt.Key.Key_PageDown)
        show(page, status, qapp)
        presses += 1
        assert presses < 10
    assert presses >= 1
    assert card.start_button.isEnabled()
    bar.setValue(0)
    show(page, status, qapp)
    assert card.is_read, "it has been read once"


@pytest.mark.thorough
def test_a_new_armed_plan_is_shown_from_its_beginning(small, qapp):
    page, status = small
    show(page, status, qapp)
    bar = page._parts.side.verticalScrollBar()
    page._parts.side.ensureVisible(0, page.arm_card.geometry().bottom())
    show(page, status, qapp)
    assert page.arm_card.is_read
    other = status.model_copy(update={"armed": status.armed.model_copy(update={"campaign": "another"})})
    page.arm_card.show_status(other, "", "")
    assert bar.value() == 0
    show(page, other, qapp)
    assert not page.arm_card.is_read


@pytest.mark.thorough
def test_a_plan_that_fits_into_the_window_can_be_started_at_once(lasting_window, qapp):
    window = lasting_window
    window._timer.stop()
    window.resize(1280, 800)
    window.show_page(RUN)
    page, status = window.pages[RUN], armed_status("short", LINES[:5])
    page.arm_card.show_status(status, "", "")
    show(page, status, qapp)
    assert page.arm_card.is_read
