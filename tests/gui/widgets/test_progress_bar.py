"""The text of a progress bar is elided, not cut."""

import pytest

from vibench.gui.pages.run.run_page import WatchCard
from vibench.gui.widgets.boxes import ProgressBar, TimedBar
from vibench.gui.widgets.theme import LIGHT

WORDS = "ramping up as far as the first tenth, 11:22:33 left"


@pytest.mark.parametrize("number", range(3))
def test_long_text_in_a_progress_bar_is_elided_and_complete_in_the_tooltip(qapp, number):
    card = WatchCard(LIGHT)
    bar = (ProgressBar("share"), TimedBar("bar", "points"), card.progress)[number]
    bar.setValue(0)
    bar.setFormat(WORDS)
    bar.resize(120, 20)
    assert bar.text().endswith("…")
    assert bar.fontMetrics().horizontalAdvance(bar.text()) < 120
    assert bar.toolTip() == WORDS
    bar.resize(900, 20)
    assert (bar.text(), bar.toolTip()) == (WORDS, "")
