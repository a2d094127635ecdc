"""The Kaplan-Yorke dimension of a system that others have measured: Ueda's oscillator, as a specimen."""

import math

import pytest

from vibench.sim import Harmonic, PowerLaw, Specimen, base_transmissibility, lyapunov_spectrum

HEAVY, FAST = 1e4, 20.0
"""m0 and m2 over m1, and their frequency over the drive's: they follow the base, and m1 moves on m2 alone."""


@pytest.mark.thorough
def test_the_dimension_of_uedas_attractor_is_the_published_one():
    # x'' + 0.05 x' + x^3 = 7.5 sin t: exponents 0.1034, 0, -0.1534 (Sprott, Chaos and Time-Series Analysis).
    heavy = HEAVY * FAST**2
    specimen = Specimen(
        masses=(HEAVY, 1.0, HEAVY),
        stiffnesses=(heavy, 1e-9, heavy),
        dampings=(0.2 * HEAVY * FAST, 0.05, 0.2 * HEAVY * FAST),
        gap_m=1.0,
        contact=PowerLaw(1.0, ((3, 1.0),)),
    )
    carried = abs(base_transmissibility(specimen, 0.5 / math.pi)[0, 2])
    drive = Harmonic(0.5 / math.pi, 7.5 / carried)
    # The plane of the first two tilts a little: their sum is off by some 2 over the duration.
    found = lyapunov_spectrum(specimen, drive, duration_s=1e5, settle_s=400.0, interval_s=2.0 * math.pi)
    largest, second = found.exponents_per_s[:2]
    assert largest == pytest.approx(0.1034, abs=5.0 * found.standard_errors_per_s[0])
    assert largest + second == pytest.approx(-0.05, abs=1e-4)
    low, high = found.dimension_interval(0.999)
    assert low < 1.0 + 0.1034 / 0.1534 < high
    assert high - low < 0.03
