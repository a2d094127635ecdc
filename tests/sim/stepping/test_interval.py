"""One interval at a time: against the matrix exponential, against scipy, and under symmetry."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.interpolate import CubicSpline
from scipy.linalg import expm

from vibench.sim import Accuracy, gong2025
from vibench.sim.kernels import kernel
from vibench.sim.model import state_matrix
from vibench.sim.stepping import FAILED, advance_interval, base_reaction, interval_tables, new_state


@kernel
def advance_all(state, substeps, tables):
    impacts = 0
    for index in range(len(substeps)):
        impacts += advance_interval(state, substeps[index], tables)
    return impacts


def sine_pieces(frequency_hz, amplitude_m, duration_s, interval_s):
    time_s = np.arange(round(duration_s / interval_s) + 1) * interval_s
    spline = CubicSpline(time_s, amplitude_m * np.sin(2.0 * np.pi * frequency_hz * time_s))
    return np.ascontiguousarray(spline.c[::-1].T)


def exact_linear(specimen, motion, base, duration_s):
    """Flight under a cubic base motion by the exponential of motion and powers of time together."""
    system, entry = state_matrix(specimen)
    stiffness, damping = specimen.stiffnesses[0], specimen.dampings[0]
    force = stiffness * base + damping * np.append(base[1:] * [1.0, 2.0, 3.0], 0.0)
    joint = np.zeros((10, 10))
    joint[:6, :6] = system * duration_s
    joint[:6, 6:] = np.outer(entry, duration_s * duration_s ** np.arange(4) * force)
    for power in range(1, 4):
        joint[6 + power, 5 + power] = power
    return (expm(joint) @ np.concatenate([motion, [1.0, 0.0, 0.0, 0.0]]))[:6]


@pytest.mark.parametrize("interval_s", [1e-6, 1e-5, 1.7e-4, 2e-3])
def test_without_contact_an_interval_is_exact(interval_s):
    specimen = gong2025(contact="linear")
    motion = np.array([3e-5, -2e-5, 1e-5, 0.02, -0.05, 0.03])
    base = np.array([1e-5, 0.01, 5.0 / interval_s**0.5, -1e-6 / interval_s**3])
    state = new_state(specimen, motion)
    assert advance_interval(state, base, interval_tables(specimen, interval_s)) == 0
    expected = exact_linear(specimen, motion, base, interval_s)
    for part in (slice(0, 3), slice(3, 6)):
        error = np.abs(state[part] - expected[part]).max()
        assert error < 1e-12 * np.abs(expected[part]).max()


def test_contact_does_not_depend_on_where_the_intervals_end():
    specimen = gong2025(damping_time_s=3e-5)
    speed = 0.3
    reached = []
    for intervals in (1, 7, 64):
        state = new_state(specimen, accuracy=Accuracy.REFERENCE)
        length = 2e-3 / intervals
        tables = interval_tables(specimen, length, Accuracy.REFERENCE)
        impacts = 0
        for index in range(intervals):
            base = np.array([speed * length * index, speed, 0.0, 0.0])
            impacts += advance_interval(state, base, tables)
        reached.append((impacts, state[:6].copy()))
    assert reached[0][0] > 0
    for impacts, motion in reached[1:]:
        assert impacts == reached[0][0]
        np.testing.assert_allclose(motion[:3], reached[0][1][:3], rtol=0, atol=1e-13)
        np.testing.assert_allclose(motion[3:], reached[0][1][3:], rtol=0, atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(
    frequency_hz=st.floats(50.0, 600.0),
    amplitude_m=st.floats(1e-6, 50e-6),
    damping_time_s=st.floats(0.0, 1e-4),
)
def test_a_mirrored_drive_gives_the_mirrored_motion_to_the_last_bit(
    frequency_hz, amplitude_m, damping_time_s
):
    specimen = gong2025(damping_time_s)
    tables = interval_tables(specimen, 2e-5)
    substeps = sine_pieces(frequency_hz, amplitude_m, 0.05, 2e-5)
    here, there = new_state(specimen), new_state(specimen)
    assert advance_all(here, substeps, tables) == advance_all(there, -substeps, tables)
    np.testing.assert_array_equal(here[:6], -there[:6])


def test_the_cubic_drive_converges_to_the_sine_with_order_four():
    specimen = gong2025(damping_time_s=3e-5, contact="linear")
    motions = []
    for interval_s in (4e-4, 2e-4, 1e-4, 2.5e-6):
        state = new_state(specimen)
        advance_all(state, sine_pieces(130.0, 20e-6, 0.1, interval_s), interval_tables(specimen, interval_s))
        motions.append(state[:3].copy())
    errors = [np.abs(motion - motions[-1]).max() for motion in motions[:-1]]
    assert np.log2(errors[0] / errors[1]) > 3.7
    assert np.log2(errors[1] / errors[2]) > 3.7


def test_the_reaction_is_what_spring_and_damper_say():
    specimen = gong2025()
    state = new_state(specimen, (2e-5, 0.0, 0.0, 0.1, 0.0, 0.0))
    k0, c0 = specimen.stiffnesses[0], specimen.dampings[0]
    force = base_reaction(state, 5e-6, 0.04, interval_tables(specimen, 1e-5))
    assert force == pytest.approx(k0 * 1.5e-5 + c0 * 0.06, rel=1e-14)


def test_a_drive_that_is_not_a_number_is_reported_and_does_not_hang():
    specimen = gong2025()
    base = np.array([0.0, np.nan, 0.0, 0.0])
    assert advance_interval(new_state(specimen), base, interval_tables(specimen, 1e-5)) == FAILED


def test_an_interval_without_length_is_refused():
    with pytest.raises(ValueError, match=r"Interval 0\.0 s is not allowed"):
        interval_tables(gong2025(), 0.0)
