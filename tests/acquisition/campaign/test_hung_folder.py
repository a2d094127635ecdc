"""An unresponsive network folder does not block the stop of a campaign whose drive is on."""

import os
import sys

import pytest

from vibench.acquisition import StopSwitch, run_campaign
from vibench.acquisition.campaign import PointOutcome, ReconnectingBench, _log
from vibench.acquisition.plan import Campaign, Dwell, Measurement, RunState
from vibench.acquisition.stopping.stop import Cause, StopRequest

DWELL = Dwell(amplitude_vpp=1.0, frequency_hz=260, settle_s=0.1, duration_s=2.0)
PLAN = Campaign(
    name="c", measurements=(Measurement(name="one", excitation=DWELL, ramp_s=0.3, ramp_step_s=0.03),)
)


@pytest.mark.thorough
@pytest.mark.timeout(60)
@pytest.mark.skipif(sys.platform == "win32", reason="a pipe that nobody reads hangs as POSIX has it")
def test_an_unresponsive_status_file_does_not_block_a_stop(rig, tmp_path, monkeypatch):
    monkeypatch.setattr(_log, "LINE_EVERY_S", 0.0)
    switch, status, fifo = StopSwitch(), tmp_path / "c.status", tmp_path / "fifo"

    def progress(stand):
        if stand.run.state is not RunState.RECORDING:
            return
        if status.is_fifo():
            switch.ask(StopRequest.of(Cause.OPERATOR, "enough"))
        else:
            # Replace the file in one step: the status writer may run between an unlink and a mkfifo.
            os.mkfifo(fifo)
            fifo.replace(status)

    with ReconnectingBench(rig) as kept:
        (point_result,) = run_campaign(kept.bench, PLAN, tmp_path, on_progress=progress, switch=switch)
    assert point_result.outcome is PointOutcome.STOPPED
    assert point_result.reason == "enough"
    os.close(os.open(status, os.O_RDONLY | os.O_NONBLOCK))  # lets the waiting writer end
