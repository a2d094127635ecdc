"""Between harmonics and time: the alternating frequency-time scheme for one spring. SI units.

p(theta) = Re sum P_k exp(i k theta) over the harmonics kept, theta = omega t in [0, 2 pi). The force is
evaluated on a grid in time and brought back by FFT, and so are its slopes: their Fourier coefficients
S_m and E_m make the exact Jacobian,
dF_k = sum_l (S_{k-l} + i l w E_{k-l}) dP_l + (S_{k+l} - i l w E_{k+l}) dP_l*
(Cameron and Griffin, J. Appl. Mech. 56 (1989) 149; Krack and Gross 2019, section 2.4).
"""

from typing import NamedTuple

import numpy as np

from ..model.arrays import Complex, Floats
from .condensation import Harmonics
from .restoring_force import RestoringForce

SAMPLES_PER_HARMONIC = 16
"""Grid points over the highest harmonic: what aliases back lies 15 times above it."""
FEWEST_SAMPLES = 1024


class ForceHarmonics(NamedTuple):
    """The spring's force, in harmonics, and how it answers a change of the motion's harmonics."""

    force: Complex
    """F_k of the harmonics kept, shape (m,) [N]."""
    holomorphic: Complex
    """dF_k / dP_l, shape (m, m) [N/m]."""
    conjugate: Complex
    """dF_k / dP_l*, shape (m, m) [N/m]."""
    frequency_slope: Complex
    """dF_k / domega at fixed P, shape (m,) [N s]: the rate-dependent part."""


def grid_size(highest: int) -> int:
    """Count the samples of a period that resolve harmonics up to ``highest``: a power of two."""
    return max(FEWEST_SAMPLES, 1 << (SAMPLES_PER_HARMONIC * highest - 1).bit_length())


def waveform(phasors: Complex, harmonics: Harmonics, samples: int) -> Floats:
    """One period of Re sum P_k exp(i k theta) on an even grid, shape (samples,)."""
    spectrum = np.zeros(samples // 2 + 1, dtype=np.complex128)
    spectrum[harmonics] = 0.5 * samples * phasors
    if harmonics[0] == 0:
        spectrum[0] = samples * phasors[0].real
    return np.fft.irfft(spectrum, samples)


def phasors_of(wave: Floats) -> Complex:
    """All harmonics of one period on an even grid, shape (samples/2 + 1,): the inverse of `waveform`."""
    spectrum = 2.0 / len(wave) * np.fft.rfft(wave)
    spectrum[0] *= 0.5
    return spectrum


def motion_on_grid(
    phasors: Complex, harmonics: Harmonics, omega: float, samples: int
) -> tuple[Floats, Floats]:
    """Displacement p and dp/dt over one period, shape (samples,) each [m, m/s]."""
    return waveform(phasors, harmonics, samples), waveform(
        1j * harmonics * omega * phasors, harmonics, samples
    )


def force_harmonics(
    spring: RestoringForce, phasors: Complex, harmonics: Harmonics, omega: float
) -> ForceHarmonics:
    """Evaluate the spring in time along a motion given in harmonics; not finite where it overflows."""
    samples = grid_size(int(harmonics[-1]))
    p, rate = motion_on_grid(phasors, harmonics, omega, samples)
    with np.errstate(over="ignore", invalid="ignore"):
        return _brought_back(spring, p, rate, harmonics, omega)


def _brought_back(
    spring: RestoringForce, p: Floats, rate: Floats, harmonics: Harmonics, omega: float
) -> ForceHarmonics:
    samples = len(p)
    damping = spring.damping(p, rate)
    stiffness_lines = np.fft.fft(spring.stiffness(p, rate)) / samples
    damping_lines = np.fft.fft(damping) / samples
    difference = (harmonics[:, None] - harmonics[None, :]) % samples
    total = (harmonics[:, None] + harmonics[None, :]) % samples
    turning = 1j * omega * harmonics[None, :]
    holomorphic = stiffness_lines[difference] + turning * damping_lines[difference]
    conjugate = stiffness_lines[total] - turning * damping_lines[total]
    # A mean has no conjugate partner: it counts once, not as half of a pair.
    once = np.where(harmonics == 0, 0.5, 1.0)[:, None]
    return ForceHarmonics(
        force=phasors_of(spring.force(p, rate))[harmonics],
        holomorphic=once * holomorphic,
        conjugate=once * conjugate,
        frequency_slope=phasors_of(damping * rate)[harmonics] / omega,
    )


def force_tail(spring: RestoringForce, phasors: Complex, harmonics: Harmonics, omega: float) -> Complex:
    """All force harmonics that the grid resolves, shape (samples/2 + 1,): to judge what was left out."""
    samples = grid_size(int(harmonics[-1]))
    p, rate = motion_on_grid(phasors, harmonics, omega, samples)
    return phasors_of(spring.force(p, rate))
