"""What is observed while a run goes by, without keeping the trajectory: peaks and lines. SI units.

A tally is an array: the largest abs(x) and abs(p), and the integrals of x and p against
exp(-i (omega t + phase)). The peaks are extremes of the motion itself, not of samples; the lines are in
closed form over flights, and by the corrected trapezoidal rule (error ~ step^4) over the steps of contacts.
"""

from ..compiled import inlined, lean
from ..modes import Complex
from .contact import DEEPEST, LOG_P, LOG_RATE, LOG_TIME, LOG_VX, LOG_X, LOGGED, gap_of
from .detection import polynomial_at
from .flight import RUN_OF_STEPS, FlightTables, begin_terms, drive_phasor, turn_phasors
from .parameters import Table, Vector
from .row import copy_row
from .turning import fill_series, march, sum_now, turn_by

MODE, PEAK_X, PEAK_P, LINE_X_RE, LINE_X_IM, LINE_P_RE, LINE_P_IM = range(7)
TALLY_SIZE = 7
NOTHING, PEAKS, PEAKS_AND_LINES = 0.0, 1.0, 2.0
"""What ``tally[MODE]`` asks for."""
SECANTS = 4
"""Secant steps to an extreme: its value then errs by less than rounding."""
SMALL_EXPONENT = 1e-3
"""Below it (exp(q) - 1)/q is summed as a series, whose fifth term is rounding."""


@inlined
def tally_flight(
    tally: Vector,
    phasors: Complex,
    landed: Complex,
    now: Complex,
    terms: Complex,
    series: Vector,
    clock: Vector,
    length: float,
    tables: FlightTables,
) -> None:
    """Add a flight of ``length`` seconds from clock time, from ``phasors`` to ``landed``."""
    if tally[MODE] == NOTHING:
        return
    for place in (PEAK_X, PEAK_P):
        shape = tables.across if place == PEAK_X else tables.path
        tally[place] = _flight_peak(tally[place], shape, phasors, now, terms, series, clock, length, tables)
    if tally[MODE] == PEAKS_AND_LINES:
        _add_flight_lines(tally, phasors, landed, length, tables)


@lean
def tally_contact(tally: Vector, log: Table, clock: Vector, tables: FlightTables) -> None:
    """Add the steps of a contact, whose log counts time from clock time."""
    rows = int(log[0, LOGGED])
    deepest = log[0, DEEPEST]
    side = 1.0 if log[1, LOG_P] > 0.0 else -1.0
    tally[PEAK_P] = max(tally[PEAK_P], gap_of(side, tables.par) + deepest * deepest)
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


@lean
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


@lean
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


@lean
def series_peak(best: float, series: Vector, low: float, high: float) -> float:
    """Largest magnitude of a polynomial on [low, high], which holds at most one extreme."""
    value_low, slope_low = polynomial_at(series, low)
    value_high, slope_high = polynomial_at(series, high)
    best = max(best, abs(value_low), abs(value_high))
    if slope_low * slope_high >= 0.0:
        return best
    for _ in range(SECANTS):
        tau = low - slope_low * (high - low) / (slope_high - slope_low)
        value, slope = polynomial_at(series, tau)
        best = max(best, abs(value))
        if slope * slope_low > 0.0:
            low, slope_low = tau, slope
        else:
            high, slope_high = tau, slope
        if slope_low == slope_high:
            return best
    return best


@inlined
def _flight_peak(
    best: float,
    shape: Complex,
    phasors: Complex,
    now: Complex,
    terms: Complex,
    series: Vector,
    clock: Vector,
    length: float,
    tables: FlightTables,
) -> float:
    """Largest magnitude of Re sum shape_j e_j(t) over a flight, or ``best`` if that is larger.

    A grid step is looked at closely only when the bound on the acceleration lets it beat ``best``.
    """
    h, done = tables.grid, 0.0
    while True:
        if done > 0.0:
            turn_phasors(now, phasors, done, clock, tables)
        else:
            copy_row(now, phasors)
        reach, bound = begin_terms(terms, now, shape, tables)
        if reach <= best:
            return best
        excess = bound * h * h / 8.0
        steps, made = min(RUN_OF_STEPS, int((length - done) / h)), 0
        if steps == 0:
            fill_series(series, terms, tables.series)
            return series_peak(best, series, 0.0, length - done)
        while True:
            if abs(sum_now(terms)) + excess <= best:
                made += march(terms, tables.ahead, steps - made, excess - best, best - excess)
            if made == steps:
                break
            fill_series(series, terms, tables.series)
            best = series_peak(best, series, 0.0, h)
            turn_by(terms, tables.ahead, 1)
            made += 1
        done += steps * h


@inlined
def _add_flight_lines(
    tally: Vector, phasors: Complex, landed: Complex, length: float, tables: FlightTables
) -> None:
    """Add the integrals of x and p against the drive over a flight, term by term in closed form."""
    drive, terms = complex(0.0, tables.omega), len(phasors)
    before, after = 0.5 * phasors[terms - 1].conjugate(), 0.5 * landed[terms - 1].conjugate()
    line_x, line_p = complex(0.0, 0.0), complex(0.0, 0.0)
    for j in range(terms):
        rate, first, last = tables.rates[j], phasors[j], landed[j]
        along = _integral(rate - drive, length, first * before, last * after)
        against = _integral(
            rate.conjugate() - drive, length, first.conjugate() * before, last.conjugate() * after
        )
        line_x += tables.across[j] * along + tables.across[j].conjugate() * against
        line_p += tables.path[j] * along + tables.path[j].conjugate() * against
    tally[LINE_X_RE] += line_x.real
    tally[LINE_X_IM] += line_x.imag
    tally[LINE_P_RE] += line_p.real
    tally[LINE_P_IM] += line_p.imag


@inlined
def _integral(rate: complex, length: float, first: complex, last: complex) -> complex:
    """Integral over ``length`` of what grows as exp(rate t) from ``first`` to ``last``."""
    real, imag = rate.real * length, rate.imag * length
    if real * real + imag * imag < SMALL_EXPONENT * SMALL_EXPONENT:
        exponent = complex(real, imag)
        tail = exponent / 24.0 * (1.0 + exponent / 5.0)
        return first * (length * (1.0 + exponent * (0.5 + exponent * (1.0 / 6.0 + tail))))
    return (last - first) / rate
