"""A mode fitted to a few points near its resonance, with an uncertainty that matches repetitions."""

import numpy as np
import pytest

from vibench.acquisition.control.resonance_controller import fit_mode
from vibench.sim import gong2025

SPECIMEN = gong2025()
MODES = list(zip(SPECIMEN.natural_frequencies_hz, SPECIMEN.damping_ratios, strict=True))


def response_points(natural_hz, damping, count=7):
    """Return frequencies within one and a half half-widths, and the response of m0 over the base."""
    frequency_hz = natural_hz * (1 + 1.5 * damping * np.linspace(-1, 1, count))
    s = SPECIMEN
    answers = []
    for omega in 2 * np.pi * frequency_hz:
        dynamic = s.stiffness_matrix + 1j * omega * s.damping_matrix - omega**2 * s.mass_matrix
        answers.append(np.linalg.solve(dynamic, [s.stiffnesses[0] + 1j * omega * s.dampings[0], 0, 0])[0])
    return frequency_hz, np.array(answers)


@pytest.mark.parametrize(("natural_hz", "damping"), MODES)
@pytest.mark.parametrize("turned", [0.0, 0.1])
def test_frequency_and_damping_do_not_depend_on_the_phase_of_the_sensor(natural_hz, damping, turned):
    frequency_hz, answers = response_points(natural_hz, damping)
    found = fit_mode(frequency_hz, answers * np.exp(1j * turned))
    assert found.frequency_hz == pytest.approx(natural_hz, rel=1e-4)
    assert found.damping_ratio == pytest.approx(damping, rel=1e-3)


@pytest.mark.parametrize(("natural_hz", "damping"), MODES)
def test_the_stated_mode_uncertainty_matches_the_scatter_of_repetitions(natural_hz, damping):
    random = np.random.default_rng(2)
    frequency_hz, answers = response_points(natural_hz, damping)
    found = []
    for _ in range(300):
        noise = 1e-3 * (random.standard_normal(7) + 1j * random.standard_normal(7))
        found.append(fit_mode(frequency_hz, answers * (1 + noise)))
    spread = np.std([each.frequency_hz for each in found])
    stated = np.sqrt(np.mean([each.frequency_u_hz**2 for each in found]))
    assert stated == pytest.approx(spread, rel=0.25)


def test_four_points_are_too_few_for_a_mode_fit():
    assert fit_mode(*response_points(*MODES[1], count=4)) is None


def test_a_fit_to_scattered_points_never_gives_a_mode_without_damping():
    """Drop-outs once gave "natural frequency 476.54 +- 0.12 Hz, damping ratio -1e-06"."""
    random = np.random.default_rng(3)
    frequency_hz, answers = response_points(*MODES[1])
    found = [
        fit_mode(frequency_hz, answers.mean() * (random.standard_normal(7) + 1j * random.standard_normal(7)))
        for _ in range(300)
    ]
    told = [each for each in found if each is not None]
    assert len(told) < 0.2 * len(found)
    assert all(frequency_hz[0] <= each.frequency_hz <= frequency_hz[-1] for each in told)
    assert all(each.damping_ratio > 0 for each in told)
