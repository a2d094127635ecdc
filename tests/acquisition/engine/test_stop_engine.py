"""A stop of an engine is confirmed only if the drive has ended."""

import pytest

from vibench import stop_files
from vibench.acquisition import StopLevel
from vibench.acquisition.engine import (
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
from vibench.acquisition.stopping.stop import DRIVES_ON

from .conftest import BENCH, campaign, progress


@pytest.fixture
def driving(tmp_path, monkeypatch):
    """An engine whose run has published one block at 1.5 Vpp and then hangs."""
    monkeypatch.setattr(stop_files, "HEEDED_S", 0.3)
    engine = Engine(Supervision.UNATTENDED)
    engine.published.begin(campaign("point"), tmp_path)
    engine.published.note_progress(progress(tmp_path / "point.h5", 0, 0.0), BENCH)
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
