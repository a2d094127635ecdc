import numpy as np
import pytest
from scipy.integrate import simpson

from vibench.sim import (
    Accuracy,
    Harmonic,
    Outcome,
    base_transmissibility,
    gong2025,
    integrate,
    steady_response,
)


@pytest.mark.parametrize("frequency_hz", [7.3, 60.0, 266.2, 601.7])
def test_both_responses_without_contact_are_the_exact_transmissibility(frequency_hz):
    specimen, drive = gong2025(contact="linear"), Harmonic(frequency_hz, 5e-6)
    response = steady_response(specimen, drive)
    x, _, _, p = base_transmissibility(specimen, frequency_hz)[0]
    assert response.response_i == pytest.approx(abs(x), rel=1e-9)
    assert response.response_ii == pytest.approx(abs(x), rel=1e-9)
    assert response.relative_i == pytest.approx(abs(p), rel=1e-9)
    assert response.relative_ii == pytest.approx(abs(p), rel=1e-9)
    assert response.line_x_m == pytest.approx(-1j * x * drive.amplitude_m, rel=1e-9)
    assert response.impacts == 0


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("contact", "drive"),
    [
        ("hertz", Harmonic(130.0, 20e-6)),
        ("power:5", Harmonic(130.0, 20e-6)),
        ("power:29", Harmonic(130.0, 20e-6)),
        ("rigid:0", Harmonic(200.0, 50e-6)),
        ("rigid:0.6", Harmonic(200.0, 50e-6)),
        ("rigid:0.9", Harmonic(130.0, 20e-6)),
    ],
)
def test_the_responses_match_the_trajectory(contact, drive):
    specimen = gong2025(damping_time_s=1e-4 if contact.startswith("power") else 3e-5, contact=contact)
    response = steady_response(specimen, drive, Accuracy.REFERENCE, duration_s=0.5, window_s=0.1)
    run = integrate(specimen, drive, 0.5, Accuracy.REFERENCE, sample_rate_hz=4e5)
    window = run.time_s > 0.4 - 1e-9
    x, p = run.states[window, 0], (run.states[:, 1] - run.states[:, 2])[window]
    against = 2.0 * np.exp(-2j * np.pi * drive.frequency_hz * run.time_s[window])
    assert response.largest_x_m == pytest.approx(np.abs(x).max(), rel=1e-5)
    assert response.largest_p_m == pytest.approx(np.abs(p).max(), rel=2e-4)
    assert response.line_x_m == pytest.approx(simpson(x * against, x=run.time_s[window]) / 0.1, rel=1e-5)
    assert response.line_p_m == pytest.approx(simpson(p * against, x=run.time_s[window]) / 0.1, rel=1e-5)
    assert response.impacts == np.count_nonzero(run.impacts.times_s > 0.4)


def test_a_run_that_did_not_reach_its_end_has_no_response():
    response = steady_response(gong2025(), Harmonic(130.0, 20e-6), max_impact_rate_hz=1.0)
    assert response.outcome is Outcome.TOO_MANY_IMPACTS
    assert np.isnan(response.response_i)
    assert np.isnan(response.response_ii)
