"""What is observed while a run goes by, without keeping the trajectory: peaks and lines. SI units.

A tally is an array: the largest abs(x) and abs(p), and the integrals of x and p against
exp(-i (omega t + phase)). The peaks are extremes of the motion itself, not of samples; the lines are in
closed form over flights, and by the corrected trapezoidal rule (error ~ step^4) over the steps of contacts.
"""

from ..flight import FlightTables, drive_phasor
from ..kernels import Table, Vector, kernel_without_refcount
from ..slots import LINE_P_RE, LINE_X_RE, MODE, PEAK_P, PEAK_X, PEAKS_AND_LINES, SECANTS
from ._contact import DEEPEST, LOG_P, LOG_RATE, LOG_TIME, LOG_VX, LOG_X, LOGGED
from ._flow import gap_of


@kernel_without_refcount
def observe_contact(tally: Vector, log: Table, clock: Vector, tables: FlightTables) -> None:
    """Add the steps of a contact, whose log counts time from clock time."""
    rows = int(log[0, LOGGED])
    deepest = log[0, DEEPEST]
    side = 1.0 if log[1, LOG_P] > 0.0 else -1.0
    tally[PEAK_P] = max(tally[PEAK_P], gap_of(side, tables.par.lower, tables.par.upper) + deepest * deepest)
    at = drive_phasor(clock, log[1, LOG_TIME], tables).conjugate()
    for row in range(1, rows):
        start, end = log[row, LOG_TIME], log[row + 1, LOG_TIME]
        step = end - start
        tally[PEAK_X] = hermite_peak(
            tally[PEAK_X], log[row, LOG_X], log[row, LOG_VX], log[row + 1, LOG_X], log[row + 1, LOG_VX], step
        )
        if tally[MODE] == PEAKS_AND_LINES:
            then = drive_phasor(clock, end, tables).conjugate()
            _add_step(tally, LINE_X_RE, log, row, LOG_X, LOG_VX, at, then, step, tables.omega)
            _add_step(tally, LINE_P_RE, log, row, LOG_P, LOG_RATE, at, then, step, tables.omega)
            at = then


@kernel_without_refcount
def _add_step(
    tally: Vector,
    line: int,
    log: Table,
    row: int,
    value: int,
    rate: int,
    at: complex,
    then: complex,
    step: float,
    omega: float,
) -> None:
    """Trapezoidal rule corrected by the end slopes, of value(t) exp(-i omega t) over one step."""
    before = log[row, value] * at
    after = log[row + 1, value] * then
    slope = complex(log[row, rate], -omega * log[row, value]) * at
    next_slope = complex(log[row + 1, rate], -omega * log[row + 1, value]) * then
    area = 0.5 * step * (before + after) + step * step / 12.0 * (slope - next_slope)
    tally[line] += area.real
    tally[line + 1] += area.imag


@kernel_without_refcount
def hermite_peak(best: float, x0: float, v0: float, x1: float, v1: float, step: float) -> float:
    """Largest abs(x) over a step, x as the cubic through both ends with their velocities."""
    best = max(best, abs(x0), abs(x1))
    if v0 * v1 >= 0.0:
        return best
    rise = x1 - x0
    quadratic = 3.0 * rise - step * (2.0 * v0 + v1)
    cubic = step * (v0 + v1) - 2.0 * rise
    low, high, slope_low, slope_high = 0.0, 1.0, step * v0, step * v1
    for _ in range(SECANTS):
        part = low - slope_low * (high - low) / (slope_high - slope_low)
        slope = step * v0 + part * (2.0 * quadratic + part * 3.0 * cubic)
        best = max(best, abs(x0 + part * (step * v0 + part * (quadratic + part * cubic))))
        if slope * slope_low > 0.0:
            low, slope_low = part, slope
        else:
            high, slope_high = part, slope
    return best
