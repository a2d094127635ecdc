"""The whole job on the virtual rig by keyboard, from opening to export, and every way to stop."""

import os
import signal
import time
from functools import partial
from pathlib import Path

import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QApplication, QDialog, QFileDialog, QLineEdit, QMenu, QVBoxLayout

from tests.gui.geometry import wrongly_enabled
from vibench.acquisition import open_recording
from vibench.acquisition.engine import EngineState, Supervision, start_engine
from vibench.acquisition.plan import Measurement
from vibench.acquisition.recording import REJECTED
from vibench.analysis import analyse
from vibench.gui.page.app_context import AppContext, Settings
from vibench.gui.page.user_actions import ABORT_KEY, OPERATOR_STOP
from vibench.gui.pages.rig import PACES
from vibench.gui.widgets.notice import COMPARE, FILES, RUN, TEST
from vibench.gui.window.window import PAGES, Window

CONTROL = Qt.KeyboardModifier.ControlModifier
ALT = Qt.KeyboardModifier.AltModifier
STOPPED_S = 5.0
"""Time from key press to finished recording; other tests measure the time to silence."""
PATIENCE_MS = 100_000
pytestmark = [pytest.mark.thorough, pytest.mark.timeout(300)]


def dwell(name, duration_s):
    return Measurement.model_validate(
        {
            "name": name,
            "ramp_s": 0.3,
            "ramp_step_s": 0.03,
            "excitation": {
                "kind": "dwell",
                "amplitude_vpp": 1.5,
                "frequency_hz": 260,
                "settle_s": 0.2,
                "duration_s": duration_s,
            },
        }
    )


@pytest.fixture(scope="module")
def bench(qapp, own_state, tmp_path_factory):
    """A window with an open bench; one engine serves all tests of this module."""
    folder = tmp_path_factory.mktemp("job")
    # Unattended, since a busy machine must not end a run here; tests of the engine check that
    # a blocked window ends a run.
    context = AppContext(Settings(folder / "window.ini"), partial(start_engine, Supervision.UNATTENDED))
    context.choose_folder(folder / "recordings")
    window = Window(context, PAGES)
    # Not in real time: a simulated converter could lose samples on a busy machine.
    window.pages["Rig"].choice.pace.setCurrentIndex(list(PACES).index("free"))
    window.show()
    yield window
    context.bridge.close()
    window.close()
    window.deleteLater()


def reach(qtbot, window, *states):
    def check():
        said = [notice.text for notice in window.strip.notices]
        assert window.context.bridge.state in states, said[-2:]

    qtbot.waitUntil(check, timeout=PATIENCE_MS)


def press(qtbot, window, key, modifier=Qt.KeyboardModifier.NoModifier):
    qtbot.keyClick(QApplication.focusWidget() or window, key, modifier)


def newest_row(window):
    """Return the row of the newest recording."""
    (row,) = window.context.bridge.status.rows
    return row


def space_freezes_the_picture_and_opens_nothing(qtbot, bench):
    """Space must not open the focused list, since the Esc that closes the list would end the run."""
    card = bench.pages[RUN].watch_card
    bench.tick()
    press(qtbot, bench, Qt.Key.Key_Space)
    assert card.freeze.isChecked()
    card.span.setFocus()
    press(qtbot, bench, Qt.Key.Key_Space)
    assert QApplication.activePopupWidget() is None
    assert not card.freeze.isChecked()


def test_a_measurement_takes_five_key_presses_from_start_to_recording(bench, qtbot):
    """Alt+O opens, Ctrl+Return arms, F5 starts; two more keys show the recording."""
    keys = []

    def key(*which):
        keys.append(which)
        press(qtbot, bench, *which)

    assert bench.page is bench.pages["Rig"]
    key(Qt.Key.Key_O, ALT)
    reach(qtbot, bench, EngineState.READY)
    key(Qt.Key.Key_Return, CONTROL)
    reach(qtbot, bench, EngineState.ARMED)
    assert bench.page is bench.pages[RUN]
    qtbot.waitUntil(lambda: "1.5 Vpp" in bench.pages[RUN].arm_card.words.text(), timeout=PATIENCE_MS)
    key(Qt.Key.Key_F5)
    reach(qtbot, bench, EngineState.RUNNING)
    space_freezes_the_picture_and_opens_nothing(qtbot, bench)
    qtbot.waitUntil(lambda: bench.pages[RUN].is_done, timeout=PATIENCE_MS)
    assert len(keys) <= 5
    row = newest_row(bench)
    assert row.state == "recorded", row.reason
    reach(qtbot, bench, EngineState.READY)
    bench.tick()
    assert "left" not in bench.pages[RUN].watch_card.progress.text()
    with open_recording(row.file) as recording:
        assert recording.samples > 51_200


