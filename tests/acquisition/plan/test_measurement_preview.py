"""The preview of a measurement shows its signal, limits and duration before anything plays."""

from pathlib import Path

import numpy as np
import pytest

from vibench.acquisition import load_campaign
from vibench.acquisition.plan import preview_measurement
from vibench.acquisition.plan._limits import MOST_SAMPLES, SPECTRUM_POINTS
from vibench.acquisition.rig import load_rig

ROOT = Path(__file__).resolve().parents[3]
QUICK = {each.name: each for each in load_campaign(ROOT / "campaigns" / "quick.toml").measurements}


@pytest.fixture(scope="module")
def rig():
    return load_rig("virtual_rig")


@pytest.mark.parametrize("name", QUICK)
def test_the_previewed_peak_and_file_size_match_the_signal(rig, name):
    seen = preview_measurement(QUICK[name], rig)
    assert seen.is_allowed
    assert float(np.max(np.abs(seen.volts))) == pytest.approx(seen.peak_v, rel=1e-6)
    assert seen.peak_v <= 0.5 * QUICK[name].excitation.amplitude_vpp * (1 + 1e-6)
    assert seen.size_bytes == pytest.approx(seen.duration_s * 51200 * 4 * 4, rel=1e-4)
    assert len(seen.spectrum_hz) <= SPECTRUM_POINTS


def test_the_previewed_spectrum_of_a_sine_is_one_line(rig):
    seen = preview_measurement(QUICK["dwell"], rig)
    highest = int(np.argmax(seen.spectrum_v))
    assert seen.spectrum_hz[highest] == pytest.approx(260, abs=0.5)
    assert seen.spectrum_v[highest] == pytest.approx(0.75, rel=0.02)


def test_limit_checks_are_sorted_by_utilisation_and_violations_are_marked(rig):
    excitation = QUICK["dwell"].excitation.model_copy(update={"amplitude_vpp": 15.0})
    seen = preview_measurement(QUICK["dwell"].model_copy(update={"excitation": excitation}), rig)
    uses = [check.use for check in seen.checks]
    assert uses == sorted(uses, reverse=True)
    assert not seen.is_allowed
    assert "generator" in seen.checks[0].complaint()


@pytest.mark.thorough
def test_a_preview_of_a_long_sweep_has_a_bounded_number_of_samples(rig):
    excitation = QUICK["sweep"].excitation.model_copy(update={"duration_s": 900.0})
    seen = preview_measurement(QUICK["sweep"].model_copy(update={"excitation": excitation}), rig)
    assert len(seen.volts) <= 1.01 * MOST_SAMPLES
    assert seen.sample_rate_hz > 2 * 310


@pytest.mark.parametrize(
    ("name", "band_hz"), [("noise", (20, 800)), ("sweep", (220, 310)), ("dwell", (130, 520))]
)
def test_the_band_in_a_preview_is_the_excited_band(name, band_hz):
    assert QUICK[name].excitation.band_hz == band_hz


def test_the_shortest_growth_time_of_a_motion_that_the_loop_can_hold_follows_from_its_delay(rig):
    assert preview_measurement(QUICK["dwell"], rig).least_growth_time_s is None
    smart = load_campaign(ROOT / "campaigns" / "smart.toml").measurements
    (dwell,) = (each for each in smart if each.name == "dwell_260")
    prompt = preview_measurement(dwell, rig).least_growth_time_s
    assert prompt == pytest.approx(2.0)
    slow = rig.model_copy(update={"generator": rig.generator.model_copy(update={"settle_s": 0.1})})
    assert preview_measurement(dwell, slow).least_growth_time_s == pytest.approx(2.0 + 10 * 2 * 0.1)


def test_a_preview_of_a_fast_loop_branch_states_no_growth_time():
    pytest.importorskip("vibench_fast_loop", reason="pip install -e extensions/fast_loop brings it")
    fast = load_rig("virtual_rig_controller")
    (branch,) = load_campaign(ROOT / "campaigns" / "branch.toml").measurements
    assert preview_measurement(branch, fast).least_growth_time_s is None
