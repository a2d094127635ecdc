"""Published limit cycles from control-based continuation, read by a mapping, have their stated values."""

import runpy
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from vibench.acquisition import load_toml
from vibench.analysis.exchange import ImportMapping

ROOT = Path(__file__).parents[3]
FOLDER = Path(__file__).parent / "flutter_rig"
STABLE = ("14_9", "15_6", "16_5", "17_3")
UNSTABLE = ("14_9", "15_6", "16_5", "17_2")


@pytest.fixture(scope="module")
def cycles():
    benchmark = runpy.run_path(str(ROOT / "benchmarks" / "published_branches.py"))
    found = benchmark["read_cycles"](FOLDER, load_toml(FOLDER / "mapping.toml", ImportMapping))
    return {each.name.removeprefix("CBC_"): each for each in found}


@pytest.mark.thorough
def test_published_stable_motions_have_the_stated_frequency_and_amplitude(cycles):
    for speed in STABLE:
        found = cycles[f"stable_v{speed}"]
        assert found.frequency_hz == pytest.approx(found.stated_hz, abs=0.006)
        assert found.heave_m.mean() == pytest.approx(found.stated_m, rel=0.035)
        assert found.invasive < 0.025


@pytest.mark.thorough
def test_published_unstable_amplitudes_are_below_the_stable_amplitudes_and_fall_with_wind_speed(cycles):
    stable, unstable = (
        [cycles[f"{kind}_v{each}"] for each in speeds]
        for kind, speeds in (("stable", STABLE), ("unstable", UNSTABLE))
    )
    for one, other in zip(unstable, stable, strict=True):
        assert one.heave_m.max() < other.heave_m.min()
    means = [each.heave_m.mean() for each in unstable]
    assert means == sorted(means, reverse=True)


def test_published_unstable_motions_exceed_the_stated_invasiveness_limit(cycles):
    """The published search ended before the samples were taken; its target was changed once more."""
    for speed in UNSTABLE:
        found = cycles[f"unstable_v{speed}"]
        assert found.criterion > found.stated_criterion
        assert found.invasive > 0.03
        assert found.heave_m.mean() == pytest.approx(found.stated_m, rel=0.25)


@pytest.mark.parametrize("name", ["stable_v16_5", "unstable_v16_5"])
def test_imported_harmonics_match_a_least_squares_fit_to_the_file(cycles, name):
    heave, target = 0.18 * loadmat(FOLDER / f"CBC_{name}.mat")["data"][:2].astype(float)
    found = cycles[name]
    assert found.largest_m == pytest.approx(heave.max() - heave.mean(), rel=1e-6)
    angle = 2 * np.pi * found.frequency_hz / 50.0 * np.arange(heave.size)
    basis = np.column_stack([f(k * angle) for k in (1, 2, 3) for f in (np.cos, np.sin)] + [0 * angle + 1])
    (a, b), (c, d) = np.linalg.lstsq(basis, np.column_stack([heave, target]), rcond=None)[0][:2].T
    assert found.heave_m.mean() == pytest.approx(np.hypot(a, b), rel=0.01)
    assert found.invasive == pytest.approx(np.hypot(c - a, d - b) / np.hypot(a, b), rel=0.1)
