"""A small recording of two channels of a 24-bit converter, for tests that write and read."""

import numpy as np
import pytest

from vibench.acquisition import Block
from vibench.acquisition.recording import ChannelHeader, Origin, RecordingHeader

RANGE_V = 5.0
STEP_V = RANGE_V / 2**23
RATE_HZ = 1000.0


def channel(role, **changes):
    settings = {
        "role": role,
        "physical_channel": f"cDAQ1Mod1/{role}",
        "quantity": "velocity",
        "unit": "m s-1",
        "physical_per_volt": 0.125,
        "range_v": RANGE_V,
        "volts_per_count": STEP_V,
        "volts_at_zero_count": 1.5 * STEP_V,
        "coupling": "DC",
        "serial": "4711",
        "sensitivity": 8.0,
        "sensitivity_unit": "V per m/s",
        "calibration_date": "2026-02-01",
        "delay_s": 5.6e-6,
    }
    return ChannelHeader(**{**settings, **changes})


@pytest.fixture
def make_channel():
    return channel


@pytest.fixture
def make_header():
    def make(**changes):
        settings = {
            "channels": (channel("drive_voltage", unit="V", physical_per_volt=1.0), channel("m0_velocity")),
            "sample_rate_hz": RATE_HZ,
            "expected_samples": 4000,
            "origin": Origin.SIMULATED,
            "plan_json": '{"kind": "dwell", "frequency_hz": 260.0}',
            "bench_json": '{"name": "virtual"}',
        }
        return RecordingHeader(**{**settings, **changes})

    return make


@pytest.fixture
def make_block():
    """Return a function that makes random 24-bit counts and a block, both determined by seed and position."""

    def make(first_sample, samples, channels=2, overloads=()):
        counts = np.random.default_rng([first_sample, samples]).integers(
            -(2**23), 2**23, (channels, samples), dtype=np.int32
        )
        return counts, Block(first_sample, (counts + 1.5) * STEP_V, overloads)

    return make
