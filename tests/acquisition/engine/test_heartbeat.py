"""A pulse alone keeps an attended run going; without it the run is aborted."""

from threading import Event

from vibench.acquisition.engine import DRIVING, EngineState, Heartbeat

from .conftest import campaign, until, until_state


def test_a_pulse_keeps_a_run_going_that_nobody_else_asks_about(engine, shipped_rig, tmp_path):
    process = engine()
    client = process.client
    client.open(shipped_rig)
    until_state(client, EngineState.READY)
    client.arm(campaign("beaten"), tmp_path)
    client.start()
    until(client, lambda status: status.samples > 0)
    heartbeat = Heartbeat(process.address)
    clock = Event()
    for _ in range(40):
        heartbeat.beat()
        clock.wait(0.05)
    assert client.status().state in DRIVING
    clock.wait(1.0)
    status = until_state(client, EngineState.READY)
    heartbeat.close()
    assert "nobody has looked" in status.rows[0].reason
