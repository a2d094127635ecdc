"""Periodic motion by harmonic balance, with any number of harmonics, condensed to p. SI units.

The equations P_k + compliance_k F_k(P) = linear_k U, one for every harmonic kept, are solved by damped Newton
iteration with the exact Jacobian. The alternating frequency-time scheme gives the force. Contact needs many
harmonics (51 to 400); power laws need few. Their number is chosen by the effect of neglected harmonics,
which also shows whether the result has converged.
"""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..specimen.specimen import Specimen
from ..specimen.state import Complex, Floats, Table, Vector
from .restoring_force import RestoringForce

# A linear structure seen from its one nonlinear spring. SI units.
#
# M q'' + C q' + K q + b F(p) = e_k U + e_c dU/dt with p = b.q. At harmonic k of the frequency omega the
# linear equations can be solved for q, so that only the scalar p is unknown (Krack and Gross, Harmonic
# Balance for Nonlinear Vibration Problems, Springer 2019, section 2.5):
#
#     P_k = linear_k U - compliance_k F_k,   compliance_k = b.Z_k^-1 b,   Z_k = K - (k w)^2 M + i k w C

Matrix = NDArray[np.float64]
Harmonics = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class LinearStructure:
    """Masses, springs and dampers, with the directions in which nonlinear spring and drive act."""

    mass: Matrix
    """M, shape (n, n), regular [kg]."""
    damping: Matrix
    """C, shape (n, n) [N s/m]."""
    stiffness: Matrix
    """K, shape (n, n), regular [N/m]."""
    direction: Vector
    """b, shape (n,): p = b.q, and the spring pulls with -b F."""
    entry_stiffness: Vector
    """e_k, shape (n,) [N/m]: force per displacement of the drive."""
    entry_damping: Vector
    """e_c, shape (n,) [N s/m]: force per velocity of the drive."""

    def __post_init__(self) -> None:
        size = len(self.direction)
        square = all(table.shape == (size, size) for table in (self.mass, self.damping, self.stiffness))
        if not square or self.entry_stiffness.shape != (size,) or self.entry_damping.shape != (size,):
            raise ValueError(
                f"The matrices and entries of this structure do not fit its direction of {size} places."
            )

    @property
    def size(self) -> int:
        """Degrees of freedom."""
        return len(self.direction)


def structure_of(specimen: Specimen) -> LinearStructure:
    """Return the linear structure without stops: q = (x, y, z), p = y - z, driven at m0 by k0 and c0."""
    return LinearStructure(
        mass=specimen.mass_matrix,
        damping=specimen.damping_matrix,
        stiffness=specimen.stiffness_matrix,
        direction=np.array([0.0, 1.0, -1.0]),
        entry_stiffness=np.array([specimen.stiffnesses[0], 0.0, 0.0]),
        entry_damping=np.array([specimen.dampings[0], 0.0, 0.0]),
    )


class Condensed(NamedTuple):
    """A structure at one frequency, per harmonic; slopes are derivatives by omega."""

    compliance: Complex
    """b.Z_k^-1 b, shape (m,) [m/N]."""
    compliance_slope: Complex
    linear: complex
    """P_1 / U without the spring."""
    linear_slope: complex
    reach: Complex
    """Z_k^-1 b, shape (m, n): every displacement per force in the spring [m/N]."""
    carried: Complex
    """Z_1^-1 e, shape (n,): every displacement over U without the spring."""


def condense(structure: LinearStructure, omega: float, harmonics: Harmonics) -> Condensed:
    """Solve the linear part of the structure at the given multiples of ``omega``.

    Parameters
    ----------
    structure
        Structure; its stiffness must be regular if harmonic 0 is requested.
    omega
        Angular frequency of the drive, positive [rad/s].
    harmonics
        Shape (m,), zero and above.
    """
    turn = harmonics.astype(np.float64)[:, None, None]
    dynamic = _dynamic(structure, omega * turn)
    slope = -2.0 * omega * turn**2 * structure.mass + 1j * turn * structure.damping
    spring = np.broadcast_to(structure.direction[:, None], (len(harmonics), structure.size, 1))
    reach: Complex = np.linalg.solve(dynamic, spring).astype(np.complex128)
    # Z is symmetric (no gyroscopic terms), so that the slope of b.Z^-1 b is -(Z^-1 b).Z' (Z^-1 b).
    bent = (slope @ reach)[:, :, 0]
    first = _dynamic(structure, np.array(omega))
    first_slope = -2.0 * omega * structure.mass + 1j * structure.damping
    entry = structure.entry_stiffness + 1j * omega * structure.entry_damping
    carried: Complex = np.linalg.solve(first, entry).astype(np.complex128)
    moved = np.linalg.solve(first, 1j * structure.entry_damping - first_slope @ carried)
    return Condensed(
        compliance=reach[:, :, 0] @ structure.direction,
        compliance_slope=-np.sum(reach[:, :, 0] * bent, axis=1),
        linear=complex(structure.direction @ carried),
        linear_slope=complex(structure.direction @ moved),
        reach=reach[:, :, 0],
        carried=carried,
    )