def tab_to(qtbot, window, widget):
    """Press Tab until a widget has the focus, with a limit on the number of presses."""
    for presses in range(1, 10):
        press(qtbot, window, Qt.Key.Key_Tab)
        if QApplication.focusWidget() is widget:
            return presses
    raise AssertionError(f"Tab does not reach {widget.accessibleName()}")


def type_into_dialog(qtbot, text):
    """Type into the dialog that the next key opens, and press Return there."""
    timer = QTimer(interval=10)

    def type_it():
        field = QApplication.focusWidget()
        if isinstance(field, QLineEdit) and isinstance(field.window(), QFileDialog):
            timer.stop()
            qtbot.keyClicks(field, text)
            qtbot.keyClick(field, Qt.Key.Key_Return)

    timer.timeout.connect(type_it)
    timer.start()
    return timer


def give_focus(qtbot, window):
    """Make the window active, since no window manager does so after a dialog closes."""
    window.activateWindow()
    qtbot.waitUntil(lambda: QApplication.activeWindow() is window, timeout=PATIENCE_MS)


def read_and_start(qtbot, window):
    """Scroll the plan to its end and start it."""
    while window.context.bridge.state is EngineState.ARMED:
        press(qtbot, window, Qt.Key.Key_PageDown)
        press(qtbot, window, Qt.Key.Key_F5)
        qtbot.waitUntil(lambda: not window.context.bridge.is_ordering, timeout=PATIENCE_MS)


@pytest.mark.parametrize(("width", "height", "points"), [(1280, 720, 10), (1024, 700, 14)])
def test_a_test_can_be_measured_and_exported_by_keyboard(bench, qtbot, tmp_path, qapp, width, height, points):
    """Make a measurement, open it, compare it with earlier ones and export it."""
    key = partial(press, qtbot, bench)
    files, compare = bench.pages[FILES], bench.pages[COMPARE]
    font = qapp.font()
    font.setPointSize(points)
    qapp.setFont(font)
    qtbot.waitUntil(lambda: bench.is_themed, timeout=PATIENCE_MS)
    bench.resize(width, height)
    give_focus(qtbot, bench)
    before = len(list(bench.context.folder.rglob("*.h5")))
    reach(qtbot, bench, EngineState.READY)
    key(Qt.Key.Key_2, CONTROL)
    qtbot.waitUntil(lambda: bench.page is bench.pages[TEST])
    key(Qt.Key.Key_Return, CONTROL)
    reach(qtbot, bench, EngineState.ARMED)
    read_and_start(qtbot, bench)
    reach(qtbot, bench, EngineState.READY)
    key(Qt.Key.Key_4, CONTROL)
    qtbot.waitUntil(lambda: len(files.table.recordings.entries) == before + 1, timeout=PATIENCE_MS)
    qtbot.waitUntil(lambda: bool(files.time_histories.plots), timeout=PATIENCE_MS)
    assert tab_to(qtbot, bench, files.time_histories) <= 3
    whole_s = files.time_histories.view_s[1]
    key(Qt.Key.Key_Plus)
    assert files.time_histories.view_s[1] - files.time_histories.view_s[0] < 0.7 * whole_s
    key(Qt.Key.Key_Home)
    while QApplication.focusWidget() is not files.table:
        key(Qt.Key.Key_Backtab, Qt.KeyboardModifier.ShiftModifier)
    key(Qt.Key.Key_A, CONTROL)
    key(Qt.Key.Key_M, ALT)
    qtbot.waitUntil(lambda: bench.page is compare)
    qtbot.waitUntil(lambda: len(compare.curves.ticked_curves()) == before + 1, timeout=PATIENCE_MS)
    timer = type_into_dialog(qtbot, str(tmp_path / "overlay.svg"))
    key(Qt.Key.Key_X, ALT)
    qtbot.waitUntil((tmp_path / "overlay.svg").exists, timeout=PATIENCE_MS)
    assert not timer.isActive()
    qtbot.waitUntil(lambda: bench.strip.notices[-1].what.startswith("Written"), timeout=PATIENCE_MS)
    assert (bench.width(), bench.height()) == (width, height)
    font.setPointSize(10)
    qapp.setFont(font)


