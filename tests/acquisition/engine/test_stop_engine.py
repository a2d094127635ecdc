"""A stop of an engine is confirmed only if the drive has ended."""

import numpy as np
import pytest

from vibench import stop_files
from vibench.acquisition import Block, StopLevel
from vibench.acquisition.campaign import CampaignProgress
from vibench.acquisition.engine import (
    BenchFacts,
    Engine,
    EngineState,
    JobQueue,
    RequestHandler,
    StopDelivery,
    Supervision,
    serving,
    stop_engine,
    the_engine,
)
from vibench.acquisition.engine._status import ChannelFacts
from vibench.acquisition.plan import RunState
from vibench.acquisition.run.ending import Progress
from vibench.acquisition.stopping.stop import DRIVES_ON

from .conftest import campaign

CHANNEL = ChannelFacts(role="m0_velocity", unit="m/s", units_per_volt=0.1, full_scale_v=5.0)
BENCH = BenchFacts(
    rig_name="bench", is_simulated=True, identities={}, channels=(CHANNEL,), sample_rate_hz=1000.0
)


@pytest.fixture
def driving(tmp_path, monkeypatch):
    """An engine whose run has published one block at 1.5 Vpp and then hangs."""
    monkeypatch.setattr(stop_files, "HEEDED_S", 0.3)
    engine = Engine(Supervision.UNATTENDED)
    run = Progress(RunState.RECORDING, None, Block(0, np.zeros((1, 100))), 0.1, 10.0, 1.5, 260.0)
    engine.published.begin(campaign("point"), tmp_path)
    engine.published.note_progress(CampaignProgress("point", 1, 1, tmp_path / "point.h5", run), BENCH)
    with serving(RequestHandler(engine, JobQueue(engine)), "night"):
        DRIVES_ON.begin(engine)
        yield engine
        DRIVES_ON.confirm_silence(engine)


def test_a_stop_is_not_confirmed_while_a_run_hangs_with_the_drive_on(driving):
    assert stop_engine(the_engine(None), "abort", "smoke") is StopDelivery.UNHEEDED
    assert driving.switch.request.level is StopLevel.ABORT


@pytest.mark.parametrize("state", [EngineState.RAMPING_DOWN, EngineState.READY, EngineState.FAULT])
def test_a_stop_is_confirmed_when_the_run_ends(driving, state):
    driving.published.enter(state)
    DRIVES_ON.confirm_silence(driving)
    assert stop_engine(the_engine(None), "abort", "smoke") is StopDelivery.TOLD


def test_a_stop_before_the_first_run_is_confirmed_at_once(driving, tmp_path):
    driving.published.begin(campaign("point"), tmp_path)
    DRIVES_ON.confirm_silence(driving)
    assert stop_engine(the_engine(None), "abort", "smoke") is StopDelivery.TOLD


def test_a_hold_request_is_delivered_without_confirmation(driving):
    assert stop_engine(the_engine(None), "hold") is StopDelivery.TOLD
