"""Responses I and II of every mass of a chain under one harmonic drive. SI units."""

import cmath
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..engine.run import MAX_IMPACT_RATE_HZ, Accuracy, AccuracyWord, Outcome, Watch
from ..exponents.tangent_run import block_mean
from ..motion.response import Response, steady_response, whole_periods
from ..specimen.contact_laws import PowerLaw
from ..specimen.drive import Harmonic
from ..specimen.specimen import Complex, Floats, Specimen
from ..specimen.stops import member
from ._chain import MASSES_PER_CELL, Chain
from ._integrate import ChainRun, check_work, most_chain_impacts, start_motion
from ._tables import chain_tables, longest_window_s


@dataclass(frozen=True, eq=False)
class ChainResponse:
    """Response of a chain at one drive; NaN if the run did not finish."""

    drive: Harmonic
    accuracy: Accuracy
    duration_s: float
    window_s: float
    """Length of the window, at the end of the run, in which `largest_m` is determined [s]."""
    line_periods: int
    """Number of whole drive periods, at the end of the window, from which `lines_m` is computed."""
    largest_m: Floats
    """Largest abs(x) and abs(p), p = y - z, of every cell in the window, shape (cells, 2)."""
    lines_m: Complex
    """Spectral lines of x, y, z and p at the drive frequency, q = Re(line exp(i (omega t + phase))),
    shape (cells, 4).
    """
    impacts: NDArray[np.int64]
    """Number of contacts that began in the evaluated window, for every cell, shape (cells,)."""
    impacts_before: NDArray[np.int64]
    """Number of contacts that began before the evaluated window, for every cell, shape (cells,)."""
    final_state: Floats
    """x, y, z, vx, vy, vz of every cell at the end, to continue the run, shape (cells, 6)."""
    outcome: Outcome

    @property
    def response_i(self) -> Floats:
        """Largest abs(x) and abs(p) of every cell, divided by the drive amplitude, shape (cells, 2)."""
        return self.largest_m / self.drive.amplitude_m

    @property
    def response_ii(self) -> Floats:
        """Amplitudes of x, y, z, p at the drive frequency, divided by A0, shape (cells, 4)."""
        return np.asarray(np.abs(self.lines_m) / self.drive.amplitude_m, dtype=np.float64)


def chain_response(
    chain: Chain,
    drive: Harmonic,
    accuracy: Accuracy | AccuracyWord = Accuracy.STANDARD,
    duration_s: float = 30.0,
    window_s: float = 5.0,
    initial_state: ArrayLike | None = None,
    *,
    max_impact_rate_hz: float = MAX_IMPACT_RATE_HZ,
) -> ChainResponse:
    """Integrate a chain and return the response of every mass at the end of the run.

    The defaults are those of `vibench.sim.steady_response`, which integrates a single cell. A long chain
    settles more slowly than a single cell. Raises ValueError when the drive amplitude is zero, the window is
    longer than the run or shorter than one drive period, or the run would take hours.

    Parameters
    ----------
    chain, drive, accuracy, duration_s, window_s, max_impact_rate_hz
        As in `vibench.sim.chain.integrate_chain`; ``window_s`` [s] is the evaluated part at the end.
    initial_state
        Initial state of every cell, shape (cells, 6) [m, m/s]; None for rest.
    """
    accuracy = member(Accuracy, accuracy)
    if chain.size == 1:
        (cell,) = chain.cells
        start = None if initial_state is None else start_motion(chain, initial_state)[0]
        one = steady_response(
            cell, drive, accuracy, duration_s, window_s, start, max_impact_rate_hz=max_impact_rate_hz
        )
        return _of_one(cell, one)
    periods = whole_periods(drive, duration_s, window_s)
    tables = chain_tables(chain, drive, accuracy)
    check_work(chain, duration_s, longest_window_s(tables, drive))
    most = most_chain_impacts(chain, max_impact_rate_hz, duration_s)
    run = ChainRun(chain, drive, tables, accuracy, most_impacts=most)
    run.place(start_motion(chain, initial_state), 0.0)
    line_s = periods / drive.frequency_hz
    before, line_start, outcome = 0, run.motion, Outcome.REACHED_END
    ends = (duration_s - window_s, duration_s - line_s, duration_s)
    for watch, until in zip(Watch, ends, strict=True):
        if outcome is Outcome.REACHED_END:
            before = run.impacts if watch is Watch.PEAKS else before
            line_start = run.motion
            run.watch(watch)
            outcome = run.advance(until)
    end = cmath.exp(-1j * (2.0 * math.pi * drive.frequency_hz * duration_s + drive.phase_rad))
    # exp(-i omega t) is the same at the start and the end, because the time is a whole number of periods.
    change = np.asarray((run.motion - line_start) * end, dtype=np.complex128)
    lines = _lines(chain, drive, run.forces, change, line_s)
    void = 1.0 if outcome is Outcome.REACHED_END else math.nan
    impacts = run.impact_cells
    return ChainResponse(
        drive=drive,
        accuracy=accuracy,
        duration_s=duration_s,
        window_s=window_s,
        line_periods=periods,
        largest_m=void * run.peaks_m,
        lines_m=void * lines,
        impacts=np.bincount(impacts[before:], minlength=chain.size),
        impacts_before=np.bincount(impacts[:before], minlength=chain.size),
        final_state=run.motion,
        outcome=outcome,
    )


