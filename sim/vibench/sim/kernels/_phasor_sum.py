"""A sum of phasors, sixteen numbers of it at once: at the next grid steps, or of its series. SI units.

Each term turns and shrinks at its own rate, so that every such number is a sum of rows with the terms as
weights: nothing waits for the step or the coefficient before.
"""

import math

import numpy as np

from ._arrays import Complex, Table, Vector
from ._compile import inlined
from ._simd import SimdVector, first_outside, sixteen, store

STEPS_AHEAD = 16
"""Steps that are seen at once, and terms of a series."""
REAL, IMAG = range(2)


def steps_ahead(rates: Complex, grid: float) -> Table:
    """Give what terms are multiplied with by 1, 2, ... AHEAD steps of ``grid`` [s], shape (n, 2, AHEAD)."""
    return _rows(np.exp(rates[:, None] * grid * np.arange(1, STEPS_AHEAD + 1)))


def series_rows(rates: Complex) -> Table:
    """Give the Taylor coefficients of exp(rate t), shape (n, 2, AHEAD)."""
    factorials = [float(math.factorial(k)) for k in range(STEPS_AHEAD)]
    return _rows(rates[:, None] ** np.arange(STEPS_AHEAD) / factorials)


def _rows(numbers: Complex) -> Table:
    return np.ascontiguousarray(np.stack([numbers.real, numbers.imag], axis=1))


@inlined
def sum_of(terms: Complex, rows: Table) -> SimdVector:
    """Give Re sum terms_j rows_j."""
    value: SimdVector = terms[0].real * sixteen(rows[0], REAL) - terms[0].imag * sixteen(rows[0], IMAG)
    for j in range(1, len(terms)):
        value += terms[j].real * sixteen(rows[j], REAL) - terms[j].imag * sixteen(rows[j], IMAG)
    return value


@inlined
def sum_now(terms: Complex) -> float:
    """Re sum terms_j."""
    value = 0.0
    for j in range(len(terms)):
        value += terms[j].real
    return value


@inlined
def fill_series(series: Vector, terms: Complex, rows: Table) -> None:
    """Write the Taylor coefficients of Re sum terms_j exp(rates_j t), shape (AHEAD,); see `series_rows`."""
    store(series, 0, sum_of(terms, rows))


@inlined
def propagate_by(terms: Complex, ahead: Table, steps: int) -> None:
    """Turn terms in place by at most AHEAD steps."""
    for j in range(len(terms)):
        terms[j] *= complex(ahead[j, REAL, steps - 1], ahead[j, IMAG, steps - 1])


@inlined
def march(terms: Complex, ahead: Table, steps: int, low: float, high: float) -> int:
    """Turn terms in place, step by step, while low < Re sum < high; gives the steps that were."""
    made = 0
    while made < steps:
        inside = min(first_outside(sum_of(terms, ahead), low, high), steps - made)
        if inside > 0:
            propagate_by(terms, ahead, inside)
        made += inside
        if inside < STEPS_AHEAD:
            break
    return made
