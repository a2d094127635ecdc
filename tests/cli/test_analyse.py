"""`vibench analyse` on good, growing and bad recordings: a report and numbers, or one sentence."""

import json
import shutil
import time

import h5py
import numpy as np
import pytest

from tests.analysis import synthetic_recordings as synthetic
from vibench.acquisition.plan import Dwell, StreamedNoise
from vibench.acquisition.recording import RecordingState
from vibench.analysis import Simulation, analyse_files
from vibench.analysis.results.campaign_results import AnalysisFailure, CampaignResults, FailedStep
from vibench.cli.analyse import complain_about

SECONDS = 8.0
PATIENCE_S = 60.0


@pytest.fixture(scope="module")
def noise():
    """Return streamed noise with a transmissibility of 2 at every frequency: plan, base, velocity, parts."""
    plan = StreamedNoise(
        amplitude_vpp=0.1, band_start_hz=50, band_stop_hz=600, settle_s=0, duration_s=SECONDS, seed=1
    )
    base, velocity = synthetic.noise_band(SECONDS, 20.0, 700.0, 1e-6, 5)
    return plan, base, velocity, [synthetic.Part("noise", 0.0, SECONDS, {})]


@pytest.fixture(scope="module")
def good(noise, tmp_path_factory):
    return synthetic.write_recording(tmp_path_factory.mktemp("good"), *noise, name="good")


def changed_copy(good, folder, change):
    """Copy a recording without its seal and change it, as another version could have written it."""
    path = folder / "changed.h5"
    shutil.copy(good, path)
    with h5py.File(path, "r+") as file:
        del file["seal"]
        change(file)
    return path


@pytest.mark.thorough
def test_estimator_and_quantity_and_resolution_options_are_applied_and_reported(vibench_here, good, tmp_path):
    asked = ("--estimator", "h1", "--quantity", "velocity/acceleration", "--resolution", "5", "--scale", "db")
    done = vibench_here(
        "analyse", good, "--no-simulate", "--json", "--out", tmp_path / "out", *asked, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)["results"][0]["measured"]["transmission"]
    assert (found["estimator"], found["quantity"], found["unit"]) == ("h1", "velocity/acceleration", "s")
    assert found["resolution_hz"] == pytest.approx(5.0, rel=1e-3)
    frequency = np.array(found["frequency_hz"])
    np.testing.assert_allclose(found["magnitude"], 2 / (2 * np.pi * frequency), rtol=0.01)
    table = (tmp_path / "out" / "figures" / "transmission_good.csv").read_text(encoding="utf-8").splitlines()
    assert len(table) == 1 + frequency.size
    assert "phase_lower_rad" in table[0]
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Estimator h1; hann segments of 0.3 s overlapping by 50 %, lines 5 Hz wide." in page


def test_a_recording_that_still_grows_is_analysed_up_to_its_last_sample(vibench_here, noise, tmp_path):
    plan, base, velocity, parts = noise
    half = round(SECONDS * synthetic.RATE / 2)
    with synthetic.start_recording(
        tmp_path, plan, base, velocity, parts, name="growing", samples=half
    ) as writer:
        deadline_s = time.monotonic() + PATIENCE_S
        while writer.committed_samples < half:
            assert time.monotonic() < deadline_s
        done = vibench_here("analyse", "growing.h5.part", "--no-simulate", "--json", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        answer = json.loads(done.stdout)["results"][0]
        assert answer["recording"]["state"] == "recording"
        assert answer["measured"]["used_s"] == pytest.approx(SECONDS / 2)
        np.testing.assert_allclose(answer["measured"]["transmission"]["magnitude"], 2, rtol=0.01)
        writer.finish(RecordingState.STOPPED, "enough")


@pytest.mark.thorough
def test_a_bad_recording_does_not_prevent_the_analysis_of_other_recordings(vibench, good, tmp_path):
    folder = tmp_path / "night[red]"
    folder.mkdir()
    shutil.copy(good, folder / "good.h5")
    (folder / "cut.h5").write_bytes(good.read_bytes()[:5000])
    done = vibench("analyse", ".", "--no-simulate", cwd=folder)
    assert done.returncode == 1
    assert done.stderr.strip().count("\n") == 0
    assert "cut.h5 is not a readable HDF5 file" in done.stderr
    assert "Traceback" not in done.stderr
    report = tmp_path / "night[red]_analysis" / "report.html"
    assert str(report) in done.stdout, "brackets are not markup"
    assert "good: Noise at " in done.stdout, "what the report says in short stands on the terminal too"
    assert "<h1>night[red]</h1>" in report.read_text(encoding="utf-8")


def test_no_report_is_written_if_the_only_recording_is_bad(vibench_here, tmp_path):
    (tmp_path / "nothing.h5").touch()
    done = vibench_here("analyse", "nothing.h5", cwd=tmp_path)
    assert done.returncode == 1
    assert "nothing.h5 is empty (0 bytes)" in done.stderr
    assert [each.name for each in tmp_path.iterdir()] == ["nothing.h5"]


def test_contradictory_options_are_refused_with_a_readable_message(vibench_here, good, tmp_path):
    done = vibench_here("analyse", good, "--resolution", "1", "--averages", "9", cwd=tmp_path)
    assert done.returncode == 1
    assert "a resolution and a number of averages were given; give one" in done.stderr
    assert "Traceback" not in done.stderr


def sentence(path):
    """Return the sentence with which the analysis refuses a recording."""
    (failure,) = analyse_files([path], "one", Simulation.LEFT_OUT).failures
    assert failure.what == "analysis"
    return failure.sentence


def set_newer_version(file):
    file.attrs["format_version"] = 99


def rename_channel(file):
    file.move("m0_velocity", "laser")
    file.attrs["roles"] = np.bytes_(b"drive_voltage base_acceleration laser")


def remove_scale(file):
    file["m0_velocity"].attrs["physical_per_volt"] = np.nan


def remove_plan(file):
    del file["configuration/plan_json"]
    file["configuration/plan_json"] = np.bytes_(b"{}")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (set_newer_version, "format version 99; this version of vibench reads version 1."),
        (
            rename_channel,
            "no channel measures the motion of m0: the recording has drive_voltage, base_acceleration, laser",
        ),
        (
            remove_scale,
            "physical_per_volt of the channel 'm0_velocity': input should be a finite number; it is 'nan'",
        ),
        (remove_plan, "this version of vibench cannot read the plan in changed.h5"),
    ],
)
def test_an_unreadable_recording_is_reported_with_its_fault(good, tmp_path, change, said):
    assert said in sentence(changed_copy(good, tmp_path, change))