def _of_one(cell: Specimen, one: Response) -> ChainResponse:
    """Return the response of a specimen as the response of a chain of one cell.

    The line of z follows from m0's equation of motion, multiplied by exp(-i omega t) and integrated by parts.
    """
    drive = one.drive
    omega, line_s = 2.0 * math.pi * drive.frequency_hz, one.line_periods / drive.frequency_hz
    (m0, _, _), (k0, _, k2), (c0, _, c2) = cell.masses, cell.stiffnesses, cell.dampings
    end = cmath.exp(-1j * (omega * one.duration_s + drive.phase_rad))
    # exp(-i omega t) is the same at the start and the end, because the time is a whole number of periods.
    change = (one.final_state - one.line_start_state) * end * 2.0 / line_s
    x, p, base = one.line_x_m, one.line_p_m, -1j * drive.amplitude_m
    moved = change[0] + 1j * omega * x
    accelerated = change[3] + 1j * omega * moved
    pulled = m0 * accelerated + k0 * (x - base) + c0 * (moved - 1j * omega * base) + k2 * x + c2 * moved
    z = (pulled - c2 * change[2]) / (k2 + 1j * omega * c2)
    return ChainResponse(
        drive=drive,
        accuracy=one.accuracy,
        duration_s=one.duration_s,
        window_s=one.window_s,
        line_periods=one.line_periods,
        largest_m=np.array([[one.largest_x_m, one.largest_p_m]]),
        lines_m=np.array([[x, z + p, z, p]]),
        impacts=np.array([one.impacts]),
        impacts_before=np.array([one.impacts_before]),
        final_state=one.final_state[None, :],
        outcome=one.outcome,
    )


