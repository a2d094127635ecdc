"""Tests of a real bench on its first day: `pytest -m hardware`, with the bench of VIBENCH_BENCH.

Without VIBENCH_BENCH the virtual rig is used in real time, with the pause of a real generator after each
setting. VIBENCH_CONFIRMED_BY names the person who has compared the knobs with the file; without a name a real
bench is not used. Signals are at most 2 % of the bench's amplitude limit.
"""

import os
import re
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from tests.changed import changed
from vibench.acquisition import open_bench, open_recording, run_measurement
from vibench.acquisition.bench import Verdict
from vibench.acquisition.check.admission import check_bench
from vibench.acquisition.plan import Dwell, Measurement, SineSweep, WhiteNoise
from vibench.acquisition.rig import KnobSheet, load_rig
from vibench.analysis import analyse

pytestmark = [pytest.mark.hardware, pytest.mark.timeout(600)]

LABORATORY_SETTLE_S = 0.1
SHARE = 0.02


def rig():
    """Read the configured bench, or return the virtual rig in real time."""
    given = os.environ.get("VIBENCH_BENCH")
    if given is not None:
        return load_rig(Path(given))
    found = load_rig("virtual_rig")
    return changed(found, generator={"settle_s": LABORATORY_SETTLE_S}, virtual={"pace": "wall"})


def confirm_knobs(knobs):
    """Return a knob sheet in the name of the person who has checked the knobs."""
    name = os.environ.get("VIBENCH_CONFIRMED_BY")
    assert name, "name in VIBENCH_CONFIRMED_BY who has compared the knobs of this bench with its file"
    return KnobSheet(operator=name, confirm_knobs=datetime.now(UTC), knobs=knobs)


@pytest.fixture(scope="module")
def bench():
    configured = rig()
    with open_bench(configured, confirm_knobs if configured.virtual is None else None) as opened:
        yield opened


def record(bench, excitation, tmp_path):
    plan = Measurement(name="first_day", excitation=excitation, ramp_s=0.5, ramp_step_s=0.1)
    path = run_measurement(bench, plan, tmp_path / "first_day.h5").path
    with open_recording(path) as recording:
        assert recording.state.value == "complete"
        assert not recording.gaps
        late = [each.text for each in recording.events if each.kind == "late"]
        # A sweep also notes cycles that it lost to slow commands: less than one is allowed.
        lost = [text for text in late if "cycles off the planned phase" in text]
        assert late == lost
        assert all(abs(float(re.search(r"[+-][\d.e+-]+", text)[0])) < 1.0 for text in lost)
    return path


def level(bench):
    return SHARE * bench.rig.generator.amplitude_limit_vpp


def test_the_real_bench_passes_its_check(bench, tmp_path):
    # Noise floor, offsets, polarity, gain, clocks, latency, and silence after a stop.
    result = check_bench(bench, tmp_path)
    failed = [f"{each.name}: {each.value}" for each in result.findings if each.verdict is Verdict.FAIL]
    assert not failed


def test_the_drive_is_silent_before_a_dwell(bench, tmp_path):
    excitation = Dwell(amplitude_vpp=level(bench), frequency_hz=160, settle_s=0.5, duration_s=1.0)
    path = record(bench, excitation, tmp_path)
    with open_recording(path) as recording:
        drive = recording.read("drive_voltage")
        quiet = drive[: round(0.05 * recording.sample_rate_hz)]
        played = np.ptp(drive)
    assert np.ptp(quiet) < 0.25 * played


def test_a_dwell_is_recorded_at_its_frequency(bench, tmp_path):
    excitation = Dwell(amplitude_vpp=level(bench), frequency_hz=260, settle_s=1.0, duration_s=4.0)
    found = analyse(record(bench, excitation, tmp_path))
    assert found.response.drive.frequency_hz == pytest.approx(260.0, rel=300e-6)


def test_a_sweep_is_recorded_as_planned(bench, tmp_path):
    excitation = SineSweep(
        amplitude_vpp=level(bench), start_hz=200, stop_hz=300, duration_s=8, step_s=0.25, settle_s=0.5
    )
    found = analyse(record(bench, excitation, tmp_path))
    assert {each.what: each.verdict.value for each in found.checks}["Sweep as planned"] == "passed"


def test_noise_is_recorded_without_the_loss_of_a_realisation(bench, tmp_path):
    excitation = WhiteNoise(
        amplitude_vpp=level(bench), band_start_hz=50, band_stop_hz=600, repetition_hz=2, periods=4,
        realisations=2, settle_s=1.0,
    )  # fmt: skip
    found = analyse(record(bench, excitation, tmp_path))
    assert found.response.left_out == 0
    assert found.response.used_s == pytest.approx(4.0, rel=1e-3)
