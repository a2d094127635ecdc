"""The long steps of a power law: their numbers against a matrix exponential, and what is seen within them."""

from dataclasses import replace

import numpy as np
import pytest

from vibench.sim import Accuracy, Harmonic, PowerLaw, gong2025, integrate
from vibench.sim.flight import WIDE, P
from vibench.sim.model import state_matrix
from vibench.sim.power_law import FEED, FREE, GAIN, MOVE
from vibench.sim.power_law._numbers import INNER
from vibench.sim.power_law._tables import POINTS_AT
from vibench.sim.scene._followed_run import FollowedRun, ObservedQuantities
from vibench.sim.stepping import harmonic_tables

DRIVE = Harmonic(130.0, 20e-6)
LAW = "power:3+5+7"


def linear_part(tables):
    """A of du/dt = A u and what a unit of F adds to du/dt, from the series that the engine uses."""
    series = tables.steps.series
    return series.powers[1].T * series.fastest, series.struck[0]


def expm(matrix):
    """exp(matrix) in extended precision: scipy's is off by up to 2e-13 of its largest number."""
    halvings = max(0, int(np.ceil(np.log2(np.abs(matrix).sum(axis=1).max()))) + 2)
    scaled = np.ldexp(np.asarray(matrix, dtype=np.longdouble), -halvings)
    term = total = np.eye(len(matrix), dtype=np.longdouble)
    for order in range(1, 30):
        term = term @ scaled / order
        total = total + term
    for _ in range(halvings):
        total = total @ total
    return total


def test_the_linear_part_is_the_specimens_own_and_turns_the_drives_phase():
    specimen = gong2025(contact=LAW)
    matrix, struck = linear_part(harmonic_tables(specimen, DRIVE))
    system, _ = state_matrix(specimen)
    to_own = np.array([[0, 1, -1], [1, 0, 0], [0, 0, 1]])
    turn = np.kron(np.eye(2), to_own)
    np.testing.assert_allclose(
        matrix[:6, :6], turn @ system @ np.linalg.inv(turn), rtol=1e-12, atol=1e-9 * np.abs(system).max()
    )
    omega = 2.0 * np.pi * DRIVE.frequency_hz
    np.testing.assert_allclose(matrix[6:, 6:], [[0.0, -omega], [omega, 0.0]], rtol=1e-14)
    m1, m2 = specimen.masses[1:]
    np.testing.assert_allclose(struck, [0, 0, 0, -1 / m1 - 1 / m2, 0, 1 / m2, 0, 0])


@pytest.mark.parametrize("level", [0, 3, 20])
def test_the_numbers_of_a_step_are_those_of_the_matrix_exponential(level):
    tables = harmonic_tables(gong2025(contact=LAW), DRIVE)
    matrix, struck = linear_part(tables)
    numbers, length = tables.steps.levels[level], tables.steps.lengths[level]
    scales = np.ones(WIDE)
    scales[3:6] = tables.steps.series.fastest
    whole = expm(matrix * length) - np.eye(WIDE)
    size = np.abs(whole / scales[:, None] * scales).max()
    np.testing.assert_allclose(
        (numbers[MOVE : MOVE + WIDE].T - whole) / scales[:, None] * scales / size, 0.0, atol=1e-13
    )
    for i, part in enumerate(POINTS_AT):
        there = expm(matrix * (part * length))
        np.testing.assert_allclose(
            numbers[FREE : FREE + WIDE, i], there[P], atol=1e-13 * np.abs(there[P]).max()
        )
    # A force that stays as it is: the sum over the points of what each value of it does.
    steady = np.zeros((WIDE + 1, WIDE + 1))
    steady[:WIDE, :WIDE], steady[:WIDE, WIDE] = matrix * length, struck * length
    made = expm(steady)[:WIDE, WIDE]
    np.testing.assert_allclose(numbers[FEED : FEED + WIDE].sum(axis=0), made, rtol=1e-11, atol=1e-18)
    inner = numbers[INNER + WIDE : INNER + 2 * WIDE].sum(axis=0)
    assert inner[P] == pytest.approx(numbers[GAIN : GAIN + WIDE, 0].sum(), rel=1e-11)


@pytest.mark.parametrize("contact", ["power:3", "power:47"])
def test_samples_and_peaks_are_the_motions_own_whatever_the_steps(contact):
    specimen, until = gong2025(contact=contact), 0.05
    plain = integrate(specimen, DRIVE, until, Accuracy.REFERENCE)
    dense = integrate(specimen, DRIVE, until, Accuracy.REFERENCE, sample_rate_hz=1e6)
    np.testing.assert_array_equal(dense.final_state, plain.final_state)
    for place in (1234, 20_001):
        reached = integrate(specimen, DRIVE, dense.time_s[place], Accuracy.REFERENCE).final_state
        np.testing.assert_allclose(dense.states[place], reached, atol=1e-13, rtol=1e-7)
    run = FollowedRun(specimen, DRIVE, Accuracy.REFERENCE.tolerance, np.zeros(6))
    seen = run.follow(until, ObservedQuantities.PEAKS)
    p = np.abs(dense.states[:, 1] - dense.states[:, 2])
    for peak, sampled in ((seen.peak_x_m, np.abs(dense.states[:, 0])), (seen.peak_p_m, p)):
        # Between samples 1 us apart a peak may hide: a millionth of it at the fastest rate of this motion.
        assert sampled.max() <= peak * (1.0 + 1e-12)
        assert sampled.max() == pytest.approx(peak, rel=2e-6)


def test_springs_far_softer_than_the_law_cost_no_digits():
    # m1 and m2 on next to nothing: the modes turn a million times more slowly than the law does.
    soft = replace(
        gong2025(damping_time_s=0.0), stiffnesses=(1e-6, 1e-6, 1e-6), contact=PowerLaw(46e-6, ((3, 5.0),))
    )
    start = np.array([0.0, 20e-6, -20e-6, 0.0, 0.0, 0.0])
    run = integrate(soft, Harmonic(1.0, 0.0), 0.05, Accuracy.REFERENCE, start)
    m1, m2 = soft.masses[1:]
    p, rate = run.final_state[1] - run.final_state[2], run.final_state[4] - run.final_state[5]
    held = [5.0 / 46e-6**3 * each**4 / 4.0 for each in (40e-6, p)]
    moving = 0.5 * m1 * m2 / (m1 + m2) * rate**2
    assert held[1] + moving == pytest.approx(held[0], rel=1e-9)
