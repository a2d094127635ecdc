"""Nothing that a person does on a page holds the window up for long."""

import gc
from time import thread_time

import numpy as np
import pytest

from acquisition.shipped import shipped
from analysis.comparison.trace import Origin, Response, Trace
from gui.loop_watch import BOUND_S
from gui.page_names import COMPARE, FILES, QUEUE, RUN, TEST
from gui.screenshots import SHOWN
from gui.theme import DARK, LIGHT

YARDSTICK_S = 0.0097
"""What `yardstick` takes where the bound was measured; a slower processor is given as much more."""


SLACK = 1.25
"""The yardstick needs no memory, and feels less of other work than a window does."""


def yardstick():
    begun_s = thread_time()
    sum(number * number for number in range(300_000))
    return thread_time() - begun_s


def bound_s():
    """The bound on this machine, as busy as it is now: other work takes the cache away from this one."""
    return SLACK * BOUND_S * max(1.0, yardstick() / YARDSTICK_S)


def curve(number):
    frequency_hz = np.linspace(10.0, 1000.0, 4000)
    magnitude = 1.0 + np.random.default_rng(number).random(4000)
    return Trace(
        f"run {number}", Origin.MEASURED, Response.TRANSMISSION, frequency_hz, magnitude, np.full(4000, 0.02)
    )


def actions(window, recording):
    """What a person does that was, or may become, slow: name, act, and what shows that it is done."""
    pages, desk = window.pages, window.desk
    lanes, now = pages[FILES].lanes, lambda: True
    for name in window.pages:
        yield f"show {name}", lambda name=name: window.show_page(name), now
    yield "open a recording", lambda: pages[FILES].open_path(recording), lambda: bool(lanes.plots)
    yield "zoom", lambda: lanes.show_range(6.0, 6.5), now
    for number in range(3):
        yield f"curve {number}", lambda number=number: pages[COMPARE].add_prediction((curve(number),)), now
    paper = shipped("campaigns/paper.toml")
    queue = pages[QUEUE].entries
    yield "open a campaign", lambda: pages[QUEUE].open_file(paper), lambda: queue.rowCount() > 1
    test = pages[TEST]
    yield "take over a test", lambda: test.form.show_measurement(SHOWN), lambda: test.is_done
    yield "look at Run", lambda: window.show_page(RUN), now
    yield "dark", lambda: desk.choose_theme(DARK), now
    yield "light", lambda: desk.choose_theme(LIGHT), now
    yield "another size", lambda: window.resize(1600, 900), now


@pytest.fixture
def _without_leftovers():
    """Keep the collector of garbage from walking through what hundreds of other tests have left."""
    gc.collect()
    gc.freeze()
    yield
    gc.unfreeze()


@pytest.mark.usefixtures("_without_leftovers")
def test_nothing_that_is_done_on_a_page_keeps_the_loop_over_the_bound(window, record, tmp_path, qtbot):
    recording = record(tmp_path, "whole")
    qtbot.waitUntil(lambda: window.pages[TEST].is_done, timeout=120_000)
    slow = {}
    for name, act, is_done in actions(window, recording):
        window.loop_watch.begin()
        act()
        qtbot.waitUntil(is_done, timeout=120_000)
        # The loop has been round, whatever the act left to it.
        qtbot.waitUntil(lambda: window.loop_watch.rounds >= 5)
        if window.loop_watch.busiest_s > bound_s():
            slow[name] = window.loop_watch.busiest_s
    assert slow == {}
