"""Stability of a periodic motion: Floquet multipliers from the variational equation. SI units.

Small perturbations d of a motion obey M d'' + (C + e(t) b b') d' + (K + s(t) b b') d = 0 with s = dF/dp and e
= dF/d(dp/dt) along the motion. The monodromy matrix maps perturbations over one period; its eigenvalues
determine stability (Nayfeh and Balachandran, Applied Nonlinear Dynamics, Wiley 1995, section 3.2). Motion
without contact takes one matrix exponential. Contacts begin and end at the exact times at which p reaches a
stop; each contact is integrated by fourth-order Magnus steps (Blanes et al., Phys. Rep. 470 (2009) 151, eq.
253). Steps are shorter near both ends, where the stiffness of a Hertz contact varies like a square root.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy
from numpy.typing import NDArray

from ..engine.run import check_time
from ..specimen.specimen import Complex, Floats
from .harmonic_balance import Harmonics, LinearStructure, grid_size, motion_on_grid, waveform
from .restoring_force import RestoringForce

CONTACT_STEPS = 96
"""Smallest number of Magnus steps in one contact."""
STEPS_PER_TURN = 8.0
"""Number of Magnus steps per radian of the fastest motion of the structure with the compressed spring."""
STEPS_PER_HARMONIC = 16
"""Number of Magnus steps per period of the highest harmonic, for a force that is smooth at every p."""
SMOOTH_STEPS = 128
"""Smallest number of Magnus steps per period, for a force that is smooth at every p."""
BLOCK_STEPS = 4096
"""Number of Magnus steps computed at once, limited to save memory and to check time limits often."""
GAUSS = math.sqrt(3.0) / 6.0
"""Distance of each of the two Gauss points from the middle of a step, relative to the step length."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Harmonics of a periodic motion of p."""

    frequency_hz: float
    harmonics: Harmonics
    relative: Complex
    """Phasors P_k of the harmonics of p, shape (m,) [m]."""

    def p(self, turn: Floats) -> Floats:
        """Return p at the phases ``turn`` [rad] of the drive, shape (k,) [m]."""
        return np.real(np.exp(1j * np.multiply.outer(turn, self.harmonics)) @ self.relative)

    def rate(self, turn: Floats) -> Floats:
        """Return dp/dt at the phases ``turn`` [rad] of the drive, shape (k,) [m/s]."""
        omega = 2.0 * math.pi * self.frequency_hz
        factors = 1j * omega * self.harmonics * self.relative
        return np.real(np.exp(1j * np.multiply.outer(turn, self.harmonics)) @ factors)


def multipliers(monodromy: NDArray[np.float64]) -> Complex:
    """Return the eigenvalues of a monodromy matrix, largest magnitude first, shape (2 n,)."""
    values = np.linalg.eigvals(monodromy).astype(np.complex128)
    return values[np.argsort(-np.abs(values), kind="stable")]


def transition(
    structure: LinearStructure, spring: RestoringForce, motion: Motion, span_rad: float = 2.0 * math.pi
) -> NDArray[np.float64]:
    """Return the matrix that maps perturbations (d, d') at phase 0 to those at ``span_rad``, (2 n, 2 n)."""
    departures = _Departures(structure, spring, motion)
    edges = [0.0, *crossings(spring, motion, span_rad), span_rad]
    result = np.eye(2 * structure.size)
    for start, stop in pairwise(edges):
        result = departures.transition(start, stop) @ result
    return np.asarray(result)


