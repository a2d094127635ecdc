"""What is observed of a motion under a power law: the same peaks and lines, from long smooth steps. SI units.

Each step is the quintic through both ends with their velocities and accelerations (error h^6/46080 times the
sixth derivative), its line the quadrature that is exact for it (Hermite's, error h^7/100800).
"""

import numpy as np

from ..compiled import compiled
from .contact import LOG_AP, LOG_AX, LOG_P, LOG_RATE, LOG_TIME, LOG_VX, LOG_X, LOGGED
from .flight import FlightTables, drive_phasor
from .parameters import Table, Vector
from .tally import LINE_P_RE, LINE_X_RE, MODE, PEAK_P, PEAK_X, PEAKS_AND_LINES, series_peak

PARTS = 4
"""Parts of a step that are looked at for an extreme each."""


@compiled
def tally_smooth(tally: Vector, log: Table, clock: Vector, tables: FlightTables) -> None:
    """Add the steps of a log, whose time counts from clock time."""
    at = drive_phasor(clock, log[1, LOG_TIME], tables).conjugate()
    quintic = np.zeros(6)
    for row in range(1, int(log[0, LOGGED])):
        start, end = log[row], log[row + 1]
        tally[PEAK_X] = _peak(tally[PEAK_X], quintic, start, end, LOG_X, LOG_VX, LOG_AX)
        tally[PEAK_P] = _peak(tally[PEAK_P], quintic, start, end, LOG_P, LOG_RATE, LOG_AP)
        if tally[MODE] == PEAKS_AND_LINES:
            then = drive_phasor(clock, end[LOG_TIME], tables).conjugate()
            _add_line(tally, LINE_X_RE, start, end, LOG_X, LOG_VX, LOG_AX, at, then, tables.omega)
            _add_line(tally, LINE_P_RE, start, end, LOG_P, LOG_RATE, LOG_AP, at, then, tables.omega)
            at = then


@compiled
def _peak(
    best: float, quintic: Vector, start: Vector, end: Vector, value: int, rate: int, bend: int
) -> float:
    """Largest magnitude over a step, or ``best`` if that is larger."""
    h = end[LOG_TIME] - start[LOG_TIME]
    before, slope, curve = start[value], h * start[rate], 0.5 * h * h * start[bend]
    rise = end[value] - before - slope - curve
    steeper = h * end[rate] - slope - 2.0 * curve
    rounder = h * h * end[bend] - 2.0 * curve
    quintic[0], quintic[1], quintic[2] = before, slope, curve
    quintic[3] = 10.0 * rise - 4.0 * steeper + 0.5 * rounder
    quintic[4] = -15.0 * rise + 7.0 * steeper - rounder
    quintic[5] = 6.0 * rise - 3.0 * steeper + 0.5 * rounder
    reach = 0.0
    for k in range(6):
        reach += abs(quintic[k])
    if reach > best:
        for part in range(PARTS):
            best = series_peak(best, quintic, part / PARTS, (part + 1.0) / PARTS)
    return best


@compiled
def _add_line(
    tally: Vector,
    line: int,
    start: Vector,
    end: Vector,
    value: int,
    rate: int,
    bend: int,
    at: complex,
    then: complex,
    omega: float,
) -> None:
    """Integral of value(t) exp(-i omega t) over one step, from both ends' value, slope and curvature."""
    h = end[LOG_TIME] - start[LOG_TIME]
    turn = complex(0.0, -omega)
    before, after = start[value] * at, end[value] * then
    slope_before = (start[rate] + turn * start[value]) * at
    slope_after = (end[rate] + turn * end[value]) * then
    bend_before = (start[bend] + turn * (2.0 * start[rate] + turn * start[value])) * at
    bend_after = (end[bend] + turn * (2.0 * end[rate] + turn * end[value])) * then
    area = h * (
        0.5 * (before + after)
        + h * (0.1 * (slope_before - slope_after) + h / 120.0 * (bend_before + bend_after))
    )
    tally[line] += area.real
    tally[line + 1] += area.imag