def test_a_test_can_be_measured_and_exported_by_mouse(bench, qtbot, tmp_path):
    """Only the file name is typed."""

    def point_at(widget, place=None):
        qtbot.waitUntil(lambda: widget.isVisible() and widget.isEnabled(), timeout=PATIENCE_MS)
        target = widget.viewport() if hasattr(widget, "viewport") else widget
        qtbot.mouseClick(target, Qt.MouseButton.LeftButton, pos=place or target.rect().center())

    def turn_to(name):
        row = list(bench.pages).index(name)
        point_at(bench.navigation, bench.navigation.visualItemRect(bench.navigation.item(row)).center())
        assert bench.page is bench.pages[name]

    reach(qtbot, bench, EngineState.READY)
    turn_to(TEST)
    point_at(bench.pages[TEST].arm_button)
    reach(qtbot, bench, EngineState.ARMED)
    bench.tick()
    run, files, compare = bench.pages[RUN], bench.pages[FILES], bench.pages[COMPARE]
    point_at(run.arm_card.start_button)
    reach(qtbot, bench, EngineState.RUNNING)
    reach(qtbot, bench, EngineState.READY)
    point_at(run.look_button)
    qtbot.waitUntil(lambda: bench.page is files and bool(files.time_histories.plots), timeout=PATIENCE_MS)
    point_at(files._compare)
    qtbot.waitUntil(lambda: bench.page is compare and not compare.is_busy, timeout=PATIENCE_MS)
    timer = type_into_dialog(qtbot, str(tmp_path / "by_mouse.csv"))
    point_at(compare._export)
    qtbot.waitUntil((tmp_path / "by_mouse.csv").exists, timeout=PATIENCE_MS)
    assert not timer.isActive()
    turn_to("Rig")


def start_dwell(bench, qtbot, name):
    bench.pages[TEST].form.show_value(dwell(name, 600.0))
    reach(qtbot, bench, EngineState.READY)
    bench.user_actions.arm_test()
    reach(qtbot, bench, EngineState.ARMED)
    bench.user_actions.start()
    qtbot.waitUntil(lambda: check_drive_is_on(bench), timeout=PATIENCE_MS)


def check_drive_is_on(bench):
    assert drive_is_on(bench), [(row.state, row.reason) for row in bench.context.bridge.status.rows]


def drive_is_on(bench):
    run = bench.context.bridge.status.run
    return run is not None and run.amplitude_vpp >= 1.5


def on_the_banner(bench):
    bench.banner.setFocus()
    return bench


def on_a_plot(bench):
    bench.show_page(RUN)
    plot = bench.pages[RUN].time_histories.plots[3]
    plot.setFocus()
    return plot


def in_a_field(bench):
    bench.show_page(TEST)
    field = bench.pages[TEST].form.form.editors["ramp_s"].widget
    field.setFocus()
    return field


def in_a_modal_dialog(bench):
    dialog = QDialog(bench)
    dialog.setModal(True)
    field = QLineEdit(dialog)
    QVBoxLayout(dialog).addWidget(field)
    dialog.open()
    return field


def in_a_menu(bench):
    menu = bench.menuBar().findChildren(QMenu)[0]
    menu.popup(bench.pos())
    return menu


@pytest.mark.parametrize("place", [on_the_banner, on_a_plot, in_a_field, in_a_modal_dialog, in_a_menu])
def test_esc_silences_the_drive_whichever_widget_has_the_focus(bench, qtbot, place):
    start_dwell(bench, qtbot, place.__name__)
    focus = place(bench)
    began_s = time.monotonic()
    qtbot.keyClick(focus, Qt.Key.Key_Escape)
    reach(qtbot, bench, EngineState.READY)
    assert time.monotonic() - began_s < STOPPED_S
    row = newest_row(bench)
    assert row.state == "stopped"
    assert ABORT_KEY in row.reason
    with open_recording(row.file) as recording:
        assert recording.samples > 0


def test_a_hold_keeps_the_drive_on_and_a_stop_ramps_it_down(bench, qtbot):
    start_dwell(bench, qtbot, "held")
    bench.user_actions.hold_or_resume()
    reach(qtbot, bench, EngineState.HELD)
    qtbot.waitUntil(lambda: bench.banner.indicator.word == "HELD", timeout=PATIENCE_MS)
    assert drive_is_on(bench)
    bench.user_actions.hold_or_resume()
    reach(qtbot, bench, EngineState.RUNNING)
    bench.banner.stop_requested.emit()
    reach(qtbot, bench, EngineState.READY)
    assert newest_row(bench).state == "stopped"
    with open_recording(newest_row(bench).file) as recording:
        assert (recording.state, recording.reason) == ("stopped", OPERATOR_STOP)
    qtbot.waitUntil(lambda: OPERATOR_STOP in bench.pages[RUN].summary.sentence, timeout=PATIENCE_MS)
    said = [notice.text for notice in bench.strip.notices if "Campaign ended" in notice.text]
    assert "1 stopped" in said[-1]
    assert "carried out" not in bench.pages[RUN].summary.sentence + said[-1]


