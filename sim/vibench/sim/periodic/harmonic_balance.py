"""Periodic motion by harmonic balance, with any number of harmonics, condensed to p. SI units.

P_k + compliance_k F_k(P) = linear_k U for every harmonic kept (`vibench.sim.periodic`), the
force by the alternating frequency-time scheme (`vibench.sim.periodic`), solved by damped
Newton iteration with the exact Jacobian. Contact needs many harmonics (51 to 400); power laws need few. How
many is decided by what the harmonics left out would have added, so that an answer that has not converged
says so.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ..model.arrays import Complex, Table, Vector
from .condensation import Condensed, Harmonics, LinearStructure, condense
from .frequency_time import ForceHarmonics, force_harmonics, grid_size, waveform
from .restoring_force import RestoringForce

NEWTON_ITERATIONS = 80
MOST_HALVINGS = 12
ROUNDING = 1e-12
"""Newton has converged when no equation is off by more than this part of the spring's length scale."""


class HarmonicSet(StrEnum):
    """Which harmonics a solution may have."""

    ODD = "odd"
    """Motions that mirror themselves after half a period: all that a symmetric specimen begins with."""
    ALL = "all"
    """Any motion of the drive's period, a mean included."""


class BalanceEnd(StrEnum):
    """Whether a solution can be trusted, and what to change."""

    CONVERGED = "converged"
    TOO_FEW_HARMONICS = "the harmonics left out still matter: allow more, or loosen the tolerance"
    NO_SOLUTION = "Newton's iteration found no solution: start nearer to one, or allow more harmonics"


def harmonics_up_to(highest: int, kept: HarmonicSet) -> Harmonics:
    """Harmonic numbers, ascending."""
    if highest < 1:
        msg = f"Highest harmonic {highest} is not allowed: it must be 1 or more."
        raise ValueError(msg)
    return np.arange(1, highest + 1, 2) if kept is HarmonicSet.ODD else np.arange(highest + 1)


@dataclass(frozen=True, eq=False)
class BalanceProblem:
    """The equations at one frequency: real unknowns (Re P, Im P) over the spring's length scale."""

    structure: LinearStructure
    spring: RestoringForce
    harmonics: Harmonics

    @property
    def size(self) -> int:
        """Real unknowns."""
        return 2 * len(self.harmonics) - int(self.harmonics[0] == 0)

    def packed(self, phasors: Complex) -> Vector:
        """Phasors [m] as unknowns."""
        return _real(phasors, self.harmonics) / self.spring.length

    def phasors(self, unknowns: Vector) -> Complex:
        """Unknowns as phasors, shape (m,) [m]."""
        scaled = unknowns * self.spring.length
        count = len(self.harmonics)
        imaginary = np.zeros(count)
        imaginary[2 * count - self.size :] = scaled[count:]
        return scaled[:count] + 1j * imaginary

    def linearised(
        self, unknowns: Vector, omega: float, amplitude_m: float
    ) -> tuple[Vector, Table, Vector, Vector]:
        """Residual, its Jacobian, and its derivatives by omega and by the drive amplitude.

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
    """Real parts, then imaginary parts; a mean has none."""
    return np.concatenate([phasors.real, phasors.imag[int(harmonics[0] == 0) :]])


@dataclass(frozen=True, eq=False)
class Balance:
    """A periodic motion in harmonics, and how far to trust it."""

    frequency_hz: float
    amplitude_m: float
    harmonics: Harmonics
    relative: Complex
    """Phasors P_k of p, time as exp(+i k w t) under U = A0 sin(w t), shape (m,) [m]."""
    displacements: Complex
    """Phasors of every displacement of the structure, shape (m, n) [m]."""
    left_out: float
    """What the force harmonics left out would have moved p by, over its fundamental: an error estimate."""
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
    """Largest magnitude of a waveform: the grid's, refined by the parabola through its neighbours."""
    wave = np.abs(waveform(phasors, harmonics, samples))
    top = int(np.argmax(wave))
    before, here, after = wave[top - 1], wave[top], wave[(top + 1) % samples]
    bend = before - 2.0 * here + after
    return float(here - 0.125 * (before - after) ** 2 / bend) if bend < 0.0 else float(here)


def newton(problem: BalanceProblem, start: Vector, omega: float, amplitude_m: float) -> tuple[Vector, bool]:
    """Damped Newton iteration: a step is halved until the residual falls. Gives unknowns and success."""
    unknowns = start.copy()
    residual, jacobian, _, _ = problem.linearised(unknowns, omega, amplitude_m)
    error = _size(residual)
    for _ in range(NEWTON_ITERATIONS):
        if error < ROUNDING * max(1.0, _size(unknowns)):
            return unknowns, True
        try:
            step = np.linalg.solve(jacobian, residual)
        except np.linalg.LinAlgError:
            return unknowns, False
        for halving in range(MOST_HALVINGS):
            trial = unknowns - 0.5**halving * step
            trial_residual, trial_jacobian, _, _ = problem.linearised(trial, omega, amplitude_m)
            trial_error = _size(trial_residual)
            if trial_error < error:
                break
        else:
            # At rounding level no step helps any more: that is convergence, elsewhere it is not.
            return unknowns, error < 1e3 * ROUNDING * max(1.0, _size(unknowns))
        unknowns, residual, jacobian, error = trial, trial_residual, trial_jacobian, trial_error
    return unknowns, error < 1e3 * ROUNDING * max(1.0, _size(unknowns))


def _size(values: Vector) -> float:
    """Largest magnitude; infinite when anything is not finite."""
    size = float(np.max(np.abs(values)))
    return size if math.isfinite(size) else math.inf


def with_harmonics(phasors: Complex, known: Harmonics, wanted: Harmonics) -> Complex:
    """Carry phasors over to another set of harmonics: what is not known is zero."""
    carried = np.zeros(max(int(known[-1]), int(wanted[-1])) + 1, dtype=np.complex128)
    carried[known] = phasors
    return carried[wanted]