def _dynamic(structure: LinearStructure, omega: NDArray[np.float64]) -> Complex:
    return structure.stiffness - omega**2 * structure.mass + 1j * omega * structure.damping


# Between harmonics and time: the alternating frequency-time scheme for one spring. SI units.
#
# p(theta) = Re sum P_k exp(i k theta) over the harmonics kept, theta = omega t in [0, 2 pi). The force and
# its slopes are evaluated on a grid in time and transformed by FFT. The Fourier coefficients S_m and E_m of
# the slopes give the exact Jacobian,
# dF_k = sum_l (S_{k-l} + i l w E_{k-l}) dP_l + (S_{k+l} - i l w E_{k+l}) dP_l*
# (Cameron and Griffin, J. Appl. Mech. 56 (1989) 149; Krack and Gross 2019, section 2.4).

SAMPLES_PER_HARMONIC = 16
"""Grid points per period of the highest harmonic: only components 15 times above it alias."""
FEWEST_SAMPLES = 1024


class ForceHarmonics(NamedTuple):
    """Harmonics of the spring's force, and their derivatives by the harmonics of the motion."""

    force: Complex
    """F_k of the harmonics kept, shape (m,) [N]."""
    holomorphic: Complex
    """dF_k / dP_l, shape (m, m) [N/m]."""
    conjugate: Complex
    """dF_k / dP_l*, shape (m, m) [N/m]."""
    frequency_slope: Complex
    """dF_k / domega at fixed P, shape (m,) [N s]: the rate-dependent part."""


def grid_size(highest: int) -> int:
    """Return the samples per period, a power of two, that resolve harmonics up to ``highest``."""
    return max(FEWEST_SAMPLES, 1 << (SAMPLES_PER_HARMONIC * highest - 1).bit_length())


