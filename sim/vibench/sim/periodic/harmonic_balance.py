"""Periodic motion by harmonic balance, with any number of harmonics, condensed to p. SI units.

The equations P_k + compliance_k F_k(P) = linear_k U, one for each harmonic in the solution, are solved by a
damped Newton iteration with the exact Jacobian. The alternating frequency-time scheme gives the force F.
Contact needs many harmonics (51 to 400); power laws need few. Harmonics are added until the estimated effect
of the neglected harmonics is small enough.
"""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..engine.run import check_time
from ..specimen.specimen import Complex, Floats, Specimen
from .newton import size_of
from .restoring_force import RestoringForce

# A linear structure with one nonlinear spring, condensed to the spring's elongation p. SI units.
#
# M q'' + C q' + K q + b F(p) = e_k U + e_c dU/dt with p = b.q. For each harmonic k of the drive the equations
# are linear in q and are solved for q, so that only the scalar p is unknown (Krack and Gross, Harmonic
# Balance for Nonlinear Vibration Problems, Springer 2019, section 2.5):
#
#     P_k = linear_k U - compliance_k F_k,   compliance_k = b.Z_k^-1 b,   Z_k = K - (k w)^2 M + i k w C

Harmonics = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class LinearStructure:
    """Linear structure, with the directions of the nonlinear spring and of the drive."""

    mass: Floats
    """Mass matrix M, regular, shape (n, n) [kg]."""
    damping: Floats
    """Damping matrix C, shape (n, n) [N s/m]."""
    stiffness: Floats
    """Stiffness matrix K, regular, shape (n, n) [N/m]."""
    direction: Floats
    """Direction b of the spring, shape (n,): p = b.q, and the spring exerts the force -b F."""
    entry_stiffness: Floats
    """Force on the structure per base displacement, e_k, shape (n,) [N/m]."""
    entry_damping: Floats
    """Force on the structure per base velocity, e_c, shape (n,) [N s/m]."""

    def __post_init__(self) -> None:
        size = len(self.direction)
        square = all(table.shape == (size, size) for table in (self.mass, self.damping, self.stiffness))
        if not square or self.entry_stiffness.shape != (size,) or self.entry_damping.shape != (size,):
            raise ValueError(
                f"The direction of this structure has {size} entries; its matrices have another size."
            )

    @property
    def size(self) -> int:
        """Number of degrees of freedom of the structure."""
        return len(self.direction)


def structure_of(specimen: Specimen) -> LinearStructure:
    """Return the structure without stops: q = (x, y, z), p = y - z, base acting on m0 via k0 and c0."""
    return LinearStructure(
        mass=specimen.mass_matrix,
        damping=specimen.damping_matrix,
        stiffness=specimen.stiffness_matrix,
        direction=np.array([0.0, 1.0, -1.0]),
        entry_stiffness=np.array([specimen.stiffnesses[0], 0.0, 0.0]),
        entry_damping=np.array([specimen.dampings[0], 0.0, 0.0]),
    )


class CondensedStructure(NamedTuple):
    """Structure condensed to p at m harmonics of one frequency; "slope" fields are derivatives d/domega."""

    compliance: Complex
    """Compliance at the spring, b.Z_k^-1 b, for each harmonic, shape (m,) [m/N]."""
    compliance_slope: Complex
    linear: complex
    """Ratio P_1 / U of relative motion to base motion without the spring."""
    linear_slope: complex
    reach: Complex
    """Displacements per unit force of the spring, Z_k^-1 b, shape (m, n) [m/N]."""
    carried: Complex
    """Ratio of the displacements without the spring to U, Z_1^-1 (e_k + i w e_c), shape (n,)."""


