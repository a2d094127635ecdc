"""Responses of chains match the single specimen, dense samples and closed forms."""

import time

import numpy as np
import pytest
from scipy.integrate import simpson

from vibench.sim import Accuracy, Harmonic, Outcome, gong2025, steady_response
from vibench.sim.chain import (
    Chain,
    chain_of,
    chain_response,
    chain_response_to,
    chain_transmissibility,
    integrate_chain,
)

pytestmark = pytest.mark.timeout(300)
"""The first run compiles the kernels: half a minute of processor time, more on a busy machine."""

PERIODIC = Harmonic(130.0, 20e-6)


@pytest.mark.parametrize(
    "contact", ["hertz", "linear", "power:5", "power:3+5+7", "linear_gap:2e5", "hunt_crossley:0.5"]
)
def test_a_chain_of_one_cell_matches_the_specimen_even_in_chaos(contact):
    specimen, drive = gong2025(contact=contact), Harmonic(220.0, 40e-6)
    ours = chain_response(chain_of(specimen, 1), drive, duration_s=1.0, window_s=0.5)
    theirs = steady_response(specimen, drive, duration_s=1.0, window_s=0.5)
    np.testing.assert_array_equal(ours.final_state[0], theirs.final_state)
    assert (ours.impacts[0], ours.impacts_before[0]) == (theirs.impacts, theirs.impacts_before)
    np.testing.assert_array_equal(ours.largest_m[0], (theirs.largest_x_m, theirs.largest_p_m))
    np.testing.assert_array_equal(ours.lines_m[0, [0, 3]], (theirs.line_x_m, theirs.line_p_m))


@pytest.mark.parametrize(("contact", "cells"), [("hertz", 3), ("power:5", 1)])
def test_peaks_and_spectral_lines_match_a_densely_sampled_run(contact, cells):
    chain, drive = chain_of(gong2025(contact=contact), cells), Harmonic(220.0, 40e-6, phase_rad=0.7)
    start = np.random.default_rng(2).uniform(-1.0, 1.0, (cells, 6)) * np.repeat([2e-5, 0.15], 3)
    duration_s = 5.0 / drive.frequency_hz
    response = chain_response(chain, drive, Accuracy.REFERENCE, duration_s, duration_s, start)
    run = integrate_chain(chain, drive, duration_s, Accuracy.REFERENCE, start, sample_rate_hz=1e6)
    assert np.all(response.impacts > 3) or contact == "power:5"
    np.testing.assert_array_equal(response.impacts, run.impacts.per_cell)
    q = run.states[:, :, :3]
    q = np.concatenate([q, q[:, :, 1:2] - q[:, :, 2:3]], axis=2)
    np.testing.assert_allclose(response.largest_m, np.abs(q).max(axis=0)[:, [0, 3]], rtol=1e-4)
    turn_rad = 2.0 * np.pi * drive.frequency_hz * run.time_s + drive.phase_rad
    lines = 2.0 / run.time_s[-1] * simpson(q * np.exp(-1j * turn_rad)[:, None, None], x=run.time_s, axis=0)
    np.testing.assert_allclose(response.lines_m, lines, atol=1e-3 * np.abs(lines).min())


@pytest.mark.parametrize(
    "contact", ["hertz", "linear_gap:2e5", "hunt_crossley:0.5", "power:5", "power:3+5+7"]
)
def test_largest_values_of_a_long_run_of_unequal_cells_match_dense_samples(contact):
    # Most windows are only summed up; the largest values must still match the samples.
    rng = np.random.default_rng(11)
    gap_m = 45e-6 if contact.startswith("power") else (25e-6, 120e-6)
    cells = tuple(gong2025(contact=contact, gap_m=gap_m, damping_time_s=each) for each in (0.0, 3e-5))
    chain, drive = Chain(cells), Harmonic(180.0, 15e-6, phase_rad=1.1)
    start = rng.normal(size=(2, 6)) * np.repeat([2e-5, 0.1], 3)
    duration_s = 30.0 / drive.frequency_hz
    response = chain_response(chain, drive, "standard", duration_s, duration_s, start)
    run = integrate_chain(chain, drive, duration_s, "standard", start, sample_rate_hz=5e5)
    x, p = run.states[:, :, 0], run.states[:, :, 1] - run.states[:, :, 2]
    sampled = np.stack([np.abs(x).max(axis=0), np.abs(p).max(axis=0)], axis=1)
    np.testing.assert_array_equal(response.final_state, run.final_state)
    assert np.all(response.largest_m > sampled * (1.0 - 2e-6))
    # The nearest sample is within 1 us of the deepest point of a 30 us contact.
    assert np.all(response.largest_m < sampled * (1.0 + 2e-3))


