"""What is observed while a run goes by, without keeping the trajectory: peaks and lines. SI units.

A tally is an array: the largest abs(x) and abs(p), and the integrals of x and p against
exp(-i (omega t + phase)). The peaks are extremes of the motion itself, not of samples; the lines are in
closed form over flights, and by the corrected trapezoidal rule (error ~ step^4) over the steps of contacts.
"""

from ..kernels import (
    Complex,
    Vector,
    copy_row,
    fill_series,
    inlined,
    kernel_without_refcount,
    march,
    propagate_by,
    sum_now,
)
from ..slots import (
    LINE_P_IM,
    LINE_P_RE,
    LINE_X_IM,
    LINE_X_RE,
    MODE,
    NOTHING,
    PEAK_P,
    PEAK_X,
    PEAKS_AND_LINES,
    SECANTS,
)
from ._detection import polynomial_at
from ._flight import RUN_OF_STEPS, FlightTables, begin_terms, propagate_phasors

SMALL_EXPONENT = 1e-3
"""Below it (exp(q) - 1)/q is summed as a series, whose fifth term is rounding."""


@inlined
def observe_flight(
    observations: Vector,
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
    if observations[MODE] == NOTHING:
        return
    par = tables.par
    observations[PEAK_X] = _flight_peak(
        observations[PEAK_X], tables.across, phasors, landed, now, terms, series, clock, length, tables
    )
    # Between stops p is nowhere larger than at a stop.
    if observations[PEAK_P] < max(par.lower, par.upper):
        observations[PEAK_P] = _flight_peak(
            observations[PEAK_P], tables.path, phasors, landed, now, terms, series, clock, length, tables
        )
    if observations[MODE] == PEAKS_AND_LINES:
        _add_flight_lines(observations, phasors, landed, length, tables)


@kernel_without_refcount
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
    landed: Complex,
    now: Complex,
    terms: Complex,
    series: Vector,
    clock: Vector,
    length: float,
    tables: FlightTables,
) -> float:
    """Largest magnitude of Re sum shape_j e_j(t) over a flight, or ``best`` if that is larger.

    A grid step is looked at only when the bound on the acceleration lets it beat ``best``, and closely only
    when the rate changes its sign in it.
    """
    h, done = tables.grid, 0.0
    while True:
        if done > 0.0:
            propagate_phasors(now, phasors, done, clock, tables)
        else:
            copy_row(now, phasors)
        reach, bound = begin_terms(terms, now, shape, tables)
        if reach <= best:
            return best
        excess = bound * h * h / 8.0
        steps, made = min(RUN_OF_STEPS, int((length - done) / h)), 0
        while made < steps:
            if abs(sum_now(terms)) + excess <= best:
                made += march(terms, tables.ahead, steps - made, excess - best, best - excess)
                if made == steps:
                    break
            value, rate = sum_now(terms), _rate_now(terms, tables.rates)
            propagate_by(terms, tables.ahead, 1)
            made += 1
            later, rate_later = sum_now(terms), _rate_now(terms, tables.rates)
            best = max(best, abs(value), abs(later))
            if _may_peak(best, value, rate, later, rate_later, h):
                fill_series(series, terms, tables.series)
                best = series_peak(best, series, -h, 0.0)
        done += steps * h
        if steps < RUN_OF_STEPS:
            break
    value, rate = sum_now(terms), _rate_now(terms, tables.rates)
    fill_series(series, terms, tables.series)
    begin_terms(terms, landed, shape, tables)
    later, rate_later = sum_now(terms), _rate_now(terms, tables.rates)
    best = max(best, abs(value), abs(later))
    if _may_peak(best, value, rate, later, rate_later, length - done):
        best = series_peak(best, series, 0.0, length - done)
    return best


@inlined
def _rate_now(terms: Complex, rates: Complex) -> float:
    """Re sum rates_j terms_j."""
    value = 0.0
    for j in range(len(terms)):
        value += rates[j].real * terms[j].real - rates[j].imag * terms[j].imag
    return value


@inlined
def _may_peak(best: float, value: float, rate: float, later: float, rate_later: float, length: float) -> bool:
    """Whether a step that turns may beat ``best``: it stays below the tangents of both ends."""
    return rate * rate_later < 0.0 and (
        min(abs(value) + length * abs(rate), abs(later) + length * abs(rate_later)) > best
    )


@inlined
def _add_flight_lines(
    observations: Vector, phasors: Complex, landed: Complex, length: float, tables: FlightTables
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
    observations[LINE_X_RE] += line_x.real
    observations[LINE_X_IM] += line_x.imag
    observations[LINE_P_RE] += line_p.real
    observations[LINE_P_IM] += line_p.imag


@inlined
def _integral(rate: complex, length: float, first: complex, last: complex) -> complex:
    """Integral over ``length`` of what grows as exp(rate t) from ``first`` to ``last``."""
    real, imag = rate.real * length, rate.imag * length
    if real * real + imag * imag < SMALL_EXPONENT * SMALL_EXPONENT:
        exponent = complex(real, imag)
        tail = exponent / 24.0 * (1.0 + exponent / 5.0)
        return first * (length * (1.0 + exponent * (0.5 + exponent * (1.0 / 6.0 + tail))))
    return (last - first) / rate