def condense(structure: LinearStructure, omega: float, harmonics: Harmonics) -> CondensedStructure:
    """Return the structure condensed to p, at the given harmonics of ``omega``.

    Parameters
    ----------
    structure
        Linear structure; harmonic 0 requires a regular stiffness matrix.
    omega
        Angular frequency of the drive, positive [rad/s].
    harmonics
        Harmonic numbers, zero or positive, shape (m,).
    """
    turn = harmonics.astype(np.float64)[:, None, None]
    dynamic = _dynamic(structure, omega * turn)
    slope = -2.0 * omega * turn**2 * structure.mass + 1j * turn * structure.damping
    spring = np.broadcast_to(structure.direction[:, None], (len(harmonics), structure.size, 1))
    reach: Complex = np.linalg.solve(dynamic, spring).astype(np.complex128)
    # Z is symmetric (no gyroscopic terms), so the slope of b.Z^-1 b is -(Z^-1 b).Z' (Z^-1 b).
    bent = (slope @ reach)[:, :, 0]
    first = _dynamic(structure, np.array(omega))
    first_slope = -2.0 * omega * structure.mass + 1j * structure.damping
    entry = structure.entry_stiffness + 1j * omega * structure.entry_damping
    carried: Complex = np.linalg.solve(first, entry).astype(np.complex128)
    moved = np.linalg.solve(first, 1j * structure.entry_damping - first_slope @ carried)
    return CondensedStructure(
        compliance=reach[:, :, 0] @ structure.direction,
        compliance_slope=-np.sum(reach[:, :, 0] * bent, axis=1),
        linear=complex(structure.direction @ carried),
        linear_slope=complex(structure.direction @ moved),
        reach=reach[:, :, 0],
        carried=carried,
    )


def _dynamic(structure: LinearStructure, omega: NDArray[np.float64]) -> Complex:
    return structure.stiffness - omega**2 * structure.mass + 1j * omega * structure.damping


# Alternating frequency-time scheme for one spring. SI units.
#
# p(theta) = Re sum P_k exp(i k theta) over the harmonics in the solution, with theta = omega t in [0, 2 pi).
# The force and its derivatives are evaluated on a time grid and transformed by FFT. The Fourier coefficients
# S_m of dF/dp and E_m of dF/d(dp/dt) give the exact Jacobian,
# dF_k = sum_l (S_{k-l} + i l w E_{k-l}) dP_l + (S_{k+l} - i l w E_{k+l}) dP_l*
# (Cameron and Griffin, J. Appl. Mech. 56 (1989) 149; Krack and Gross 2019, section 2.4).

SAMPLES_PER_HARMONIC = 16
"""Samples per period of the highest harmonic; components up to 15 times this frequency do not alias."""
FEWEST_SAMPLES = 1024


class ForceHarmonics(NamedTuple):
    """Harmonics of the spring's force, and their derivatives with respect to harmonics of the motion."""

    force: Complex
    """Harmonics F_k of the spring's force, shape (m,) [N]."""
    holomorphic: Complex
    """Derivative dF_k / dP_l, shape (m, m) [N/m]."""
    conjugate: Complex
    """Derivative with respect to the complex conjugate of P_l, dF_k / dP_l*, shape (m, m) [N/m]."""
    frequency_slope: Complex
    """Derivative dF_k / domega at constant P, due to rate-dependent forces, shape (m,) [N s]."""


def grid_size(highest: int) -> int:
    """Return the number of samples per period, a power of two, for harmonics up to ``highest``."""
    return max(FEWEST_SAMPLES, 1 << (SAMPLES_PER_HARMONIC * highest - 1).bit_length())