def waveform(phasors: Complex, harmonics: Harmonics, samples: int) -> Floats:
    """Return one period of Re sum P_k exp(i k theta) on an even grid, shape (samples,)."""
    spectrum = np.zeros(samples // 2 + 1, dtype=np.complex128)
    spectrum[harmonics] = 0.5 * samples * phasors
    if harmonics[0] == 0:
        spectrum[0] = samples * phasors[0].real
    return np.fft.irfft(spectrum, samples)


def phasors_of(wave: Floats) -> Complex:
    """Return all harmonics of a period on an even grid, shape (samples/2 + 1,): inverse of `waveform`."""
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
    # A mean has no conjugate partner: it counts once, not as half of a pair.
    once = np.where(harmonics == 0, 0.5, 1.0)[:, None]
    return ForceHarmonics(
        force=phasors_of(spring.force(p, rate))[harmonics],
        holomorphic=once * holomorphic,
        conjugate=once * conjugate,
        frequency_slope=phasors_of(damping * rate)[harmonics] / omega,
    )


def force_tail(spring: RestoringForce, phasors: Complex, harmonics: Harmonics, omega: float) -> Complex:
    """Return all force harmonics that the grid resolves, shape (samples/2 + 1,), to estimate the error."""
    samples = grid_size(int(harmonics[-1]))
    p, rate = motion_on_grid(phasors, harmonics, omega, samples)
    return phasors_of(spring.force(p, rate))


NEWTON_ITERATIONS = 80
MOST_HALVINGS = 12
ROUNDING = 1e-12
"""Newton's iteration has converged when all residuals are below this part of the spring's length scale."""


class HarmonicSet(StrEnum):
    """Harmonics of a solution."""

    ODD = "odd"
    """Motions that mirror themselves after half a period, as of a symmetric specimen at low levels."""
    ALL = "all"
    """Any motion of the drive's period, including a mean."""


class BalanceEnd(StrEnum):
    """Outcome of a balance, with advice."""

    CONVERGED = "converged"
    TOO_FEW_HARMONICS = "the harmonics left out still matter: allow more, or loosen the tolerance"
    NO_SOLUTION = "Newton's iteration found no solution: start nearer to one, or allow more harmonics"


def harmonics_up_to(highest: int, kept: HarmonicSet) -> Harmonics:
    """Return the harmonic numbers, ascending."""
    if highest < 1:
        raise ValueError(f"Highest harmonic {highest} is not allowed: it must be 1 or more.")
    return np.arange(1, highest + 1, 2) if kept is HarmonicSet.ODD else np.arange(highest + 1)


@dataclass(frozen=True, eq=False)
class BalanceProblem:
    """The equations at one frequency: real unknowns (Re P, Im P) over the spring's length scale."""

    structure: LinearStructure
    spring: RestoringForce
    harmonics: Harmonics

    @property
    def size(self) -> int:
        """Number of real unknowns."""
        return 2 * len(self.harmonics) - int(self.harmonics[0] == 0)

    def packed(self, phasors: Complex) -> Vector:
        """Convert phasors [m] to unknowns."""
        return _real(phasors, self.harmonics) / self.spring.length

    def phasors(self, unknowns: Vector) -> Complex:
        """Convert unknowns to phasors, shape (m,) [m]."""
        scaled = unknowns * self.spring.length
        count = len(self.harmonics)
        imaginary = np.zeros(count)
        imaginary[2 * count - self.size :] = scaled[count:]
        return scaled[:count] + 1j * imaginary

    def linearised(
        self, unknowns: Vector, omega: float, amplitude_m: float
    ) -> tuple[Vector, Table, Vector, Vector]:
        """Return the residual, its Jacobian, and its derivatives by omega and by the drive amplitude.

        Shapes (n,), (n, n), (n,), (n,). Not finite where the force overflows.
        """
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

    def _jacobian(self, seen: Condensed, spring: ForceHarmonics) -> Table:
        count = len(self.harmonics)
        direct = np.eye(count) + seen.compliance[:, None] * spring.holomorphic
        mirrored = seen.compliance[:, None] * spring.conjugate
        plus, minus = direct + mirrored, direct - mirrored
        dropped = 2 * count - self.size
        top = np.hstack([plus.real, -minus.imag[:, dropped:]])
        bottom = np.hstack([plus.imag, minus.real[:, dropped:]])
        return np.vstack([top, bottom[dropped:]])


def _real(phasors: Complex, harmonics: Harmonics) -> Vector:
    """Return real parts, then imaginary parts; a mean has no imaginary part."""
    return np.concatenate([phasors.real, phasors.imag[int(harmonics[0] == 0) :]])


@dataclass(frozen=True, eq=False)
class Balance:
    """A periodic motion in harmonics, with an error estimate."""

    frequency_hz: float
    amplitude_m: float
    harmonics: Harmonics
    relative: Complex
    """Phasors P_k of p, time as exp(+i k w t) under U = A0 sin(w t), shape (m,) [m]."""
    displacements: Complex
    """Phasors of every displacement of the structure, shape (m, n) [m]."""
    left_out: float
    """Error estimate: effect of neglected force harmonics on p, relative to its fundamental."""
    outcome: BalanceEnd

    @property
    def state(self) -> Vector:
        """Displacements and velocities at the drive's time zero, shape (2 n,)."""
        turning = 2j * math.pi * self.frequency_hz * self.harmonics[:, None]
        velocities = turning * self.displacements
        return np.concatenate([self.displacements.real.sum(axis=0), velocities.real.sum(axis=0)])

    @property
    def response_ii(self) -> Vector:
        """Fundamental of every displacement and of p, over the drive amplitude, shape (n + 1,)."""
        first = int(np.searchsorted(self.harmonics, 1))
        lines = np.append(self.displacements[first], self.relative[first])
        return np.asarray(np.abs(lines) / self.amplitude_m)

    @property
    def response_i(self) -> Vector:
        """Largest magnitude over a period of every displacement and of p, over the drive amplitude."""
        samples = grid_size(int(self.harmonics[-1]))
        each = np.column_stack([self.displacements, self.relative]).T
        return np.array([_largest(line, self.harmonics, samples) for line in each]) / self.amplitude_m


def _largest(phasors: Complex, harmonics: Harmonics, samples: int) -> float:
    """Return the largest magnitude on the grid, refined by a parabola through the neighbouring points."""
    wave = np.abs(waveform(phasors, harmonics, samples))
    top = int(np.argmax(wave))
    before, here, after = wave[top - 1], wave[top], wave[(top + 1) % samples]
    bend = before - 2.0 * here + after
    return float(here - 0.125 * (before - after) ** 2 / bend) if bend < 0.0 else float(here)


def newton(problem: BalanceProblem, start: Vector, omega: float, amplitude_m: float) -> tuple[Vector, bool]:
    """Solve by damped Newton iteration, halving steps; return unknowns and success."""
    unknowns = start.copy()
    residual, jacobian, _, _ = problem.linearised(unknowns, omega, amplitude_m)
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
            trial_residual, trial_jacobian, _, _ = problem.linearised(trial, omega, amplitude_m)
            trial_error = size_of(trial_residual)
            if trial_error < error:
                break
        else:
            # No step reduces the error: converged if the error is at rounding level, else failed.
            return unknowns, error < 1e3 * ROUNDING * max(1.0, size_of(unknowns))
        unknowns, residual, jacobian, error = trial, trial_residual, trial_jacobian, trial_error
    return unknowns, error < 1e3 * ROUNDING * max(1.0, size_of(unknowns))


def size_of(values: Vector) -> float:
    """Return the largest magnitude; infinite when anything is not finite."""
    size = float(np.max(np.abs(values)))
    return size if math.isfinite(size) else math.inf


def with_harmonics(phasors: Complex, known: Harmonics, wanted: Harmonics) -> Complex:
    """Return phasors for another set of harmonics; unknown ones are zero."""
    carried = np.zeros(max(int(known[-1]), int(wanted[-1])) + 1, dtype=np.complex128)
    carried[known] = phasors
    return carried[wanted]
