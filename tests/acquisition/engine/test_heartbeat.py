"""A pulse alone keeps an attended run going; without it the run is aborted."""

from threading import Event

from vibench.acquisition.engine import DRIVING, VIEWER_PATIENCE_S, EngineState, Heartbeat
from vibench.acquisition.engine._state import HUNG_FACTOR

from .conftest import campaign, until, until_state


def running(process, rig, folder):
    """A client whose run plays, and what beats for it."""
    client = process.client
    client.open(rig)
    until_state(client, EngineState.READY)
    client.arm(campaign("beaten"), folder)
    client.start()
    until(client, lambda status: status.samples > 0)
    return client, Heartbeat(process.address)


def test_a_pulse_keeps_a_run_going_that_nobody_else_asks_about(engine, shipped_rig, tmp_path):
    client, heartbeat = running(engine(), shipped_rig, tmp_path)
    clock = Event()
    for _ in range(40):
        heartbeat.beat()
        clock.wait(0.05)
    assert client.status().state in DRIVING
    clock.wait(1.0)
    status = until_state(client, EngineState.READY)
    heartbeat.close()
    assert "nobody has looked" in status.rows[0].reason


def test_a_pulse_that_tells_of_a_dead_window_ends_the_run(engine, shipped_rig, tmp_path):
    """The thread that beats lives; the window's own has done nothing for longer than it may."""
    client, heartbeat = running(engine(), shipped_rig, tmp_path)
    clock = Event()
    for number in range(200):
        heartbeat.beat(0.05 * number)
        clock.wait(0.05)
        if client.status().state is EngineState.READY:
            break
    heartbeat.close()
    assert "stands still" in until_state(client, EngineState.READY).rows[0].reason
    assert 0.05 * number > HUNG_FACTOR * VIEWER_PATIENCE_S
