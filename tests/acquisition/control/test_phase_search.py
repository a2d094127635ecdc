"""The search for a phase resonance on a known phase curve."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from vibench.acquisition.control.control_action import MeasuredLevel
from vibench.acquisition.control.phase_law import PhaseError, PhaseSearch
from vibench.acquisition.control.resonance_controller import _phase_error
from vibench.acquisition.control.settling_controller import SettledState
from vibench.acquisition.control.steadiness import Judgement, Periods
from vibench.acquisition.excitation.resonance_tracking import ResonanceTracking
from vibench.acquisition.recording import Hold, Steadiness


def error_deg(frequency_hz, natural_hz, damping):
    """Return how far the phase of the relative motion is above -90 degrees, for a base-excited oscillator."""
    ratio = frequency_hz / natural_hz
    return float(np.degrees(np.angle(1 / (1 - ratio**2 + 2j * damping * ratio)))) + 90


def run_search(natural_hz, damping, start_hz, noise_deg=0.0, seed=0):
    random = np.random.default_rng(seed)
    search = PhaseSearch(0.5 * natural_hz, 2 * natural_hz, widest_step_hz=0.01 * natural_hz)
    frequency_hz = start_hz
    for _ in range(25):
        error = error_deg(frequency_hz, natural_hz, damping) + noise_deg * random.standard_normal()
        search.tries.append(PhaseError(frequency_hz, error, noise_deg))
        if abs(error) < 1 and len(search.tries) > 1:
            break
        frequency_hz = search.next_hz()
    return search


@settings(max_examples=60)
@given(damping=st.floats(0.004, 0.05), start=st.floats(0.93, 1.07))
def test_the_search_locks_onto_sharp_and_broad_modes_from_both_sides(damping, start):
    search = run_search(266.0, damping, 266.0 * start)
    assert abs(search.tries[-1].error_deg) < 1
    found = search.resonance(0.0)
    assert found.frequency_hz == pytest.approx(266.0, abs=266 * damping * 0.02)
    assert abs(found.frequency_hz - 266.0) <= 2 * found.uncertainty_hz + 1e-6


def test_the_stated_frequency_uncertainty_covers_the_error_from_noise():
    found = [run_search(266.0, 0.0167, 262.0, noise_deg=0.3, seed=seed).resonance(0.0) for seed in range(200)]
    away = np.array([each.frequency_hz - 266.0 for each in found])
    stated = np.array([each.uncertainty_hz for each in found])
    assert np.mean(np.abs(away) <= 2 * stated) > 0.9


def test_the_phase_error_of_the_sensors_widens_the_frequency_uncertainty():
    search = run_search(266.0, 0.0167, 262.0)
    slope = 2 / (2 * 0.0167 * 266.0) * 180 / np.pi
    assert search.resonance(0.3).uncertainty_hz == pytest.approx(0.3 / slope, rel=0.15)


def test_the_phase_search_stays_in_its_frequency_range():
    search = PhaseSearch(260.0, 270.0, 4.0, [PhaseError(258.0 + 4, 80.0, 0.1), PhaseError(268.0, 70.0, 0.1)])
    assert search.next_hz() == 270.0


def test_a_phase_error_beyond_90_degrees_does_not_count_as_a_resonance():
    tries = [PhaseError(100.0, 130.0, 1.0), PhaseError(101.0, 120.0, 1.0)]
    found = PhaseSearch(90.0, 110.0, 1.0, tries).resonance(0.3)
    assert found.frequency_hz == 101.0
    assert found.uncertainty_hz == np.inf
    assert found.half_width_hz == 0.0


def test_the_slope_of_an_irregular_phase_is_computed_near_the_resonance():
    """The phase falls by 300 degrees per hertz at resonance, and hardly at all further off."""
    tries = [PhaseError(192 + 0.25 * n, 18.0 - n, 0.1) for n in range(4)]
    tries += [PhaseError(193.09 + off, -300.0 * off + 0.3, 0.1) for off in (-0.02, 0.01, 0.0)]
    found = PhaseSearch(190.0, 195.0, 0.5, tries, is_mode=False).resonance(0.3)
    assert found.frequency_hz == pytest.approx(193.091, abs=1e-4)
    assert found.slope_deg_per_hz == pytest.approx(-300.0, rel=0.01)
    assert PhaseSearch(190.0, 195.0, 0.5, tries).resonance(0.3).slope_deg_per_hz > -100.0


def uncertainty_deg(response, **plan):
    """Return the phase uncertainty [deg] of a motion, shape (periods, 5), over a base without noise."""
    periods = Periods(np.ones(len(response), complex), response)
    judgement = Judgement(Steadiness.PERIODIC, 1, 0.0, 0.0, 0.0, 0.0)
    base = MeasuredLevel(1.0, 0.0)
    harmonics = tuple(response[:, 1:].mean(axis=0))
    found = SettledState(95.0, 95.0, 1.0, 1.0, judgement, base, Hold.WITHIN, harmonics)
    tracking = ResonanceTracking(
        amplitude_vpp=1, start_hz=95, low_hz=90, high_hz=99, accelerations_m_per_s2=(1,), **plan
    )
    return _phase_error(periods, found, tracking).uncertainty_deg


@pytest.mark.parametrize("plan", [{"harmonic": 2}, {"harmonic": 3}, {"subharmonic": 2}, {"subharmonic": 3}])
def test_only_signals_above_noise_have_a_phase(plan):
    """The phases of eight noise periods scatter by 100 degrees, so their mean seems known to 30 degrees."""
    known = []
    for seed in range(300):
        random = np.random.default_rng(seed)
        noise = random.standard_normal((160, 5)) + 1j * random.standard_normal((160, 5))
        known.append(uncertainty_deg(noise, **plan) <= 30)
        assert uncertainty_deg(noise + 6.0, **plan) <= 10
    assert sum(known) <= 3
