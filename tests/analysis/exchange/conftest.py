"""A small recording of known values: two channels, one gap, two segments."""

import json

import numpy as np
import pytest

from vibench.acquisition import Block, open_recording
from vibench.acquisition.recording import ChannelHeader, Origin, RecordingHeader, create_recording

RATE_HZ = 51_200.0
SAMPLES = 120_000
HOLE = (70_000, 70_010)
STEP_V = 5.0 / 2**23


def counts(channel):
    return np.random.default_rng(channel).integers(-(2**23), 2**23, SAMPLES)


def values(channel):
    """Expected values: counts times the converter's step times the sensor's scale, NaN in the gap."""
    found = counts(channel) * STEP_V * (1.0, 0.125)[channel]
    found[slice(*HOLE)] = np.nan
    return found


@pytest.fixture(scope="session")
def known_values():
    return {"drive_voltage": values(0), "m0_velocity": values(1)}


@pytest.fixture(scope="session")
def known_file(tmp_path_factory):
    def channel(role, quantity, unit, per_volt):
        return ChannelHeader(
            role=role,
            physical_channel=f"dev/{role}",
            quantity=quantity,
            unit=unit,
            physical_per_volt=per_volt,
            range_v=5.0,
            volts_per_count=STEP_V,
        )

    header = RecordingHeader(
        channels=(
            channel("drive_voltage", "voltage", "V", 1.0),
            channel("m0_velocity", "velocity", "m s-1", 0.125),
        ),
        sample_rate_hz=RATE_HZ,
        expected_samples=SAMPLES,
        origin=Origin.SIMULATED,
        plan_json=json.dumps({"name": "known", "excitation": {"kind": "dwell"}}),
    )
    volts = np.stack((counts(0), counts(1))) * STEP_V
    with create_recording(tmp_path_factory.mktemp("known") / "known.h5", header) as writer:
        writer.begin_segment("dwell", frequency_hz=260.0)
        writer.append(Block(0, volts[:, : HOLE[0]]))
        writer.end_segment()
        writer.begin_segment("step", frequency_hz=270.0)
        writer.append(Block(HOLE[1], volts[:, HOLE[1] :]))
        writer.log("note", "gap 45 µm")
    return writer.path


@pytest.fixture
def known(known_file):
    with open_recording(known_file) as recording:
        yield recording
