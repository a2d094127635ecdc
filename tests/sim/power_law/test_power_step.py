"""Long steps of a power law match linear motion and keep their accuracy with soft springs."""

from dataclasses import replace

import numpy as np
import pytest

from vibench.sim import Accuracy, Harmonic, PowerLaw, gong2025, integrate

DRIVE = Harmonic(130.0, 20e-6)
SCALES = np.repeat([1e-4, 0.1], 3)


def test_a_negligible_contact_law_gives_the_linear_motion():
    specimen = replace(gong2025(), contact=PowerLaw(46e-6, ((3, 1e-20),)))
    start = np.array([1e-5, -2e-5, 1.5e-5, 0.01, -0.02, 0.03])
    found = integrate(specimen, DRIVE, 0.1, Accuracy.REFERENCE, start, sample_rate_hz=1e4)
    linear = integrate(gong2025(contact="linear"), DRIVE, 0.1, Accuracy.REFERENCE, start, sample_rate_hz=1e4)
    np.testing.assert_allclose(found.states / SCALES, linear.states / SCALES, atol=2e-11)


def test_very_soft_springs_do_not_reduce_accuracy():
    # m1 and m2 have very soft springs: their modes are a million times slower than the power law.
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
