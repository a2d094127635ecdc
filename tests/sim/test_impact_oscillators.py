"""Impact oscillators of the literature, as a specimen with a frame too heavy to react to the oscillator.

The acceleration of m2 is then prescribed, and p'' + damping p' + p + F(p) equals it: this tests the
engine, its tangent through soft and hard stops, and its statistics.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from vibench.sim import (
    Harmonic,
    LinearGap,
    PowerLaw,
    RigidStops,
    Specimen,
    base_transmissibility,
    integrate,
    lyapunov_exponent,
    lyapunov_spectrum,
)
from vibench.sim.exponents.lyapunov import ExponentVerdict, Source
from vibench.sim.exponents.tangent_run import FinalMotion

HEAVY, FAST, SLOW = 1e10, 3.0, 2.0
"""Mass of m0 and m2 over that of m1, and their natural frequencies; they are damped by half."""
UEDAS_SPRINGS = (HEAVY * FAST**2, 1e-9, HEAVY * SLOW**2)
RECOMPUTED = {
    # (omega, restitution): exponent per unit time, from a closed-form flow with Mueller's correction
    (2.8, 0.8): 0.14202,
    (5.6, 0.8): -0.06629,
    (2.8, 0.95): -0.02286,
    (4.0, 0.95): -0.01633,
}
GRAZING = 0.8019281
"""omega at which a (omega^2) / sqrt((1 - omega^2)^2 + (2 xi omega)^2) = e, with a = 0.7, e = 1.26, xi =
0.01."""


def on_heavy_base(law, gap, damping):
    """Return an oscillator of mass and stiffness 1 with one stop at positive p."""
    return Specimen(
        masses=(HEAVY, 1.0, HEAVY),
        stiffnesses=(HEAVY * FAST**2, 1.0, HEAVY * SLOW**2),
        dampings=(HEAVY * FAST, damping, HEAVY * SLOW),
        gap_m=gap,
        contact=law,
        lower_gap_m=math.inf,
    )


def drive_for(specimen, omega, acceleration):
    """Return the drive that gives m2 a harmonic acceleration of this amplitude."""
    frequency = omega / (2.0 * math.pi)
    moved = abs(base_transmissibility(specimen, frequency)[0, 2])
    return Harmonic(frequency, acceleration / omega**2 / moved)


def hard(omega, restitution):
    """Return x'' + x = cos(omega t), x <= 0, with the stop at the rest position."""
    specimen = on_heavy_base(RigidStops(restitution), 1e-9, 0.0)
    return specimen, drive_for(specimen, omega, 1.0)


def soft(omega):
    """Return x'' + 0.02 x' + x + 29 (x - 1.26) H(x - 1.26) = 0.7 omega^2 sin(omega t), Ing et al.

    Phil. Trans. R. Soc. A 366 (2008) 679.
    """
    specimen = on_heavy_base(LinearGap(29.0), 1.26, 0.02)
    return specimen, drive_for(specimen, omega, 0.7 * omega**2)


def start_at(case, p=0.0, rate=0.0):
    """Return the state at time zero with the frame in steady motion and the oscillator at (p, rate)."""
    specimen, drive = case
    moved = drive.amplitude_m * base_transmissibility(specimen, drive.frequency_hz)[0]
    speed = 2.0 * math.pi * drive.frequency_hz * moved
    state = np.concatenate([moved[:3].imag, speed[:3].real])
    state[1], state[4] = state[2] + p, state[5] + rate
    return state


def exponent(case, omega, periods, p=0.0, rate=0.0):
    period = 2.0 * math.pi / omega
    return lyapunov_exponent(
        *case,
        duration_s=periods * period,
        settle_s=0.2 * periods * period,
        initial_state=start_at(case, p, rate),
        interval_s=2.0 * period,
    )


def next_impact(time, speed, omega):
    """Return time and speed of the next impact of x'' + x = cos(omega t), from x = 0, x' < 0."""
    forced = 1.0 / (1.0 - omega * omega)
    cosine = -forced * math.cos(omega * time)
    sine = speed + forced * omega * math.sin(omega * time)

    def place(later):
        return forced * np.cos(omega * (time + later)) + cosine * np.cos(later) + sine * np.sin(later)

    grid = 1e-9 + np.arange(0.0, 40.0, 2e-3)
    first = int(np.argmax(place(grid) >= 0.0))
    later = brentq(place, grid[first - 1], grid[first], xtol=1e-13)
    reached = (
        -forced * omega * math.sin(omega * (time + later)) - cosine * math.sin(later) + sine * math.cos(later)
    )
    return time + later, reached


@pytest.mark.parametrize("case", RECOMPUTED)
def test_a_hard_impact_oscillator_strikes_at_the_closed_form_times(case):
    omega, restitution = case
    specimen, drive = hard(omega, restitution)
    run = integrate(specimen, drive, 30.0, initial_state=start_at((specimen, drive), rate=-0.5))
    # The frame moves with a phase against the drive, so its acceleration is cos(omega t) at a later time.
    phase = np.angle(base_transmissibility(specimen, drive.frequency_hz)[0, 2])
    late = (phase - 0.5 * math.pi) / omega
    time, speed, expected = late, -0.5, []
    while time < 30.0 + late:
        time, reached = next_impact(time, speed, omega)
        speed = -restitution * reached
        expected.append(time - late)
    assert run.impacts.count == len(expected) - 1 > 8
    np.testing.assert_allclose(run.impacts.times_s, expected[:-1], atol=1e-5)