def _lines(chain: Chain, drive: Harmonic, forces: Complex, change: Complex, line_s: float) -> Complex:
    """Return the spectral lines of x, y, z and p at the drive frequency from the forces, shape (cells, 4).

    M q'' + C q' + K q = f - F is multiplied by exp(-i omega t) and integrated by parts over whole periods.
    The result is (K + i omega C - omega^2 M) Q = f - F - M (dq' + i omega dq) - C dq, where dq is the change
    of q, and Q, f and F denote the integrals.

    Parameters
    ----------
    chain, drive
        Chain, and its drive.
    forces
        Integral of the contact force of each cell times exp(-i omega t), shape (cells,) [N s].
    change
        Change of the state over ``line_s``, times exp(-i omega t), shape (cells, 6).
    line_s
        Time of integration, a whole number of drive periods [s].
    """
    omega = 2.0 * math.pi * drive.frequency_hz
    first, masses, damping = chain.cells[0], chain.masses, chain.damping_matrix
    push = (first.stiffnesses[0] + 1j * omega * first.dampings[0]) * -1j * drive.amplitude_m
    moved, sped = change[:, :MASSES_PER_CELL].ravel(), change[:, MASSES_PER_CELL:].ravel()
    right = -masses * (sped + 1j * omega * moved) - damping @ moved
    right[0] += push * 0.5 * line_s
    right[1::MASSES_PER_CELL] -= forces
    right[2::MASSES_PER_CELL] += forces
    stiffness = chain.stiffness_matrix + 1j * omega * damping - omega**2 * np.diag(masses)
    lines = np.linalg.solve(stiffness, right) * (2.0 / line_s)
    by_cell = lines.reshape(chain.size, MASSES_PER_CELL)
    return np.column_stack([by_cell, by_cell[:, 1] - by_cell[:, 2]])


def chain_energies(chain: Chain, states: ArrayLike, base_m: ArrayLike = 0.0) -> Floats:
    """Return the energy of every cell, shape (..., cells) [J].

    This energy includes masses, springs (with the link to the previous cell) and stops. A Hunt-Crossley
    contact stores the energy of its Hertz spring. Without damping and base motion, the total is constant.

    Parameters
    ----------
    chain
        Chain of cells.
    states
        x, y, z, vx, vy, vz of every cell in the inertial frame, shape (..., cells, 6) [m, m/s].
    base_m
        Displacement of the base at the same times, shape (...) [m].
    """
    motion = np.asarray(states, dtype=np.float64)
    x, y, z = (motion[..., k] for k in range(MASSES_PER_CELL))
    base = np.broadcast_to(np.asarray(base_m, dtype=np.float64)[..., None], (*x.shape[:-1], 1))
    before = np.concatenate([base, x[..., :-1]], axis=-1)
    masses = np.array([cell.masses for cell in chain.cells])
    springs = np.array([cell.stiffnesses for cell in chain.cells])
    stretched = np.stack([x - before, y - z, z - x], axis=-1)
    smooth = np.sum(masses * motion[..., MASSES_PER_CELL:] ** 2 + springs * stretched**2, axis=-1)
    stops = [_in_stops(cell, (y - z)[..., place]) for place, cell in enumerate(chain.cells)]
    return np.asarray(0.5 * smooth + np.stack(stops, axis=-1), dtype=np.float64)


class MeanEnergies(NamedTuple):
    """Time average of the energy of every cell; each field has shape (cells,)."""

    mean_j: Floats
    standard_error_j: Floats
    """Standard error of the mean energy of every cell, from uncorrelated blocks [J]."""


def mean_energies(chain: Chain, states: ArrayLike, base_m: ArrayLike = 0.0) -> MeanEnergies:
    """Return the mean of `chain_energies` over evenly spaced `states`, shape (n, cells, 6) [m, m/s]."""
    found = [block_mean(row) for row in chain_energies(chain, states, base_m).T]
    return MeanEnergies(
        np.array([each.mean for each in found]), np.array([each.standard_error for each in found])
    )


def _in_stops(cell: Specimen, p: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the energy stored in a cell's contact at the relative displacement p, shape of ``p`` [J]."""
    match cell.contact:
        case PowerLaw(reference=reference, terms=terms):
            part = p / reference
            parts = [force * reference / (n + 1.0) * part ** (n + 1) for n, force in terms]
            return np.asarray(np.sum(parts, axis=0))
        case law:
            lower, upper = cell.gaps_m
            depth = np.maximum(np.maximum(p - upper, -p - lower), 0.0)
            hertz = law.stops.contact_stiffness * depth**2.5 / 2.5
            return np.asarray(0.5 * law.stops.linear_stiffness * depth**2 + hertz)
