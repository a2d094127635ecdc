"""Who looks after a run: the window's process, whatever its drawing thread does at the moment."""

import os
from time import sleep

import pytest

from vibench.acquisition import shipped
from vibench.acquisition.engine import DRIVING, EngineClient, EngineState
from vibench.acquisition.plan import Campaign, Measurement
from vibench.acquisition.rig import load_rig
from vibench.gui.widgets import QUEUE

DWELL = {"kind": "dwell", "amplitude_vpp": 0.5, "frequency_hz": 180, "settle_s": 0.2, "duration_s": 600}
PATIENCE_MS = 100_000
pytestmark = pytest.mark.timeout(300)


def test_a_window_that_is_busy_for_a_second_stops_nothing_and_a_campaign_is_left_alone(window, qtbot):
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
    qtbot.waitUntil(lambda: bridge.status.samples > 0, timeout=PATIENCE_MS)
    assert seen[-1].attendance.value == "attended"
    sleep(1.5)  # a picture that takes so long, or a computer with other things to do
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


def test_orders_that_an_engine_took_along_are_not_counted_against_the_next_one(window, qtbot):
    bridge, rig = window.context.bridge, load_rig(shipped("hardware_configs/virtual_rig.toml"))
    bridge.open(rig, None)
    qtbot.waitUntil(lambda: bridge.state is EngineState.READY, timeout=PATIENCE_MS)
    os.kill(bridge.engine_pid, 9)
    for _ in range(3):
        bridge.order(EngineClient.mark, "here")
    qtbot.waitUntil(lambda: bridge.engine_pid is None, timeout=PATIENCE_MS)
    assert not bridge.is_ordering
    bridge.open(rig, None)
    assert bridge.is_ordering
    window.tick()
    assert window.banner.indicator.word == "OPENING"
