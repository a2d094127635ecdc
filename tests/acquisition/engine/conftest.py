"""Real engine processes with the virtual rig, and functions that wait for their states."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from tests.changed import changed
from vibench.acquisition import Block, StopLevel
from vibench.acquisition.campaign import CampaignProgress
from vibench.acquisition.engine import (
    BenchFacts,
    EngineClient,
    EngineProcess,
    EngineState,
    EngineStatus,
    Supervision,
    start_engine,
)
from vibench.acquisition.engine._status import ChannelFacts
from vibench.acquisition.plan import Campaign, RunState
from vibench.acquisition.rig import Rig, load_rig
from vibench.acquisition.run.ending import Progress

CHANNEL = ChannelFacts(role="m0_velocity", unit="m/s", units_per_volt=0.1, full_scale_v=5.0)
BENCH = BenchFacts(
    rig_name="bench", is_simulated=True, identities={}, channels=(CHANNEL,), sample_rate_hz=1000.0
)
PATIENCE_S = 60.0
LOOK_S = 0.01
"""Pause between two requests; polling without a pause would slow down the engine."""


@pytest.fixture(autouse=True)
def own_state(tmp_path_factory, monkeypatch) -> None:
    """Use a temporary state folder for locks."""
    monkeypatch.setenv("VIBENCH_STATE_DIR", str(tmp_path_factory.mktemp("state")))


@pytest.fixture
def shipped_rig() -> Rig:
    return load_rig("virtual_rig")


@pytest.fixture
def real_time_rig() -> Rig:
    """A rig in real time, at a low sample rate, which needs little processor time."""
    return changed(load_rig("virtual_rig"), virtual={"pace": "wall"}, daq={"sample_rate_hz": 5120.0})


@pytest.fixture
def engine() -> Iterator[Callable[..., EngineProcess]]:
    """Return a function that starts an engine, which ends with the test."""
    with ExitStack() as running:
        yield lambda supervision=Supervision.ATTENDED: running.enter_context(start_engine(supervision))


@pytest.fixture(scope="module")
def shared_engine() -> Iterator[EngineProcess]:
    """One engine for all tests that restore its state: starting one takes two seconds."""
    with start_engine() as engine:
        yield engine


@pytest.fixture
def client(shared_engine: EngineProcess) -> Iterator[EngineClient]:
    """The attending viewer of an engine whose bench is closed."""
    client = shared_engine.client
    yield client
    client.stop(StopLevel.OFF)
    at_rest = (EngineState.READY, EngineState.ARMED, EngineState.FAULT, EngineState.CLOSED)
    until_state(client, *at_rest)
    client.close_bench()
    until_state(client, EngineState.CLOSED)


def until(client: EngineClient, is_there: Callable[[EngineStatus], bool]) -> EngineStatus:
    """Poll the status until a condition holds; return the status."""
    give_up_s, pause = time.monotonic() + PATIENCE_S, threading.Event()
    while not is_there(status := client.status()):
        if time.monotonic() > give_up_s:
            pytest.fail(f"still {status}")
        pause.wait(LOOK_S)
    return status


def until_exists(path: Path) -> None:
    """Wait until a file exists, without requests to the engine."""
    give_up_s, pause = time.monotonic() + PATIENCE_S, threading.Event()
    while not path.exists():
        assert time.monotonic() < give_up_s, f"{path} was never finished"
        pause.wait(LOOK_S)


def until_state(client: EngineClient, *states: EngineState) -> EngineStatus:
    return until(client, lambda status: status.state in states)


def open_rig(client: EngineClient, rig: Rig) -> EngineStatus:
    """Open a bench in the engine and wait until it is ready."""
    client.open(rig)
    return until_state(client, EngineState.READY)


def campaign(*names: str, duration_s: float = 600.0) -> Campaign:
    """Return a campaign of dwells that are longer than any test."""
    excitation = {"kind": "dwell", "amplitude_vpp": 1.5, "frequency_hz": 260, "settle_s": 0.2}
    excitation["duration_s"] = duration_s
    each = [{"name": name, "ramp_s": 0.3, "ramp_step_s": 0.03, "excitation": excitation} for name in names]
    return Campaign.model_validate({"name": "trial", "measurements": each})


def progress(path: Path, first_sample: int, volts: float) -> CampaignProgress:
    """Return the progress of a run after a block of constant voltage."""
    block = Block(first_sample, np.full((1, 100), volts))
    run = Progress(RunState.RECORDING, None, block, 0.1, 10.0, 1.5, 260.0)
    return CampaignProgress("point", 1, 1, path, run)