def test_both_chain_responses_without_contact_equal_the_transmissibility():
    chain, drive = chain_of(gong2025(contact="linear"), 4), Harmonic(266.0, 1e-6)
    response = chain_response(chain, drive, duration_s=20.0, window_s=0.5)
    moved = chain_transmissibility(chain, drive.frequency_hz)[0]
    np.testing.assert_allclose(response.response_ii, np.abs(moved), rtol=1e-8)
    np.testing.assert_allclose(response.response_i, np.abs(moved)[:, [0, 3]], rtol=1e-8)
    # The phasor of U = A0 sin is -i A0.
    np.testing.assert_allclose(response.lines_m, -1j * drive.amplitude_m * moved, rtol=1e-8)


@pytest.mark.parametrize(("drive", "duration_s"), [(PERIODIC, 1e12), (Harmonic(1e10, 1e-6), 2.0)])
def test_a_chain_run_that_needs_too_many_windows_is_refused(drive, duration_s):
    with pytest.raises(
        ValueError, match=r"^[\de+]+ s of 2 cells are not allowed: they need .* Shorten the run"
    ):
        chain_response(chain_of(gong2025(), 2), drive, duration_s=duration_s, window_s=1.0)


@pytest.mark.parametrize(
    ("drive", "window_s", "sentence"),
    [
        (Harmonic(100.0, 0.0), 1.0, r"^A response over a drive amplitude of 0 m .*\.$"),
        (PERIODIC, 3.0, r"^Window 3\.0 s is not allowed: .*\.$"),
        (PERIODIC, 1e-3, r"^Window 0\.001 s is not allowed at 130\.0 Hz: .*\.$"),
    ],
)
def test_impossible_observables_are_refused_with_a_readable_message(drive, window_s, sentence):
    with pytest.raises(ValueError, match=sentence):
        chain_response(chain_of(gong2025(), 2), drive, duration_s=2.0, window_s=window_s)


@pytest.mark.parametrize(
    ("contact", "cells", "drive"), [("linear", 4, Harmonic(3e5, 1.0)), ("power:47", 20, Harmonic(42.0, 0.1))]
)
def test_a_requested_computing_time_is_met_even_if_a_window_takes_longer(contact, cells, drive):
    chain = chain_of(gong2025(gap_m=1e-6, contact=contact), cells)
    chain_response(chain, drive, duration_s=1.0 / drive.frequency_hz, window_s=1.0 / drive.frequency_hz)
    began_s = time.thread_time()
    found = chain_response_to(chain, drive, 1e-4, 0.6)
    assert time.thread_time() - began_s < 1.5 * 0.6
    assert found.response.outcome is Outcome.REACHED_END
    assert found.followed_s * drive.frequency_hz == pytest.approx(
        round(found.followed_s * drive.frequency_hz)
    )
    assert np.all(np.isfinite(found.response.lines_m))
    assert np.all(np.isinf(found.errors))


def test_a_computing_time_too_short_for_a_drive_period_is_refused():
    chain = chain_of(gong2025(0.1, 10.0, "power:3"), 4)
    began_s = time.thread_time()
    with pytest.raises(ValueError, match=r"one drive period of 4\.7619 s takes longer to compute"):
        chain_response_to(chain, Harmonic(0.21, 2.71e-7), None, 0.5)
    assert time.thread_time() - began_s < 1.5 * 0.5


@pytest.mark.thorough
def test_an_error_that_a_chain_cannot_reach_in_minutes_ends_the_run_early():
    began_s = time.thread_time()
    found = chain_response_to(chain_of(gong2025(), 2), Harmonic(220.0, 20e-6), 1e-12, None)
    assert time.thread_time() - began_s < 20.0
    assert np.all((found.errors > 1e-12) & (found.errors < 0.3))