@pytest.mark.parametrize("case", RECOMPUTED)
def test_a_hard_impact_oscillator_has_the_exponent_of_its_closed_form_flow(case):
    found = exponent(hard(*case), case[0], 6000)
    assert found.exponent_per_s == pytest.approx(
        RECOMPUTED[case], abs=4.0 * found.standard_error_per_s + 2e-4
    )
    assert found.standard_error_per_s < 0.005
    assert (found.verdict is ExponentVerdict.CHAOTIC) == (RECOMPUTED[case] > 0.0)


def test_each_hard_impact_adds_twice_the_logarithm_of_restitution_to_the_sum_of_exponents():
    specimen, drive = hard(2.8, 0.8)
    period = 2.0 * math.pi / 2.8
    found = lyapunov_spectrum(
        specimen, drive, duration_s=3000.0 * period, settle_s=300.0 * period, interval_s=period
    )
    # The sum of the frame's four exponents is the trace of its damping.
    frame = -(FAST + 2.0 * SLOW)
    of_the_oscillator = found.sum_per_s - frame
    assert found.exponents_per_s[0] > 0.1
    assert of_the_oscillator == pytest.approx(2.0 * math.log(0.8) * found.impact_rate_hz, rel=1e-3)
    # Reference: 0.4711 per unit of time, by a separate program over 1e6 units.
    assert found.impact_rate_hz == pytest.approx(0.4711, abs=0.004)


@pytest.mark.parametrize("beyond", [-1e-6, 1e-6])
def test_the_soft_oscillator_grazes_where_its_linear_resonance_reaches_the_stop(beyond):
    omega = GRAZING * (1.0 + beyond)
    case = soft(omega)
    moved = case[1].amplitude_m * base_transmissibility(case[0], case[1].frequency_hz)[0]
    assert abs(moved[3]) == pytest.approx(1.26, rel=1e-4)
    # Started on the linear motion: no impact below grazing, an impact in the first period above.
    found = exponent(case, omega, 600, moved[3].imag, (1j * omega * moved[3]).imag)
    assert (found.impacts > 0) == (beyond > 0.0)
    assert (found.motion is FinalMotion.QUIET) == (beyond < 0.0)


@pytest.mark.thorough
def test_the_ueda_oscillator_has_the_published_exponent():
    # Ueda: x'' + 0.05 x' + x^3 = 7.5 cos t; the linear spring is negligible.
    specimen = replace(on_heavy_base(PowerLaw(1.0, ((3, 1.0),)), 1.0, 0.05), stiffnesses=UEDAS_SPRINGS)
    drive, period = drive_for(specimen, 1.0, 7.5), 2.0 * math.pi
    times = {"settle_s": 200.0 * period, "interval_s": 0.25 * period}
    found = lyapunov_exponent(specimen, drive, duration_s=50_000.0 * period, **times)
    assert found.standard_error_per_s < 1e-3
    assert found.exponent_per_s == pytest.approx(0.1034, abs=4.0 * found.standard_error_per_s)
    spectrum = lyapunov_spectrum(specimen, drive, duration_s=1000.0 * period, **times)
    # The sum is the damping of the two frame masses and of the oscillator.
    assert spectrum.sum_per_s == pytest.approx(-(FAST + 2.0 * SLOW) - 0.05, rel=1e-9)


@pytest.mark.parametrize(("omega", "chaotic", "largest"), [(0.802, 0.0285, 1.4552), (0.8025, 0.0242, 1.4570)])
def test_two_attractors_coexist_just_above_grazing(omega, chaotic, largest):
    case, period = soft(omega), 2.0 * math.pi / omega
    # One of sixteen runs reaches the other attractor during its transient.
    strays = [exponent(case, omega, 5000, p) for p in (1.0, 0.5, 1.2)]
    chaos = [each for each in strays if each.verdict is ExponentVerdict.CHAOTIC]
    assert len(chaos) >= 2
    for each in chaos:
        allowed = 4.0 * math.hypot(each.standard_error_per_s, 5e-4)
        assert each.exponent_per_s == pytest.approx(chaotic, abs=allowed)
    quiet = exponent(case, omega, 2000)
    assert quiet.source is Source.MULTIPLIERS
    # The modulus of a complex pair of multipliers follows from the damping alone.
    assert quiet.exponent_per_s == pytest.approx(-0.01, abs=1e-6)
    orbit = integrate(*case, 10.0 * period, initial_state=quiet.final_state, sample_rate_hz=5000.0 / period)
    assert (orbit.states[:, 1] - orbit.states[:, 2]).max() == pytest.approx(largest, abs=1e-4)
