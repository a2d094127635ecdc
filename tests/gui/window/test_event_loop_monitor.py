"""The event loop monitor detects blocking work."""

from time import thread_time

import pytest

from vibench.gui.window.banner import StatusField
from vibench.gui.window.event_loop_monitor import BOUND_S, EventLoopMonitor


def work_for(duration_s):
    until_s = thread_time() + duration_s
    while thread_time() < until_s:
        sum(range(1000))


def test_blocking_work_is_logged_with_the_visible_page(qapp, qtbot):
    monitor = EventLoopMonitor(lambda: "Files page")
    qtbot.waitUntil(lambda: monitor.longest_s > 0 or monitor.busiest_s > 0)
    monitor.begin()
    work_for(1.6 * BOUND_S)
    qtbot.waitUntil(lambda: bool(monitor.long_waits))
    (wait,) = monitor.long_waits
    assert wait.about == "Files page"
    assert wait.busy_s == pytest.approx(1.6 * BOUND_S, abs=0.04)
    assert wait.own_s > BOUND_S
    assert "Files page: 1" in monitor.text
    monitor.stop()


@pytest.mark.thorough
def test_the_status_line_shows_a_responsive_event_loop(window, qtbot):
    frames = window.status_line.labels[StatusField.FRAMES]
    qtbot.waitUntil(lambda: "latency" in frames.text())
    assert "Longest wait" in frames.toolTip()
