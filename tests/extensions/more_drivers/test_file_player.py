"""Playback of a recording: the same plan records the same samples again."""

import h5py
import numpy as np
import pytest

from tests.acquisition.bench.test_bench import calibrated_on
from vibench.acquisition import ConfigurationError, open_bench, open_recording, run_measurement
from vibench.acquisition.check.admission import check_bench, require_fresh
from vibench.acquisition.errors import InstrumentLost
from vibench.acquisition.plan import Dwell, Measurement
from vibench.acquisition.rig import CalibrationRule

PLAN = Measurement(
    name="dwell",
    excitation=Dwell(amplitude_vpp=1.5, frequency_hz=260, settle_s=0.3, duration_s=1.0),
    ramp_s=0.3,
    ramp_step_s=0.03,
)


def record(rig, folder):
    with open_bench(rig) as bench:
        return run_measurement(bench, PLAN, folder / "original.h5").path


@pytest.fixture(scope="module")
def original(rig, tmp_path_factory):
    return record(rig, tmp_path_factory.mktemp("recorded"))


@pytest.fixture
def playing(rig, original):
    """Return a function that makes the rig on which a recording replaces generator and converter."""

    def rig_of(original=original, **daq):
        options = {"recording": str(original)}
        played = rig.daq.model_copy(update={"driver": "file", "options": options, **daq})
        silent = rig.generator.model_copy(update={"driver": "file", "resource": ""})
        return rig.model_copy(update={"daq": played, "generator": silent, "virtual": None})

    return rig_of


@pytest.mark.thorough
def test_playing_back_a_recording_reproduces_every_sample(playing, original, tmp_path):
    with open_bench(playing(), calibration=CalibrationRule.WAIVED) as bench:
        again = run_measurement(bench, PLAN, tmp_path / "again.h5").path
    with open_recording(original) as first, open_recording(again) as second:
        assert second.state.value == "complete"
        assert second.origin.value == "simulated", "what was simulated stays so"
        assert second.instruments["digitizer"].serial == first.recording_id
        count = min(first.samples, second.samples)
        assert count > 0.95 * first.samples
        for role in first.roles:
            np.testing.assert_array_equal(second.read(role, 0, count), first.read(role, 0, count))
        for one, other in zip(first.segments, second.segments, strict=True):
            assert (one.label, one.first_sample, one.last_sample) == (
                other.label,
                other.first_sample,
                other.last_sample,
            )


def test_the_end_of_the_played_recording_is_reported(playing, original):
    with open_bench(playing(), calibration=CalibrationRule.WAIVED) as bench:
        with open_recording(original) as recording:
            samples = recording.samples
        bench.digitizer.start()
        bench.digitizer.read(samples)
        with pytest.raises(InstrumentLost, match=rf"ends after {samples} samples"):
            bench.digitizer.read(1)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("daq", "said"),
    [
        ({"options": {}}, "names no recording"),
        ({"sample_rate_hz": 25600.0}, "samples a second; the configuration"),
    ],
)
def test_playback_on_a_bench_that_does_not_match_the_recording_is_refused(playing, daq, said):
    with pytest.raises(ConfigurationError, match=said):
        open_bench(playing(**daq), calibration=CalibrationRule.WAIVED)


def test_playback_needs_no_valid_calibration(playing):
    with pytest.raises(ConfigurationError, match="names no recording"):
        open_bench(calibrated_on(playing(options={}), "2001-01-01"))


@pytest.mark.thorough
@pytest.mark.parametrize("change", ["samples", "seal"])
def test_an_altered_recording_is_not_played_back(playing, rig, tmp_path, change):
    altered = record(rig, tmp_path)
    with h5py.File(altered, "r+") as file:
        if change == "seal":
            del file["seal"]
        else:
            file["m0_velocity"][...] = file["m0_velocity"][...] // 2
    with pytest.raises(ConfigurationError, match=r"data of /m0_velocity|its seal is gone"):
        open_bench(playing(altered), calibration=CalibrationRule.WAIVED)


@pytest.mark.thorough
def test_playback_under_another_plan_is_refused(playing, tmp_path):
    other = PLAN.model_copy(update={"excitation": PLAN.excitation.model_copy(update={"frequency_hz": 255.0})})
    with (
        open_bench(playing()) as bench,
        pytest.raises(ConfigurationError, match=r"recorded with the plan 'dwell'.*Nothing was played back"),
    ):
        run_measurement(bench, other, tmp_path / "again.h5")


@pytest.mark.thorough
def test_playback_with_another_sensor_scale_is_refused(playing, rig):
    other = rig.vibrometer.model_copy(update={"range_mm_per_s_per_v": 500.0})
    with pytest.raises(ConfigurationError, match="units of m0_velocity per volt"):
        open_bench(playing().model_copy(update={"vibrometer": other}))


@pytest.mark.thorough
def test_playback_needs_no_bench_check_and_no_waiver(playing, tmp_path):
    with open_bench(playing(), calibration=CalibrationRule.WAIVED) as bench:
        with pytest.raises(ConfigurationError, match="plays back a recording"):
            check_bench(bench, tmp_path)
        assert require_fresh(bench, tmp_path) is None
