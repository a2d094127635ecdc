"""The window's process attends a run even while its drawing thread is busy."""

import os
from time import sleep

import pytest

from vibench.acquisition import shipped
from vibench.acquisition.engine import DRIVING, EngineClient, EngineState
from vibench.acquisition.plan import Campaign, Measurement
from vibench.acquisition.rig import load_rig
from vibench.gui.widgets.notice import QUEUE, RUN

DWELL = {"kind": "dwell", "amplitude_vpp": 0.5, "frequency_hz": 180, "settle_s": 0.2, "duration_s": 600}
PATIENCE_MS = 100_000
pytestmark = pytest.mark.timeout(300)


@pytest.mark.thorough
def test_a_window_busy_for_one_second_does_not_stop_a_campaign(window, qtbot):
    bridge, seen = window.context.bridge, []

    def reach(*states):
        qtbot.waitUntil(lambda: bridge.state in states, timeout=PATIENCE_MS)

    window.user_actions.arm_test()
    assert "no bench is open" in window.strip.notices[-1].what
    bridge.open(load_rig(shipped("hardware_configs/virtual_rig.toml")), None)
    window.user_actions.arm_test()
    assert window.strip.notices[-1].kind.value == "warning"
    window.tick()
    assert window.banner.indicator.word == "OPENING"
    reach(EngineState.READY)
    assert window.strip.notices[-1].kind.value == "info"
    bridge.armed.connect(seen.append)
    window.context.selection.choose_measurement(Measurement(name="busy", excitation=DWELL))
    window.user_actions.arm_test()
    reach(EngineState.ARMED)
    window.user_actions.start()
    reach(EngineState.RUNNING)
    qtbot.waitUntil(lambda: bridge.status.run is not None, timeout=PATIENCE_MS)
    assert seen[-1].attendance.value == "attended"
    sleep(1.5)  # as a slow plot or a busy computer would
    qtbot.wait(300)
    assert bridge.state in DRIVING
    assert not bridge.may_leave
    window.user_actions.abort()
    reach(EngineState.READY)
    window.context.selection.choose_campaign(
        Campaign(name="night", measurements=(window.context.selection.measurement,))
    )
    window.show_page(QUEUE)
    window.tick()
    window.pages[QUEUE].arm_button.click()
    reach(EngineState.ARMED)
    assert seen[-1].attendance.value == "unattended"
    assert "unattended" in seen[-1].lines[-1]
    window.user_actions.disarm()


@pytest.mark.thorough
def test_the_plots_of_a_new_engine_do_not_show_data_of_a_killed_engine(window, qtbot):
    """Commands to the dead engine were awaited, and the next engine's run continued the old plots."""
    bridge, rig = window.context.bridge, load_rig(shipped("hardware_configs/virtual_rig.toml"))
    page = window.pages[RUN]

    def run():
        bridge.open(rig, None)
        assert bridge.is_ordering
        window.tick()
        assert window.banner.indicator.word == "OPENING"
        qtbot.waitUntil(lambda: bridge.state is EngineState.READY, timeout=PATIENCE_MS)
        window.user_actions.arm_test()
        qtbot.waitUntil(lambda: bridge.state is EngineState.ARMED, timeout=PATIENCE_MS)
        yield
        window.user_actions.start()
        qtbot.waitUntil(lambda: bridge.view is not None and bridge.view.next_sample > 0, timeout=PATIENCE_MS)

    window.context.selection.choose_measurement(Measurement(name="first", excitation=DWELL))
    for _ in run():
        assert page.time_histories.isEnabled()
    window.tick()
    first = bridge.view
    notices = []
    bridge.noticed.connect(notices.append)
    os.kill(bridge.engine_pid, 9)
    for _ in range(3):
        bridge.order(EngineClient.mark, "here")
    qtbot.waitUntil(lambda: bridge.engine_pid is None, timeout=PATIENCE_MS)
    notice = next(each for each in notices if each.what == "The engine was killed.")
    assert notice.next_step.startswith("The generator may still be driving: switch the amplifier off")
    assert not bridge.is_ordering
    (result,) = page.displayed_results
    for _ in run():
        window.tick()
        assert not any(each.isEnabled() for each in result.widgets), "pictures of another run"
    window.tick()
    assert bridge.view is not first
    assert result.inputs is bridge.view
    assert all(each.isEnabled() for each in result.widgets)
