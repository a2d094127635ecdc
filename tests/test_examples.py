"""The scripts in examples/ run unchanged and give the results that their first lines state."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from vibench.acquisition import Block
from vibench.acquisition.recording import (
    ChannelHeader,
    Origin,
    RecordingHeader,
    RecordingState,
    create_recording,
)

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"


def lines_of(script, *arguments):
    command = [sys.executable, "-W", "error", str(EXAMPLES / script), *map(str, arguments)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    return result.stdout.splitlines()


def test_the_response_example_has_impacts_at_5_um_and_no_impacts_at_1_um():
    weak, strong = lines_of("response_and_exponent.py")
    assert re.search(r"^1 µm: Response I [\d.]+, II [\d.]+, 0 impacts .* exponent -[\d.]+ ±", weak)
    assert int(re.search(r"(\d+) impacts", strong)[1]) > 0


@pytest.mark.thorough
def test_the_branches_example_finds_symmetry_breaking_and_the_exponent_sum():
    lines = lines_of("branches_and_exponents.py")
    assert sum(line.startswith("period 1, mirrored") for line in lines) == 1
    assert any(line.startswith("  symmetry breaking at 89.57") for line in lines)
    total = re.search(r"sum (-[\d.]+) of (-[\d.]+) 1/s", "\n".join(lines))
    assert float(total[1]) == pytest.approx(float(total[2]), rel=1e-6)
    assert 4.0 < float(re.search(r"dimension ([\d.]+)", lines[-1])[1]) < 5.0


def test_the_chain_example_shows_that_impacts_transmit_motion_in_the_band_gap():
    gap, weak, strong = lines_of("chain_and_its_gap.py")
    assert gap == "gap of the endless chain: 373.4 to 462.0 Hz"
    within, above = (
        [float(each) for each in re.search(r"base (\S+) at 410 Hz, (\S+) at 540 Hz", line).groups()]
        for line in (weak, strong)
    )
    assert "; 0 impacts;" in weak
    assert within[0] < 1e-4
    assert within[1] > 0.1
    assert above[0] > 100.0 * within[0]


def test_the_reading_example_reads_a_recording_without_vibench(tmp_path):
    channel = ChannelHeader(
        "m0_velocity", "Dev1/ai0", "velocity", "m s-1", physical_per_volt=0.125, range_v=5.0
    )
    plan = {"excitation": {"kind": "dwell", "amplitude_vpp": 0.5}}
    header = RecordingHeader(
        (channel,), 1000.0, expected_samples=500, origin=Origin.SIMULATED, plan_json=json.dumps(plan)
    )
    with create_recording(tmp_path / "sine.h5", header) as writer:
        writer.append(Block(0, np.sin(0.1 * np.arange(500))[np.newaxis]))
        path = writer.finish(RecordingState.COMPLETE, "the plan was carried out")
    assert lines_of("read_a_recording_with_h5py.py", path) == [
        "complete: the plan was carried out",
        "played: dwell, 0.5 Vpp",
        "m0: 0.50 s, at most 125.0 mm/s",
    ]


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_the_campaign_example_finds_the_resonances_of_the_specimen(tmp_path):
    lines = lines_of("campaign_on_the_virtual_rig.py", tmp_path / "recordings")
    assert sum(line.endswith(".h5: recorded") for line in lines) == 15
    found = [float(re.search(r"at ([\d.]+)", line)[1]) for line in lines if line.startswith("resonance")]
    assert found == pytest.approx([94.4, 266.0, 500.5], abs=2.0)
