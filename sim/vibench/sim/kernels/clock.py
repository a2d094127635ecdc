"""Time as a sum of two numbers, so that neither time nor the drive's phase drifts in a long run. SI units.

A clock is an array (high, low): the time is their exact sum. Sums and products without loss after
Dekker, A floating-point technique for extending the available precision, Numer. Math. 18 (1971).
"""

import math

import numpy as np

from .arrays import Vector
from .compile import kernel, kernel_without_refcount

SPLITTER = 134217729.0
"""2^27 + 1: cuts a double into two halves whose products are exact."""


@kernel
def clock_at(time: float) -> Vector:
    """Start a clock."""
    clock = np.zeros(2)
    clock[0] = time
    return clock


@kernel_without_refcount
def advance_clock(clock: Vector, by: float) -> None:
    """Let time pass; what the sum rounds off is kept in the low part."""
    high = clock[0]
    total = high + by
    added = total - high
    low = clock[1] + ((high - (total - added)) + (by - added))
    clock[0] = total + low
    clock[1] = low - (clock[0] - total)


@kernel_without_refcount
def time_until(clock: Vector, instant: float) -> float:
    """How long it is from now to an instant [s]."""
    left: float = (instant - clock[0]) - clock[1]
    return left


@kernel_without_refcount
def angle_at(clock: Vector, later: float, frequency: float) -> float:
    """Phase of a harmonic at clock time plus ``later``, in (-2 pi, 4 pi): whole turns are dropped exactly."""
    turns = frequency * clock[0]
    a, b = SPLITTER * frequency, SPLITTER * clock[0]
    a_high, b_high = a - (a - frequency), b - (b - clock[0])
    a_low, b_low = frequency - a_high, clock[0] - b_high
    rounded_off = ((a_high * b_high - turns) + a_high * b_low + a_low * b_high) + a_low * b_low
    extra = frequency * later
    part: float = (
        (turns - math.floor(turns)) + (extra - math.floor(extra)) + (rounded_off + frequency * clock[1])
    )
    return 2.0 * math.pi * part
