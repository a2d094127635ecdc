import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from vibench.sim import Accuracy, Harmonic, gong2025, integrate
from vibench.sim.scene.plan import linear_motion, never_touches

DRIVE = Harmonic(137.0, 3e-6, phase_rad=0.7)
START = (2e-6, -1e-6, 3e-6, 1e-3, -2e-3, 5e-4)


def test_the_closed_form_without_contact_matches_integration():
    motion = linear_motion(gong2025(contact="linear"), DRIVE, START)
    run = integrate(gong2025(contact="linear"), DRIVE, 0.3, Accuracy.REFERENCE, START, sample_rate_hz=1000.0)
    for time_s, state in zip(run.time_s[::30], run.states[::30], strict=True):
        np.testing.assert_allclose(motion.state(time_s), state, rtol=1e-9, atol=1e-15)


@settings(max_examples=40, deadline=None)
@given(
    frequency_hz=st.floats(1.0, 2000.0),
    phase_rad=st.floats(0.0, 6.0),
    start=st.tuples(*[st.floats(-1e-5, 1e-5)] * 3, *[st.floats(-1e-2, 1e-2)] * 3),
)
def test_the_linear_relative_displacement_stays_within_its_bound(frequency_hz, phase_rad, start):
    motion = linear_motion(gong2025(), Harmonic(frequency_hz, 2e-6, phase_rad), start)
    times = np.linspace(0.0, 0.2, 400)
    p = np.array([motion.state(time_s)[1] - motion.state(time_s)[2] for time_s in times])
    assert np.abs(p).max() <= motion.largest_p_m * (1.0 + 1e-12)


def test_the_linear_relative_displacement_reaches_its_bound_if_modes_and_drive_are_in_phase():
    """Undamped modes and the drive come into phase within 40 s and reach 97 % of the bound."""
    free = linear_motion(gong2025(damping_time_s=0.0, contact="linear"), Harmonic(1.0, 1e-30), (0.0,) * 6)
    assert free.largest_p_m < 1e-25
    pushed = linear_motion(gong2025(damping_time_s=0.0, contact="linear"), DRIVE, START)
    times = np.linspace(0.0, 40.0, 40001)
    turn = np.exp(2j * np.pi * DRIVE.frequency_hz * times + 1j * DRIVE.phase_rad) * pushed.steady_p
    free_p = np.exp(np.outer(times, pushed.rates)) @ (pushed.modes[:, 1] - pushed.modes[:, 2])
    assert 0.97 * pushed.largest_p_m < np.abs((turn + free_p).real).max() <= pushed.largest_p_m


def test_the_transient_has_decayed_at_the_stated_time():
    motion = linear_motion(gong2025(), DRIVE, START)
    when_s = motion.decay_time_s(1e-6)
    later = np.linspace(when_s, when_s + 0.05, 500)
    steady = motion.steady[0] * np.exp(2j * np.pi * DRIVE.frequency_hz * later + 1j * DRIVE.phase_rad)
    left = np.array([motion.state(time_s)[0] for time_s in later]) - steady.real
    assert np.abs(left).max() < 1e-6 * abs(motion.steady_x)
    assert motion.transient_share(when_s) <= 1e-6 * (1.0 + 1e-9)
    assert motion.transient_share(0.5 * when_s) > 1e-5


def test_contact_is_excluded_only_if_a_bound_on_the_motion_proves_it():
    quiet, loud = Harmonic(200.0, 1e-6), Harmonic(200.0, 1e-4)
    for contact in ("hertz", "linear_gap", "rigid:0.8"):
        specimen = gong2025(contact=contact)
        assert never_touches(specimen, linear_motion(specimen, quiet, (0.0,) * 6))
        assert not never_touches(specimen, linear_motion(specimen, loud, (0.0,) * 6))
    soft, none = gong2025(contact="power:3"), gong2025(contact="linear")
    assert not never_touches(soft, linear_motion(soft, quiet, (0.0,) * 6))
    assert never_touches(none, linear_motion(none, loud, (0.0,) * 6))


def test_parameters_that_cause_an_overflow_are_refused_with_a_readable_message():
    with pytest.raises(ValueError, match="cannot be computed: the numbers are too far apart"):
        linear_motion(gong2025(1e300), DRIVE, np.zeros(6))
