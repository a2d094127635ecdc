"""Statistics of a chaotic motion that cannot be tracked determine gap and m1, with correct bounds."""

import json
import math
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.stats import t as student

from tests.analysis.hidden_motion import shaken_world as world
from vibench.acquisition import open_recording
from vibench.analysis import AnalysisError, Simulation, analyse_files, update_model
from vibench.analysis.fit.statistical_numbers import (
    above_sensor_noise,
    chaos_statistics,
    statistical_numbers,
)
from vibench.analysis.hidden_motion import Hidden
from vibench.analysis.overlay.draws import stretch_draws
from vibench.sim import gong2025

TRUE = gong2025(gap_m=51e-6)
FEW = (60, 60, 80)
STRETCH_S = (0.5, 1.5)


@pytest.fixture(scope="module")
def noisy_dwell(tmp_path_factory):
    """Record a chaotic dwell with sixty times the noise; the bench file states 45 um gaps."""
    return world.shake(
        tmp_path_factory.mktemp("buried"), 260.0, 1.8, duration_s=1.6, seed=8, noise=60.0, specimen=TRUE
    )


def holds(number, true):
    """Return whether twice the 95 % bounds contain the true value."""
    beyond = 0.5 * (number.high - number.low)
    return number.low - beyond < true < number.high + beyond


@pytest.mark.thorough
def test_statistics_determine_the_mean_gap_and_m1_but_not_the_exponent(noisy_dwell):
    with open_recording(noisy_dwell.path) as recording:
        found, _ = statistical_numbers(recording, gong2025(), STRETCH_S, 260.0, rounds=FEW)
    told = {each.what: each for each in found}
    gap = told[Hidden.MEAN_GAP]
    assert gap.is_determined
    assert holds(gap, 51e-6)
    assert gap.high / gap.low < 1.4
    assert holds(told[Hidden.M1], TRUE.masses[1])
    assert not told[Hidden.EXPONENT].is_determined
    assert "exponent" in told[Hidden.EXPONENT].not_determined


@pytest.mark.thorough
def test_simulated_runs_of_the_true_specimen_have_the_statistics_of_the_recording(noisy_dwell):
    """Converter noise in the recorded voltage once drove the simulated table: 30 standard deviations off."""
    rng, runs = np.random.default_rng(3), 14
    with open_recording(noisy_dwell.path) as recording:
        rate_hz = recording.sample_rate_hz
        draws = stretch_draws(recording, TRUE, *(round(each * rate_hz) for each in STRETCH_S))
        seen = chaos_statistics(draws.recorded_motion, rate_hz, 260.0)
        found = np.array([chaos_statistics(draws.draw(TRUE, rng), rate_hz, 260.0) for _ in range(runs)])
    z = (seen - found.mean(axis=0)) / found.std(axis=0, ddof=1) / math.sqrt(1 + 1 / runs)
    z = z[above_sensor_noise(seen, draws.noise_rms, rate_hz)]
    assert z.size > 40
    assert np.abs(z).max() < student.isf(0.005 / z.size, runs - 1)


@pytest.mark.thorough
def test_a_rig_with_a_wrong_base_response_is_refused_before_the_fit(noisy_dwell, tmp_path):
    other = shutil.copy(noisy_dwell.path, tmp_path / "other.h5")
    with h5py.File(other, "r+") as file:
        bench = json.loads(file["configuration/bench_json"][()])
        bench["shaker"]["force_constant_n_per_a"] = 30.0
        del file["configuration/bench_json"]
        file["configuration/bench_json"] = np.bytes_(json.dumps(bench))
    with open_recording(other) as recording, pytest.raises(AnalysisError, match="amplifier and shaker"):
        statistical_numbers(recording, gong2025(), STRETCH_S, 260.0)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("specimen", "stretch_s", "why"),
    [
        (gong2025(), (0.5, 0.7), "0.2 s of this motion at 51200 samples/s are too short"),
        (gong2025(), (1.4, 1.7), "too short for statistics"),
        (gong2025(contact="rigid:0.8"), STRETCH_S, "cannot be tracked"),
        (gong2025(contact="linear"), STRETCH_S, "without stops"),
        (gong2025(gap_m=(math.inf, 4e-5)), STRETCH_S, "a stop on one side only"),
    ],
)
def test_a_fit_without_usable_statistics_gives_a_reason(noisy_dwell, specimen, stretch_s, why):
    with open_recording(noisy_dwell.path) as recording, pytest.raises(AnalysisError, match=why):
        statistical_numbers(recording, specimen, stretch_s, 260.0, rounds=FEW)


def test_mirroring_a_motion_changes_the_sign_of_even_harmonics_in_its_statistics():
    rate_hz, time_s = 20_000.0, np.arange(40_000) / 20_000.0
    turn = 2 * math.pi * 250.0 * time_s
    base = np.sin(turn) + 1e-3 * np.random.default_rng(1).standard_normal(turn.size)

    def velocity(sign, late):
        return np.sin(turn + late) + sign * 0.2 * np.cos(2 * (turn + late))

    one, turned = (
        chaos_statistics(np.stack([base, velocity(sign, 0.3)]), rate_hz, 250.0) for sign in (1.0, -1.0)
    )
    even = one - turned
    assert np.abs(even[-10:]).max() > 0.1
    assert np.count_nonzero(np.abs(even[-10:]) > 1e-3) == 2  # real and imaginary part of the second harmonic
    assert np.allclose(even[:18], 0.0)  # statistics of the base


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_statistics_determine_the_gap_from_a_motion_that_cannot_be_tracked(noisy_dwell):
    updated = update_model(analyse_files([noisy_dwell.path], "buried", Simulation.LEFT_OUT))
    gap = {each.what: each for each in updated.collisions.determined}[Hidden.MEAN_GAP]
    assert holds(gap, 51e-6)
    assert updated.specimen.gaps_m == pytest.approx((gap.value, gap.value))
    assert any(each.startswith("From statistics, mean gap: (") for each in updated.sentences)
    assert any(each.startswith("No motion with collisions could be") for each in updated.not_determined)
    assert updated.to_dict()["statistics_from"] == updated.collisions.recording


@pytest.mark.slow
@pytest.mark.timeout(1700)
def test_bounds_from_statistics_hold_for_random_specimens():
    """Check thirty random specimens; `--seed` and `--shard` of the benchmark select others."""
    place = Path(__file__).parents[3] / "benchmarks" / "posterior_coverage.py"
    told = subprocess.run(
        [sys.executable, place, "--draws", "30", "--seed", "77"], capture_output=True, text=True, check=True
    ).stdout
    (line,) = (each for each in told.splitlines() if each.startswith("all: "))
    held, asked = int(line.split("held in ")[1].split(" ")[0]), int(line.split("told in ")[1].split(" ")[0])
    assert asked >= 30
    # Values of one specimen are correlated: the scatter follows from 30 independent specimens.
    assert held / asked > 0.9 - 3 * math.sqrt(0.9 * 0.1 / 30)
