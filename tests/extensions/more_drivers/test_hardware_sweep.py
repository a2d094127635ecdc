"""Sweeps made by the generator, a simulated Keysight 33500B, and runs in real time."""

import numpy as np
import pytest

from tests.acquisition.run.test_command_time import cycles
from vibench.acquisition import open_bench, open_recording, run_campaign, run_measurement
from vibench.acquisition.bench import Verdict
from vibench.acquisition.campaign import PointOutcome
from vibench.acquisition.check.admission import check_bench
from vibench.acquisition.errors import ConfigurationError, LimitExceeded
from vibench.acquisition.instruments import Spacing
from vibench.acquisition.plan import (
    Campaign,
    Dwell,
    Measurement,
    SineSweep,
    WhiteNoise,
    require_within_limits,
)
from vibench.acquisition.rig import load_rig
from vibench.analysis import analyse

RAMP = {"ramp_s": 0.4, "ramp_step_s": 0.1}
LABORATORY_SETTLE_S = 0.1
NOTED_CYCLES = 0.1
"""Difference in cycles between drive and plan above which a run notes it."""
FILTER_CYCLES = 0.12
"""Delay of the converter's filter, in cycles per 160 Hz of sweep range."""


def sweep(start_hz=150.0, stop_hz=310.0, **changes):
    own = {"amplitude_vpp": 0.2, "duration_s": 3.0, "settle_s": 0.5, "swept_by": "generator", **changes}
    return Measurement(name="sweep", excitation=SineSweep(start_hz=start_hz, stop_hz=stop_hz, **own), **RAMP)


def in_real_time(bench):
    rig = load_rig(bench)
    generator = rig.generator.model_copy(update={"settle_s": LABORATORY_SETTLE_S})
    virtual = rig.virtual.model_copy(update={"pace": "wall"})
    return rig.model_copy(update={"generator": generator, "virtual": virtual})


def excess_cycles(path, excitation):
    """Return the difference in cycles between recorded drive and plan, and whether the run noted it."""
    with open_recording(path) as recording:
        found = next(each for each in recording.segments if each.label == "sweep")
        drive = recording.read("drive_voltage", found.first_sample, found.last_sample + 1)
        is_noted = any(event.kind == "late" for event in recording.events)
        assert recording.state.value == "complete"
        assert drive.size == pytest.approx(excitation.duration_s * recording.sample_rate_hz, abs=1)
    return cycles(drive - np.mean(drive)) - excitation.cycles(excitation.duration_s), is_noted


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("ends", "spacing"),
    [((150.0, 310.0), Spacing.LINEAR), ((420.0, 70.0), Spacing.LINEAR), ((90.0, 530.0), Spacing.LOGARITHMIC)],
)
def test_a_hardware_sweep_matches_its_plan(tmp_path, ends, spacing):
    plan = sweep(*ends, spacing=spacing)
    with open_bench("virtual_rig_keysight") as bench:
        path = run_measurement(bench, plan, tmp_path / "sweep.h5").path
    excess, is_noted = excess_cycles(path, plan.excitation)
    assert abs(excess) < NOTED_CYCLES + FILTER_CYCLES * abs(ends[1] - ends[0]) / 160
    assert not is_noted
    found = analyse(path)
    assert (found.response.frequency_hz[0], found.response.frequency_hz[-1]) == pytest.approx(ends, rel=0.1)


def test_a_generator_without_a_hardware_sweep_is_refused_before_output():
    with pytest.raises(LimitExceeded, match=r"AFG1022.*set swept_by = \"computer\""):
        require_within_limits(sweep(), load_rig("virtual_rig"))


def test_hardware_sweeps_are_refused_on_a_rig_with_a_dead_man_switch(tmp_path):
    rig = load_rig("virtual_rig_keysight")
    generator = rig.generator.model_copy(update={"dead_man_s": 0.5})
    with (
        open_bench(rig.model_copy(update={"generator": generator})) as bench,
        pytest.raises(ConfigurationError, match="dead_man_s"),
    ):
        run_measurement(bench, sweep(), tmp_path / "sweep.h5")


def test_a_sweep_with_changing_amplitude_is_stepped_by_the_computer():
    with pytest.raises(ValueError, match="swept_by = 'computer'"):
        sweep(hold="velocity")


def test_the_preview_of_a_hardware_sweep_shows_the_whole_sweep():
    shown = sweep().excitation.preview(2000.0)
    assert shown.peak_v == pytest.approx(0.1, rel=1e-3)
    assert len(shown.volts) == 6000
    stepped = sweep(swept_by="computer", step_s=0.001).excitation.preview(2000.0)
    np.testing.assert_allclose(shown.volts, stepped.volts, atol=1e-3)


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize(
    ("bench", "swept_by"), [("virtual_rig", "computer"), ("virtual_rig_keysight", "generator")]
)
def test_a_check_and_a_campaign_run_in_real_time_with_instrument_delays(tmp_path, bench, swept_by):
    excitations = {
        "noise": WhiteNoise(amplitude_vpp=0.2, band_start_hz=50, band_stop_hz=800, realisations=2, periods=3),
        "dwell": Dwell(amplitude_vpp=0.2, frequency_hz=260, settle_s=0.5, duration_s=2.0),
        "steps": SineSweep(
            amplitude_vpp=0.2, start_hz=150, stop_hz=310, duration_s=3.0, step_s=0.5, settle_s=0.5
        ),
        "sweep": sweep(swept_by=swept_by, step_s=0.2).excitation,
    }
    campaign = Campaign(
        name="first",
        measurements=[Measurement(name=name, excitation=each, **RAMP) for name, each in excitations.items()],
    )
    with open_bench(in_real_time(bench)) as opened:
        found = check_bench(opened, tmp_path).findings
        assert not [each for each in found if each.verdict is Verdict.FAIL]
        results = run_campaign(opened, campaign, tmp_path / "campaign")
    assert [each.outcome for each in results] == [PointOutcome.RECORDED] * len(excitations)
    for result, excitation in zip(results, excitations.values(), strict=True):
        with open_recording(result.path) as recording:
            assert not recording.gaps
        assert analyse(result.path)
        if isinstance(excitation, SineSweep):
            excess, is_noted = excess_cycles(result.path, excitation)
            assert is_noted or abs(excess) < NOTED_CYCLES + FILTER_CYCLES