def test_the_live_plots_show_data_of_the_run(bench, qtbot):
    bench.show_page(RUN)
    start_dwell(bench, qtbot, "live")
    page = bench.pages[RUN]
    qtbot.waitUntil(lambda: bench.context.bridge.view.history().time_s.size > 3, timeout=PATIENCE_MS)
    bench.tick()
    drawn = [plot.getPlotItem().listDataItems()[0].getData()[1] for plot in page.time_histories.plots]
    assert all(values is not None and values.size > 100 for values in drawn)
    assert abs(bench.context.bridge.view.history().frequency_hz[-1] - 260) < 0.1
    assert bench.banner.indicator.word == "RUNNING"
    assert int(page.watch_card.impacts.text()) > 0
    page.watch_card.freeze.setChecked(True)
    frozen = page.time_histories.plots[0].getPlotItem().listDataItems()[0].getData()[0].copy()
    samples = bench.context.bridge.status.samples
    qtbot.waitUntil(lambda: bench.context.bridge.status.samples > samples + 20_000, timeout=PATIENCE_MS)
    assert (page.time_histories.plots[0].getPlotItem().listDataItems()[0].getData()[0] == frozen).all()
    page.watch_card.freeze.setChecked(False)
    now = page.time_histories.plots[0].getPlotItem().listDataItems()[0].getData()[0]
    assert now.shape != frozen.shape or (now != frozen).any(), "what was frozen is old at once"
    assert not any(map(wrongly_enabled, page.displayed_results))
    page.watch_card.mark.setText("tapped the table")
    page.watch_card.wish_mark()
    # An abort precedes queued requests.
    qtbot.waitUntil(lambda: not bench.context.bridge.is_ordering, timeout=PATIENCE_MS)
    samples = bench.context.bridge.status.samples
    qtbot.waitUntil(lambda: bench.context.bridge.status.samples > samples + 60_000, timeout=PATIENCE_MS)
    bench.user_actions.abort()
    reach(qtbot, bench, EngineState.READY)
    with open_recording(newest_row(bench).file) as recording:
        assert any("tapped the table" in event.text for event in recording.events)


def test_the_current_noise_average_can_be_rejected(bench, qtbot):
    noise = {"kind": "white_noise", "amplitude_vpp": 0.2, "band_start_hz": 40, "band_stop_hz": 600}
    noise |= {"realisations": 12, "settle_s": 1.0}
    plan = {"name": "noise", "ramp_s": 0.3, "ramp_step_s": 0.03, "excitation": noise}
    bench.pages[TEST].form.show_value(Measurement.model_validate(plan))
    reach(qtbot, bench, EngineState.READY)
    give_focus(qtbot, bench)
    bench.user_actions.arm_test()
    reach(qtbot, bench, EngineState.ARMED)
    read_and_start(qtbot, bench)
    card = bench.pages[RUN].watch_card
    qtbot.waitUntil(lambda: card.averages.text().endswith(" of 12"), timeout=PATIENCE_MS)
    card.reject_button.click()
    reach(qtbot, bench, EngineState.READY)
    with open_recording(newest_row(bench).file) as recording:
        assert [each.text for each in recording.events if each.kind == "mark"] == [REJECTED]
    assert analyse(Path(newest_row(bench).file)).response.periodic.realisations == 11


def test_an_error_message_disappears_once_its_request_succeeds(bench, qtbot):
    reach(qtbot, bench, EngineState.READY)
    bench.user_actions.start()
    assert "nothing is armed" in bench.strip.notices[-1].what
    assert bench.strip.is_said
    bench.user_actions.arm_test()
    bench.user_actions.start()
    assert "the previous command is still running" in bench.strip.notices[-1].what
    reach(qtbot, bench, EngineState.ARMED)
    assert not bench.strip.is_said
    bench.user_actions.disarm()
    reach(qtbot, bench, EngineState.READY)


def test_the_cancel_button_is_visible_when_armed_and_disarms(bench, qtbot):
    bench.show_page(RUN)
    reach(qtbot, bench, EngineState.READY)
    bench.user_actions.arm_test()
    reach(qtbot, bench, EngineState.ARMED)
    bench.tick()
    card = bench.pages[RUN].arm_card
    assert card.cancel_button.isVisible()
    card.cancel_button.click()
    reach(qtbot, bench, EngineState.READY)


def test_a_dead_engine_is_reported_promptly(bench, qtbot):
    os.kill(bench.context.bridge.engine_pid, signal.SIGKILL)
    qtbot.waitUntil(lambda: bench.context.bridge.status is None, timeout=5_000)
    assert bench.strip.notices[-1].code == "EngineGone"
    bench.tick()
    assert bench.banner.indicator.word == "NO BENCH"
