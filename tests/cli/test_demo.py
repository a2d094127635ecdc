"""The demo as a new user runs it, compared with the paper (Gong et al. 2025, section 5)."""

import json

import numpy as np
import pytest
from scipy.signal import welch
from scipy.stats import norm

from tests.reading_reports import Page
from vibench.acquisition import open_recording
from vibench.acquisition.recording import RecordingState, SegmentLabel
from vibench.analysis import analyse
from vibench.analysis.signals import phase_half_width
from vibench.sim import base_transmissibility, gong2025

LINEAR_HZ = (95.0, 266.0, 500.0)
TERMINAL_HZ = (201.0, 436.0)
NAMES = (
    "noise_weak",
    "noise_moderate",
    "noise_strong",
    "sweep_moderate",
    "dwell_weak",
    "dwell_moderate",
    "dwell_strong",
)

pytestmark = [pytest.mark.thorough, pytest.mark.timeout(1200)]


@pytest.fixture(scope="module")
def demo(vibench, tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo")
    result = vibench("demo", "--draws", "5", "--out", "demo", cwd=folder, timeout_s=1180)
    assert result.returncode == 0, result.stderr
    assert str(folder / "demo" / "report.html") in result.stdout.replace("\n", "")
    return folder / "demo"


@pytest.fixture(scope="module")
def results(demo):
    document = json.loads((demo / "results.json").read_text(encoding="utf-8"))
    assert document["failures"] == []
    return {result["recording"]["name"]: result for result in document["results"]}


def resonances_hz(result):
    return [found["frequency_hz"] for found in result["measured"]["resonances"]]


def test_every_demo_measurement_is_complete_and_without_overload(demo, results):
    assert set(results) == set(NAMES)
    for name in NAMES:
        with open_recording(demo / "recordings" / f"{name}.h5") as recording:
            assert recording.state is RecordingState.COMPLETE
            assert not recording.overloads
            assert not recording.gaps


def test_weak_noise_shows_the_three_linear_resonances_within_1_percent(results):
    assert resonances_hz(results["noise_weak"]) == pytest.approx(LINEAR_HZ, rel=0.01)


def test_strong_noise_shows_exactly_the_two_resonances_of_m1_joined_to_m2(results):
    assert resonances_hz(results["noise_strong"]) == pytest.approx(TERMINAL_HZ, rel=0.02)


def test_pyuff_reads_the_response_the_coherence_and_the_densities_of_the_demo(demo, vibench_here, tmp_path):
    pyuff = pytest.importorskip("pyuff", reason="pip install vibench[test] brings pyuff")
    path = demo / "recordings" / "noise_weak.h5"
    asked = ("--to", "uff", "--spectra", "--quantity", "velocity/acceleration", "--out", "frf.uff")
    assert vibench_here("export", path, *asked, cwd=tmp_path).returncode == 0
    _, response, coherence, *densities = pyuff.UFF(str(tmp_path / "frf.uff")).read_sets()
    with open_recording(path) as recording:
        measured = analyse(recording).response.frequency_response
        samples = {each.role: recording.read(each.role) for each in recording.channels}
        rate = round(recording.sample_rate_hz)
        played = [each for each in recording.segments if each.label == SegmentLabel.REALISATION]
    assert [response["func_type"], coherence["func_type"]] == [4, 6]
    for each in (response, coherence):
        np.testing.assert_allclose(each["x"], measured.frequency_hz, rtol=6e-6)
    # Both spectra are of the displacements x0 / xb, so v / a is this ratio divided by i times omega.
    turned = measured.value / (2j * np.pi * measured.frequency_hz)
    # Exported lines are multiples of the line spacing, slightly beside the lines of the measured clock.
    between = np.interp(response["x"], measured.frequency_hz, turned)
    np.testing.assert_allclose(response["data"], between, rtol=0, atol=1e-3 * np.abs(turned).max())
    np.testing.assert_allclose(coherence["data"], measured.coherence, rtol=1e-4)
    axes = ("ordinate", "orddenom")
    assert [response[f"{axis}_axis_units_lab"].strip() for axis in axes] == ["m/s", "m/s2"]
    assert [response[f"{axis}_spec_data_type"] for axis in axes] == [11, 12]
    assert [coherence[f"{axis}_axis_units_lab"].strip() for axis in axes] == ["NONE", "NONE"]
    assert [coherence[f"{axis}_spec_data_type"] for axis in axes] == [0, 0]
    assert [each["ordinate_axis_lab"].strip() for each in densities] == list(samples)
    for density, values in zip(densities, samples.values(), strict=True):
        # All realisations are equally long, so that the mean over segments is the mean over realisations.
        each_played = [
            welch(values[part.start : part.stop], rate, nperseg=rate, detrend=False) for part in played
        ]
        np.testing.assert_allclose(density["x"], each_played[0][0])
        np.testing.assert_allclose(
            density["data"], np.mean([found for _, found in each_played], axis=0), rtol=1e-9
        )


def test_the_linear_transmission_matches_the_closed_form_within_tight_bounds(demo):
    with open_recording(demo / "recordings" / "noise_weak.h5") as recording:
        measured = analyse(recording).response.frequency_response
    truth = base_transmissibility(gong2025(), measured.frequency_hz)[:, 0]
    exact = np.abs(truth)
    inside = (measured.magnitude_lower <= exact) & (exact <= measured.magnitude_upper)
    # 95 % of the lines, within twice the standard error of a fraction of 551 independent lines.
    assert np.mean(inside) == pytest.approx(0.95, abs=2 * np.sqrt(0.95 * 0.05 / inside.size))
    # The phase too: coupling, resonance and delay of the sensors are corrected.
    turned = np.abs(np.angle(truth / measured.value)) <= phase_half_width(measured.half_width)
    assert np.mean(turned) == pytest.approx(0.95, abs=2 * np.sqrt(0.95 * 0.05 / inside.size))
    assert np.median(measured.half_width) < 0.002
    assert np.max(measured.half_width) < 0.03


def test_every_demo_measurement_agrees_with_its_ensemble_of_simulations(results):
    """One quantity in a hundred is outside its limit by chance, and some 20 quantities are compared."""
    for name, found in results.items():
        assert found["simulated"]["drive"] == "recorded amplifier voltage", name
    quantities = {
        name: [each for each in found["simulated"]["ensemble"] if each["compared"]]
        for name, found in results.items()
    }
    counts = {name: len(compared) for name, compared in quantities.items()}
    # Whether the strong dwell becomes periodic, before or during the record, is a matter of chance.
    assert counts.pop("dwell_strong") >= 3 or results["dwell_strong"]["simulated"]["escape"] is not None
    assert counts == {
        "noise_weak": 2,
        "noise_moderate": 2,
        "noise_strong": 2,
        "sweep_moderate": 3,
        "dwell_weak": 3,
        "dwell_moderate": 5,
    }
    compared = [each for found in quantities.values() for each in found]
    assert sum(not each["agrees"] for each in compared) <= 1
    limit_z = norm.ppf(1.0 - 0.5 * 0.01 / sum(each["compared"] for each in compared))
    assert max(abs(each["largest_z"]) for each in compared) < limit_z
    # Whether the collisions cease before the end of a sweep is a matter of chance in each run.
    escape = results["sweep_moderate"]["simulated"]["escape"]
    assert escape is None or escape["what"] == "collisions"


def test_the_demo_collision_region_begins_where_the_simulation_predicts(results):
    sweep = results["sweep_moderate"]
    (measured,) = sweep["measured"]["collision_regions"]
    (simulated,) = sweep["simulated"]["collision_regions"]
    assert measured["start"]["frequency_hz"] == pytest.approx(simulated["start"]["frequency_hz"], abs=3.0)
    # The upper end, where chaos leaves its branch, is random in both sweep and simulation.
    for found in (measured, simulated):
        assert found["start"]["frequency_hz"] < 266 < 320 < found["stop"]["frequency_hz"]


def test_the_peaks_of_demo_dwells_approach_the_terminal_resonances_as_the_level_rises(results):
    weak, moderate, strong = (
        results[f"dwell_{level}"]["measured"]["terminal_bands"] for level in ("weak", "moderate", "strong")
    )
    for quiet, lively in zip(weak, moderate, strict=True):
        assert lively["rms_m"] > 1000 * quiet["rms_m"]
        assert lively["decibel_re_drive_line"] > quiet["decibel_re_drive_line"] + 40
    for band, hz in zip(strong, TERMINAL_HZ, strict=True):
        assert band["peak_hz"] == pytest.approx(hz, rel=0.04)
    upper_moderate, upper_strong = moderate[1]["peak_hz"], strong[1]["peak_hz"]
    assert abs(upper_strong - TERMINAL_HZ[1]) < abs(upper_moderate - TERMINAL_HZ[1])


def test_the_demo_report_begins_with_the_three_findings_of_the_paper(demo, results):
    page = Page((demo / "report.html").read_text(encoding="utf-8"))
    assert len(page.findings.split()) <= 120
    assert len(page.visible.split()) <= 2000
    linear, terminal = (
        " and ".join(", ".join(f"{each:.1f}" for each in resonances_hz(results[name])).rsplit(", ", 1))
        for name in ("noise_weak", "noise_strong")
    )
    assert f"At 0.05 Vpp there are three resonances, at {linear} Hz." in page.findings
    assert f"At 10 Vpp these resonances disappear, and two new ones appear at {terminal} Hz." in page.findings
    assert results["dwell_moderate"]["measured"]["motion"]["kind"] == "chaotic"
    levels = {"dwell_weak": "0.05", "dwell_moderate": "1.5", "dwell_strong": "10"}
    kinds = {name: results[name]["measured"]["motion"]["kind"] for name in levels}
    assert kinds["dwell_weak"] == "periodic"
    periodic = " and ".join(levels[name] for name, kind in kinds.items() if kind == "periodic")
    assert f"At 260 Hz the motion is periodic at {periodic} Vpp" in page.findings
    assert " chaotic at 1.5 " in page.findings
    compared = [
        [each["agrees"] for each in found["simulated"]["ensemble"] if each["compared"]]
        for found in results.values()
    ]
    agrees = sum(bool(each) and all(each) for each in compared)
    words = {7: "agrees with all seven recordings", 6: "agrees with six"}
    assert words[agrees] in page.findings
    for statistic in ("rank ", "largest |z|", "draws from slightly different initial states"):
        assert statistic in page.text
        assert statistic not in page.visible


def test_the_demo_report_is_one_file_that_contains_every_figure(demo):
    page = (demo / "report.html").read_text(encoding="utf-8")
    assert page.count("<figure") >= 6
    assert 'src="http' not in page
    assert "simulated instruments" in page
    assert len(list((demo / "figures").glob("*.png"))) >= 6