class _Departures:
    """Transition matrices of small perturbations over phase ranges in which no contact begins or ends."""

    def __init__(self, structure: LinearStructure, spring: RestoringForce, motion: Motion) -> None:
        self._structure, self._spring, self._motion = structure, spring, motion
        n = structure.size
        self._system = np.zeros((2 * n, 2 * n))
        """State matrix without the spring, shape (2 n, 2 n)."""
        self._system[:n, n:] = np.eye(n)
        self._system[n:, :n] = -np.linalg.solve(structure.mass, structure.stiffness)
        self._system[n:, n:] = -np.linalg.solve(structure.mass, structure.damping)
        push = -np.linalg.solve(structure.mass, structure.direction)
        self._spring_in = np.concatenate([np.zeros(n), push])
        """Change of the state's time derivative per unit force of the spring, shape (2 n,)."""
        # Largest eigenvalue of the structure plus the frequency that the stiffest spring alone gives [rad/s].
        samples = grid_size(int(motion.harmonics[-1]))
        omega = 2.0 * math.pi * motion.frequency_hz
        p, rate = motion_on_grid(motion.relative, motion.harmonics, omega, samples)
        stiffest = float(np.max(np.abs(spring.stiffness(p, rate))))
        own = float(np.max(np.abs(np.linalg.eigvals(self._system))))
        self._fastest = own + math.sqrt(stiffest * float(-structure.direction @ push))

    def transition(self, start: float, stop: float) -> Floats:
        """Return the transition matrix of small perturbations between two drive phases [rad]."""
        length = (stop - start) / (2.0 * math.pi * self._motion.frequency_hz)
        stiffness, _ = self._slopes(np.array([0.5 * (start + stop)]))
        if self._spring.kinks and stiffness[0] == 0.0:
            return np.asarray(scipy.linalg.expm(self._system * length))
        steps, result = self._steps(self._fastest * length), np.eye(len(self._system))
        for first in range(0, steps, BLOCK_STEPS):
            check_time()
            shares = np.arange(first, min(first + BLOCK_STEPS, steps) + 1) / steps
            if self._spring.kinks:
                shares = 0.5 * (1.0 - np.cos(math.pi * shares))
            result = self._by_magnus(start + (stop - start) * shares) @ result
        return np.asarray(result)

    def _steps(self, turn: float) -> int:
        """Return the number of Magnus steps for a phase advance ``turn`` of the fastest motion [rad]."""
        needed = math.ceil(STEPS_PER_TURN * turn)
        if self._spring.kinks:
            return max(CONTACT_STEPS, needed)
        return max(SMOOTH_STEPS, needed, STEPS_PER_HARMONIC * int(self._motion.harmonics[-1]))

    def _by_magnus(self, marks: Floats) -> Floats:
        """Return the transition matrix over all steps between ``marks``, by fourth-order Magnus steps."""
        widths = np.diff(marks)
        middles = 0.5 * (marks[1:] + marks[:-1])
        early, late = self._rates(middles - GAUSS * widths), self._rates(middles + GAUSS * widths)
        lengths = (widths / (2.0 * math.pi * self._motion.frequency_hz))[:, None, None]
        bracket = late @ early - early @ late
        exponents = 0.5 * lengths * (early + late) + math.sqrt(3.0) / 12.0 * lengths**2 * bracket
        # Take the exponentials by the [3/3] Pade approximant: all eigenvalues are below one.
        squared = exponents @ exponents
        even = np.eye(exponents.shape[-1]) + squared / 10.0
        odd = exponents / 2.0 + squared @ exponents / 120.0
        steps = np.linalg.solve(even - odd, even + odd).astype(np.float64)
        while len(steps) > 1:
            # Multiply the matrices in pairs, so that numpy multiplies whole arrays of matrices.
            pairs = steps[1::2] @ steps[: len(steps) // 2 * 2 : 2]
            steps = np.concatenate([pairs, steps[-1:]]) if len(steps) % 2 else pairs
        return np.asarray(steps[0])

    def _rates(self, turn: Floats) -> Floats:
        """Return the state matrices with the spring at drive phases ``turn`` [rad], shape (k, 2 n, 2 n)."""
        direction = self._structure.direction
        rows = np.concatenate([np.multiply.outer(slope, direction) for slope in self._slopes(turn)], axis=1)
        return np.asarray(self._system + self._spring_in[None, :, None] * rows[:, None, :])

    def _slopes(self, turn: Floats) -> tuple[Floats, Floats]:
        """Return the spring's dF/dp and dF/d(dp/dt) at drive phases ``turn`` [rad], shape (k,) each."""
        p, rate = self._motion.p(turn), self._motion.rate(turn)
        return self._spring.stiffness(p, rate), self._spring.damping(p, rate)


def crossings(spring: RestoringForce, motion: Motion, span_rad: float) -> list[float]:
    """Return the phases from 0 to ``span_rad`` at which p reaches or leaves a stop, ascending [rad]."""
    samples = grid_size(int(motion.harmonics[-1]))
    grid = 2.0 * math.pi * np.arange(samples + 1) / samples
    wave = waveform(motion.relative, motion.harmonics, samples)
    wave = np.append(wave, wave[0])
    found = []
    for stop in spring.kinks:
        above = wave - stop
        for k in np.flatnonzero((above[:-1] < 0.0) != (above[1:] < 0.0)):

            def distance(turn: float, stop: float = stop) -> float:
                return float(motion.p(np.array([turn]))[0]) - stop

            low, high = distance(float(grid[k])), distance(float(grid[k + 1]))
            if low * high < 0.0:
                found.append(float(scipy.optimize.brentq(distance, grid[k], grid[k + 1], xtol=1e-14)))
    return sorted(turn for turn in found if turn <= span_rad)
