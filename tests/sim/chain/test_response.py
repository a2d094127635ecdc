"""Responses of chains: against the engine of one cell, samples and closed forms."""

import numpy as np
import pytest
from scipy.integrate import simpson

from vibench.sim import Accuracy, Harmonic, Outcome, gong2025, steady_response
from vibench.sim.chain import chain_of, chain_response, chain_transmissibility, integrate_chain

pytestmark = pytest.mark.timeout(300)
"""The first run compiles the kernels: half a minute of processor time, more on a busy machine."""

PERIODIC = Harmonic(130.0, 20e-6)


def test_one_cell_responds_as_the_specimen():
    specimen = gong2025(damping_time_s=3e-5)
    ours = chain_response(chain_of(specimen, 1), PERIODIC, Accuracy.REFERENCE, 4.0, 1.0)
    theirs = steady_response(specimen, PERIODIC, Accuracy.REFERENCE, 4.0, 1.0)
    assert (ours.impacts[0], ours.impacts_before[0]) == (theirs.impacts, theirs.impacts_before)
    assert ours.response_i[0, 0] == pytest.approx(theirs.response_i, rel=1e-9)
    assert ours.response_i[0, 3] == pytest.approx(theirs.relative_i, rel=1e-9)
    assert ours.lines_m[0, 0] == pytest.approx(theirs.line_x_m, rel=1e-9)
    # The line of p is exact here, a quadrature there.
    assert ours.lines_m[0, 3] == pytest.approx(theirs.line_p_m, rel=1e-7)


def test_peaks_and_lines_are_those_of_a_densely_sampled_run():
    chain, drive = chain_of(gong2025(), 3), Harmonic(220.0, 40e-6)
    start = np.random.default_rng(2).uniform(-1.0, 1.0, (3, 6)) * np.repeat([2e-5, 0.15], 3)
    duration_s = 5.0 / drive.frequency_hz
    response = chain_response(chain, drive, Accuracy.REFERENCE, duration_s, duration_s, start)
    run = integrate_chain(chain, drive, duration_s, Accuracy.REFERENCE, start, sample_rate_hz=1e6)
    assert np.all(response.impacts > 3)
    np.testing.assert_array_equal(response.impacts, run.impacts.per_cell)
    q = run.states[:, :, :3]
    q = np.concatenate([q, q[:, :, 1:2] - q[:, :, 2:3]], axis=2)
    np.testing.assert_allclose(response.largest_m, np.abs(q).max(axis=0), rtol=2e-5)
    turning = np.exp(-2j * np.pi * drive.frequency_hz * run.time_s)[:, None, None]
    period_s = run.time_s[-1]
    lines = 2.0 / period_s * simpson(q * turning, x=run.time_s, axis=0)
    np.testing.assert_allclose(response.lines_m, lines, atol=1e-3 * np.abs(lines).min())


def test_without_contact_both_responses_are_the_transmissibility():
    chain, drive = chain_of(gong2025(contact="linear"), 4), Harmonic(266.0, 1e-6)
    response = chain_response(chain, drive, duration_s=20.0, window_s=0.5)
    moved = chain_transmissibility(chain, drive.frequency_hz)[0]
    np.testing.assert_allclose(response.response_ii, np.abs(moved), rtol=1e-8)
    np.testing.assert_allclose(response.response_i, np.abs(moved), rtol=1e-8)
    # U = A0 sin: its own phasor is -i A0.
    np.testing.assert_allclose(response.lines_m, -1j * drive.amplitude_m * moved, rtol=1e-8)


def test_a_run_that_does_not_reach_its_end_has_no_response():
    response = chain_response(
        chain_of(gong2025(), 2), Harmonic(220.0, 40e-6), duration_s=2.0, window_s=1.0, max_impact_rate_hz=1.0
    )
    assert response.outcome is Outcome.TOO_MANY_IMPACTS
    assert np.all(np.isnan(response.response_i))
    assert np.all(np.isnan(response.response_ii))


@pytest.mark.parametrize(
    ("drive", "window_s", "sentence"),
    [
        (Harmonic(100.0, 0.0), 1.0, r"^A drive of amplitude 0 m .*\.$"),
        (PERIODIC, 3.0, r"^Window 3\.0 s is not allowed: .*\.$"),
        (PERIODIC, 1e-3, r"^Window 0\.001 s is not allowed at 130\.0 Hz: .*\.$"),
    ],
)
def test_what_cannot_be_observed_is_refused_in_one_sentence(drive, window_s, sentence):
    with pytest.raises(ValueError, match=sentence):
        chain_response(chain_of(gong2025(), 2), drive, duration_s=2.0, window_s=window_s)
