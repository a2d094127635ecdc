"""The banner shows the state by symbol and word and contains STOP."""

import pytest
from PySide6.QtWidgets import QLabel, QPushButton

from vibench.gui.widgets.theme import DARK, LIGHT, Tone
from vibench.gui.window.banner import Banner, StateIndicator

READABLE = 4.5


def test_the_banner_shows_the_state_by_a_symbol_a_word_and_a_colour(closing):
    banner = closing(Banner())
    banner.show_indicator(StateIndicator("▶", "RUNNING", Tone.ACTIVE, "0:42 of 2:00"))
    label = banner.findChild(QLabel, "engine_state")
    assert label.text() == "▶  RUNNING"
    assert label.accessibleName() == "State: RUNNING"
    assert label.property("tone") == "active"


def test_a_click_on_the_stop_button_requests_a_stop(qtbot, closing):
    banner = closing(Banner())
    with qtbot.waitSignal(banner.stop_requested):
        banner.findChild(QPushButton, "stop").click()


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=lambda theme: theme.name)
@pytest.mark.parametrize("tone", list(Tone))
def test_banner_text_has_enough_contrast(theme, tone, contrast):
    paint = theme.tones[tone]
    assert contrast(paint.letters, paint.ground) >= READABLE


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=lambda theme: theme.name)
def test_text_and_accents_have_enough_contrast_on_every_background(theme, contrast):
    for ground in (theme.window, theme.base, theme.raised):
        for letters in (theme.text, theme.muted):
            assert contrast(letters, ground) >= READABLE, (letters, ground)
    assert contrast(theme.base, theme.accent) >= READABLE


def test_the_stop_button_states_its_action_and_does_not_move(qtbot, closing):
    banner = closing(Banner())
    banner.resize(1000, 60)
    banner.show()
    button = banner.findChild(QPushButton, "stop")
    assert "ramp down" in button.text()
    before = button.geometry()
    banner.show_indicator(StateIndicator("▼", "RAMPING DOWN", Tone.CAUTION, is_ramping=True))
    assert "at once" in button.text()
    qtbot.wait(20)
    assert button.geometry() == before


@pytest.mark.thorough
def test_the_stop_button_does_not_have_the_focus_when_the_window_opens(window, qtbot):
    qtbot.waitUntil(lambda: window.focusWidget() is not None)
    assert window.focusWidget().objectName() != "stop"