def waveform(phasors: Complex, harmonics: Harmonics, samples: int) -> Floats:
    """Return one period of the signal Re sum P_k exp(i k theta) on an even grid, shape (samples,)."""
    spectrum = np.zeros(samples // 2 + 1, dtype=np.complex128)
    spectrum[harmonics] = 0.5 * samples * phasors
    if harmonics[0] == 0:
        spectrum[0] = samples * phasors[0].real
    return np.fft.irfft(spectrum, samples)


def phasors_of(wave: Floats) -> Complex:
    """Return all harmonics of one period on an even grid, shape (samples/2 + 1,); inverse of `waveform`."""
    spectrum = 2.0 / len(wave) * np.fft.rfft(wave)
    spectrum[0] *= 0.5
    return spectrum


def motion_on_grid(
    phasors: Complex, harmonics: Harmonics, omega: float, samples: int
) -> tuple[Floats, Floats]:
    """Return p and dp/dt over one period, shape (samples,) each [m, m/s]."""
    return waveform(phasors, harmonics, samples), waveform(
        1j * harmonics * omega * phasors, harmonics, samples
    )


def force_harmonics(
    spring: RestoringForce, phasors: Complex, harmonics: Harmonics, omega: float
) -> ForceHarmonics:
    """Return the harmonics of the spring's force at the harmonics of p; not finite on overflow."""
    samples = grid_size(int(harmonics[-1]))
    p, rate = motion_on_grid(phasors, harmonics, omega, samples)
    with np.errstate(over="ignore", invalid="ignore"):
        return _force_harmonics(spring, p, rate, harmonics, omega)


def _force_harmonics(
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
    # The mean (harmonic 0) has no conjugate partner, so count the mean once, not as half of a pair.
    once = np.where(harmonics == 0, 0.5, 1.0)[:, None]
    return ForceHarmonics(
        force=phasors_of(spring.force(p, rate))[harmonics],
        holomorphic=once * holomorphic,
        conjugate=once * conjugate,
        frequency_slope=phasors_of(damping * rate)[harmonics] / omega,
    )


def force_tail(spring: RestoringForce, phasors: Complex, harmonics: Harmonics, omega: float) -> Complex:
    """Return all force harmonics that the grid resolves, shape (samples/2 + 1,); for the error estimate."""
    samples = grid_size(int(harmonics[-1]))
    p, rate = motion_on_grid(phasors, harmonics, omega, samples)
    return phasors_of(spring.force(p, rate))


NEWTON_ITERATIONS = 80
MOST_HALVINGS = 12
ROUNDING = 1e-12
"""Residual below which Newton's iteration has converged, relative to the spring's length scale."""


class HarmonicSet(StrEnum):
    """Choice of the harmonics that a solution contains."""

    ODD = "odd"
    """Odd harmonics only, for motions that equal the mirror image half a period later (equal gaps)."""
    ALL = "all"
    """All harmonics and the mean: any motion with the drive's period."""


class BalanceEnd(StrEnum):
    """Outcome of a harmonic balance, with advice to the user."""

    CONVERGED = "converged"
    TOO_FEW_HARMONICS = "the harmonics left out still matter: allow more, or loosen the tolerance"
    NO_SOLUTION = "Newton's iteration found no solution: start nearer to a solution, or allow more harmonics"


def harmonics_up_to(highest: int, kept: HarmonicSet) -> Harmonics:
    """Return the harmonic numbers up to ``highest``, ascending, shape (m,)."""
    if highest < 1:
        raise ValueError(f"Highest harmonic {highest} is not allowed: it must be 1 or more.")
    return np.arange(1, highest + 1, 2) if kept is HarmonicSet.ODD else np.arange(highest + 1)


@dataclass(frozen=True, eq=False)
class BalanceProblem:
    """Equations of harmonic balance; the unknowns are (Re P, Im P) divided by the spring's length scale."""

    structure: LinearStructure
    spring: RestoringForce
    harmonics: Harmonics

    @property
    def size(self) -> int:
        """Number of real unknowns of the balance equations."""
        return 2 * len(self.harmonics) - int(self.harmonics[0] == 0)

    def pack(self, phasors: Complex) -> Floats:
        """Return the unknowns for the phasors P_k [m], shape (size,)."""
        return _real(phasors, self.harmonics) / self.spring.length

    def phasors(self, unknowns: Floats) -> Complex:
        """Return the phasors P_k for the unknowns, shape (m,) [m]."""
        scaled = unknowns * self.spring.length
        count = len(self.harmonics)
        imaginary = np.zeros(count)
        imaginary[2 * count - self.size :] = scaled[count:]
        return scaled[:count] + 1j * imaginary

    def linearise(
        self, unknowns: Floats, omega: float, amplitude_m: float
    ) -> tuple[Floats, Floats, Floats, Floats]:
        """Return the residual and its derivatives: Jacobian, d/domega, and d/d(drive amplitude).

        Shapes (n,), (n, n), (n,), (n,). Values are not finite where the force overflows.
        """
        check_time()
        phasors = self.phasors(unknowns)
        seen = condense(self.structure, omega, self.harmonics)
        spring = force_harmonics(self.spring, phasors, self.harmonics, omega)
        first = self.harmonics == 1
        with np.errstate(over="ignore", invalid="ignore"):
            drive = np.where(first, -1j, 0.0)
            residual = phasors + seen.compliance * spring.force - seen.linear * amplitude_m * drive
            bent = (
                seen.compliance_slope * spring.force
                + seen.compliance * spring.frequency_slope
                - seen.linear_slope * amplitude_m * drive
            )
            jacobian = self._jacobian(seen, spring)
        scale = self.spring.length
        by_omega = _real(bent, self.harmonics) / scale
        by_amplitude = _real(-seen.linear * drive, self.harmonics) / scale
        return _real(residual, self.harmonics) / scale, jacobian, by_omega, by_amplitude

    def _jacobian(self, seen: CondensedStructure, spring: ForceHarmonics) -> Floats:
        count = len(self.harmonics)
        direct = np.eye(count) + seen.compliance[:, None] * spring.holomorphic
        mirrored = seen.compliance[:, None] * spring.conjugate
        plus, minus = direct + mirrored, direct - mirrored
        dropped = 2 * count - self.size
        top = np.hstack([plus.real, -minus.imag[:, dropped:]])
        bottom = np.hstack([plus.imag, minus.real[:, dropped:]])
        return np.vstack([top, bottom[dropped:]])


def _real(phasors: Complex, harmonics: Harmonics) -> Floats:
    """Return all real parts, followed by the imaginary parts; the mean (harmonic 0) has no imaginary part."""
    return np.concatenate([phasors.real, phasors.imag[int(harmonics[0] == 0) :]])


@dataclass(frozen=True, eq=False)
class Balance:
    """Harmonics of a periodic motion, with an error estimate."""

    frequency_hz: float
    amplitude_m: float
    harmonics: Harmonics
    relative: Complex
    """Phasors P_k of p for exp(+i k w t) and the drive U = A0 sin(w t), shape (m,) [m]."""
    displacements: Complex
    """Phasors of every displacement of the structure, shape (m, n) [m]."""
    left_out: float
    """Error estimate: change of p due to neglected force harmonics, relative to the fundamental of p."""
    outcome: BalanceEnd

    @property
    def state(self) -> Floats:
        """Displacements and velocities at time zero of the drive, shape (2 n,)."""
        turning = 2j * math.pi * self.frequency_hz * self.harmonics[:, None]
        velocities = turning * self.displacements
        return np.concatenate([self.displacements.real.sum(axis=0), velocities.real.sum(axis=0)])

    @property
    def response_ii(self) -> Floats:
        """Amplitude of every displacement and of p at the drive frequency, divided by A0, shape (n + 1,)."""
        first = int(np.searchsorted(self.harmonics, 1))
        lines = np.append(self.displacements[first], self.relative[first])
        return np.asarray(np.abs(lines) / self.amplitude_m)

    @property
    def response_i(self) -> Floats:
        """Largest magnitude of every displacement and of p, divided by A0, shape (n + 1,)."""
        samples = grid_size(int(self.harmonics[-1]))
        each = np.column_stack([self.displacements, self.relative]).T
        return np.array([_largest(line, self.harmonics, samples) for line in each]) / self.amplitude_m


def _largest(phasors: Complex, harmonics: Harmonics, samples: int) -> float:
    """Return the largest magnitude of a waveform, refined by a parabola through three samples."""
    wave = np.abs(waveform(phasors, harmonics, samples))
    top = int(np.argmax(wave))
    before, here, after = wave[top - 1], wave[top], wave[(top + 1) % samples]
    bend = before - 2.0 * here + after
    return float(here - 0.125 * (before - after) ** 2 / bend) if bend < 0.0 else float(here)


def newton(problem: BalanceProblem, start: Floats, omega: float, amplitude_m: float) -> tuple[Floats, bool]:
    """Solve the balance by Newton's method with step halving; return unknowns, and whether they converged."""
    unknowns = start.copy()
    residual, jacobian, _, _ = problem.linearise(unknowns, omega, amplitude_m)
    error = size_of(residual)
    for _ in range(NEWTON_ITERATIONS):
        if error < ROUNDING * max(1.0, size_of(unknowns)):
            return unknowns, True
        try:
            step = np.linalg.solve(jacobian, residual)
        except np.linalg.LinAlgError:
            return unknowns, False
        for halving in range(MOST_HALVINGS):
            trial = unknowns - 0.5**halving * step
            trial_residual, trial_jacobian, _, _ = problem.linearise(trial, omega, amplitude_m)
            trial_error = size_of(trial_residual)
            if trial_error < error:
                break
        else:
            # No step reduces the error. If the error is at rounding level, the iteration has converged.
            return unknowns, error < 1e3 * ROUNDING * max(1.0, size_of(unknowns))
        unknowns, residual, jacobian, error = trial, trial_residual, trial_jacobian, trial_error
    return unknowns, error < 1e3 * ROUNDING * max(1.0, size_of(unknowns))


def with_harmonics(phasors: Complex, known: Harmonics, wanted: Harmonics) -> Complex:
    """Return the phasors for another set of harmonics; harmonics without a known phasor are zero."""
    carried = np.zeros(max(int(known[-1]), int(wanted[-1])) + 1, dtype=np.complex128)
    carried[known] = phasors
    return carried[wanted]
