"""The complete window, offscreen, with separate settings."""

import gc
from time import thread_time

import numpy as np
import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QColor, QImage, QPainter

from vibench.gui.page.app_context import AppContext, Settings
from vibench.gui.window.event_loop_monitor import BOUND_S
from vibench.gui.window.window import PAGES, Window, application

YARDSTICK_S = 0.0054
"""Time of `yardstick` [s] on the machine for which bounds are stated; bounds grow on slower processors."""


@pytest.fixture(scope="session")
def qapp():
    """The application as `vibench gui` makes it."""
    return application(["vibench"])


@pytest.fixture
def closing(qtbot):
    """Return a function that returns its widget, which is closed after the test."""

    def keep(widget):
        qtbot.addWidget(widget)
        return widget

    return keep


@pytest.fixture
def context(qapp, tmp_path):
    context = AppContext(Settings(tmp_path / "window.ini"))
    yield context
    context.background.close()


@pytest.fixture(scope="session")
def contrast():
    """Ratio of luminances of two colours (WCAG 2.1, section 1.4.3); text needs 4.5."""

    def luminance(name):
        colour = QColor(name)
        parts = (colour.redF(), colour.greenF(), colour.blueF())
        linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
        return float(np.dot((0.2126, 0.7152, 0.0722), linear))

    def ratio(letters, ground):
        bright, dark = sorted((luminance(letters), luminance(ground)), reverse=True)
        return (bright + 0.05) / (dark + 0.05)

    return ratio


@pytest.fixture
def _without_leftovers():
    """Exclude objects left by other tests from garbage collection, which would take long."""
    gc.collect()
    gc.freeze()
    yield
    gc.unfreeze()


@pytest.fixture
def longest_blocking(qtbot, _without_leftovers):
    """Do something; return the longest blocking of the event loop and its bound [s].

    The bound is that of the loop watch, in processor time, on this processor at the speed that it has now.
    """

    def measure(window, act, is_done=lambda: True):
        before_s = yardstick()
        window.event_loop_monitor.begin()
        act()
        qtbot.waitUntil(is_done, timeout=120_000)
        # Handle all events that the action has posted.
        qtbot.waitUntil(lambda: window.event_loop_monitor.rounds >= 5)
        busiest_s = window.event_loop_monitor.busiest_s
        return busiest_s, BOUND_S * max(1.0, max(before_s, yardstick()) / YARDSTICK_S)

    return measure


def yardstick():
    """Return the processor time of a reference workload: Python, text, lines, images [s]."""
    begun_s = thread_time()
    picture = QImage(1200, 600, QImage.Format.Format_ARGB32_Premultiplied)
    picture.fill(Qt.GlobalColor.white)
    painter = QPainter(picture)
    for number in range(100):
        painter.drawText(10, 6 * number, f"a label of a plot, {number}")
        painter.drawLine(0, 6 * number, 1200, 6 * number)
    painter.end()
    sum(number * number for number in range(150_000))
    return thread_time() - begun_s


@pytest.fixture(scope="module")
def own_state(tmp_path_factory):
    """Use a temporary state folder for locks."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("VIBENCH_STATE_DIR", str(tmp_path_factory.mktemp("state")))
        yield


@pytest.fixture
def window(context, own_state, tmp_path, qapp):
    """The complete window, without a bench."""
    window = show_window(context, tmp_path)
    yield window
    end(window, qapp)


@pytest.fixture(scope="module")
def lasting_window(own_state, tmp_path_factory, qapp):
    """One window for all tests of a module, which do not rely on its initial state."""
    folder = tmp_path_factory.mktemp("window")
    context = AppContext(Settings(folder / "window.ini"))
    window = show_window(context, folder)
    yield window
    end(window, qapp)
    context.background.close()


def show_window(context, folder):
    context.choose_folder(folder / "recordings")
    window = Window(context, PAGES)
    window.resize(1280, 720)
    window.show()
    return window


def end(window, qapp):
    """Close a window and delete its widgets, which would slow down the next window."""
    window.context.bridge.close()
    window.close()
    window.deleteLater()
    qapp.sendPostedEvents(None, QEvent.Type.DeferredDelete.value)
    qapp.processEvents()
