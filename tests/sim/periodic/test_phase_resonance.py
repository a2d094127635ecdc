"""Phase resonance branches over the drive level match integrated motions and linear quadrature."""

import numpy as np
import pytest

from tests.sim.as_written import hardening
from vibench.sim import PhaseReference, gong2025, integrate, phase_resonance_branch
from vibench.sim.specimen.drive import Harmonic
from vibench.sim.specimen.modes import base_transmissibility


@pytest.mark.parametrize(
    ("of", "band_hz"),
    [
        (PhaseReference.RELATIVE, (92.0, 97.0)),
        (PhaseReference.ABSOLUTE, (480.0, 520.0)),
    ],
)
def test_phase_resonance_without_contact_is_where_the_linear_phase_lag_is_90_degrees(of, band_hz):
    specimen = gong2025()
    branch = phase_resonance_branch(specimen, band_hz, (1e-8, 1e-7), of)
    assert np.ptp(branch.frequencies_hz) < 1e-6
    assert branch.amplitudes_m[-1] == pytest.approx(1e-7)
    answer = complex(base_transmissibility(specimen, float(branch.frequencies_hz[0]))[0, 0])
    seen = of.motion(answer)
    assert abs(seen.real) < 1e-6 * abs(seen)
    assert seen.imag < 0
    assert branch.response_ii[:, 0] == pytest.approx(abs(answer), rel=1e-6)


@pytest.mark.thorough
def test_the_motion_at_phase_resonance_of_a_hardening_mode_is_periodic_with_90_degrees_lag():
    specimen = hardening()
    branch = phase_resonance_branch(specimen, (92.0, 97.0), (4e-7, 5e-6))
    assert branch.frequencies_hz[-1] > branch.frequencies_hz[0] + 10.0
    for k in range(0, len(branch.frequencies_hz), 5):
        drive = Harmonic(float(branch.frequencies_hz[k]), float(branch.amplitudes_m[k]))
        period_s = 1 / drive.frequency_hz
        run = integrate(specimen, drive, period_s, "reference", branch.states[k], 512 * drive.frequency_hz)
        assert np.abs(run.final_state[:3] - branch.states[k, :3]).max() < 1e-12
        against = run.states[:512, 0] - drive.amplitude_m * np.sin(2 * np.pi * np.arange(512) / 512)
        # A motion -cos lags the base sine by a quarter period; its cosine coefficient is negative.
        coefficient = 2 * np.mean(against * np.exp(-2j * np.pi * np.arange(512) / 512))
        assert coefficient.real < 0
        assert abs(coefficient.imag) < 1e-6 * abs(coefficient.real)


@pytest.mark.parametrize(
    ("specimen", "band_hz", "levels_m", "said"),
    [
        (gong2025(), (102.0, 107.0), (1e-8, 1e-6), "give a band around one mode"),
        (gong2025(), (92.0, 97.0), (1e-6, 2e-6), "m1 reaches its stops"),
        (gong2025(), (92.0, 97.0), (2e-7, 1e-7), "ascending"),
        (gong2025(), (50.0, 600.0), (1e-8, 1e-7), r"degrees at 94\.6"),
        (gong2025(0.0), (92.0, 97.0), (1e-8, 1e-7), "without damping has no phase resonance"),
    ],
)
def test_a_frequency_band_without_a_single_phase_resonance_is_refused(specimen, band_hz, levels_m, said):
    with pytest.raises(ValueError, match=said):
        phase_resonance_branch(specimen, band_hz, levels_m)


@pytest.mark.thorough
@pytest.mark.parametrize("low_m", [0.1e-6, 0.3e-6])
def test_a_phase_resonance_is_refused_if_its_newton_iteration_fails(low_m):
    """Its last iterate at 17 Hz was once returned as a motion in a band of 92 to 97 Hz."""
    with pytest.raises(ValueError, match="no motion with this phase is found"):
        phase_resonance_branch(gong2025(contact="power:3"), (92.0, 97.0), (low_m, 1.05 * low_m))