@pytest.mark.thorough
def test_dead_or_clipped_or_lost_channels_are_named_in_a_readable_message(noise, tmp_path):
    plan, base, velocity, parts = noise
    dead = synthetic.write_recording(tmp_path, plan, base, 0 * velocity, parts, name="dead")
    assert "all samples of m0_velocity have the same value" in sentence(dead)
    still = synthetic.Motion(base.displacement_m, 0 * base.acceleration)
    deaf = synthetic.write_recording(tmp_path, plan, still, velocity, parts, name="deaf")
    assert "all samples of base_acceleration have the same value" in sentence(deaf)
    clipped = np.clip(1e4 * velocity, -1.0, 1.0)
    cut = synthetic.write_recording(tmp_path, plan, base, clipped, parts, name="clipped")
    assert "m0_velocity was at its full scale of 1 m s-1 for" in sentence(cut)
    lost = synthetic.write_recording(
        tmp_path, plan, base, velocity, parts, name="lost", hole=(0, velocity.size)
    )
    assert "contains no samples" in sentence(lost)


def test_a_sine_at_full_scale_is_analysed(tmp_path):
    base = synthetic.sine(4.0, 260.0, 5e-7)
    time_s = synthetic.times(4.0)
    plan = Dwell(amplitude_vpp=0.01, frequency_hz=260.0, settle_s=2.0, duration_s=2.0)
    part = synthetic.Part("dwell", 2.0, 4.0, {"frequency_hz": 260.0})
    velocity = 0.9999 * np.sin(2 * np.pi * 260.0 * time_s)
    path = synthetic.write_recording(tmp_path, plan, base, velocity, [part], name="full")
    assert not analyse_files([path], "full", Simulation.LEFT_OUT).failures


@pytest.mark.thorough
def test_warnings_about_a_result_are_printed(vibench_here, tmp_path):
    """Warnings are printed, and not only part of the report."""
    base = synthetic.sine(4.0, 260.0, 5e-7)
    velocity = 0.1 * np.sin(2 * np.pi * 260.0 * synthetic.times(4.0))
    plan = Dwell(amplitude_vpp=0.01, frequency_hz=262.0, settle_s=2.0, duration_s=2.0)
    part = synthetic.Part("dwell", 2.0, 4.0, {"frequency_hz": 262.0})
    synthetic.write_recording(tmp_path, plan, base, velocity, [part], name="other")
    done = vibench_here("analyse", "other.h5", "--no-simulate", cwd=tmp_path)
    assert "warning: other: drive frequency: " in " ".join(done.stdout.split()), done.stdout


def test_a_simulation_that_is_not_possible_is_noted_without_a_failure(capsys):
    failure = AnalysisFailure("a.h5", FailedStep.SIMULATION, "the reason")
    complain_about(CampaignResults("night", (), (failure,)))
    assert capsys.readouterr().err == "note: a.h5: the reason\n"
