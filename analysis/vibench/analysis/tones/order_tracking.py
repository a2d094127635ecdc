"""Amplitude and phase of a signal at multiples of the drive frequency, interval by interval."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import lcm
from typing import ClassVar

import numpy as np

from ..errors import InvalidRequest, UnusableData
from ..signals.arrays import Complexes, Reals
from ..tables import Tabular

ORDERS = (0.5, 1.0, 1.5, 2.0, 3.0)
"""Default orders; impacting systems respond at half orders too."""
ALL_ORDERS = (1 / 3, 0.5, 2 / 3, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0)
"""Orders with thirds and high harmonics, which need intervals of twelve drive cycles."""
_LARGEST_DENOMINATOR = 12
_BATCH_INTERVALS = 256
"""Number of intervals that are fitted at once, about 10 MB."""


def order_label(order: float) -> str:
    """Return the name of an order, such as ``"order 1/3"`` or ``"order 2"``."""
    return f"order {Fraction(order).limit_denominator(_LARGEST_DENOMINATOR)}"


def cycles_needed(orders: tuple[float, ...]) -> float:
    """Return the number of drive cycles per interval that is needed to separate these orders."""
    return 2 / float(min(np.diff((0.0, *sorted(orders)))))


@dataclass(frozen=True)
class TrackedOrders(Tabular):
    """Components of a signal at orders of the drive; signal = Re(sum value_k exp(i k phase)) + residual."""

    OWN_UNITS: ClassVar = {"value": "{unit}", "sd": "{unit}", "residual_rms": "{unit}", "amplitude": "{unit}"}

    orders: tuple[float, ...]
    value: Complexes
    """Complex amplitude (peak) at the middle of each interval, shape (orders, intervals)."""
    sd: Reals
    """Standard deviation of the magnitude for a white residual; shape (orders, intervals)."""
    residual_rms: Reals
    """RMS of the residual, shape (intervals,)."""

    @property
    def amplitude(self) -> Reals:
        """Amplitude of each order, |value|, shape (orders, intervals)."""
        return np.abs(self.value)

    def order(self, number: float) -> Complexes:
        """Return the complex amplitudes of one order, shape (intervals,)."""
        if number not in self.orders:
            raise InvalidRequest(f"order {number:g} was not tracked; tracked orders: {self.orders}")
        chosen: Complexes = self.value[self.orders.index(number)]
        return chosen

    @property
    def impacts(self) -> Reals:
        """Magnitude of orders 2 and 3 together, relative to order 1, shape (intervals,)."""
        return np.asarray(np.hypot(*np.abs([self.order(2.0), self.order(3.0)])) / np.abs(self.order(1.0)))


def track_orders(
    samples: Reals, phase_rad: Reals, *, interval_samples: int, orders: tuple[float, ...] = ORDERS
) -> TrackedOrders:
    """Track one signal; see `track_signals`."""
    (tracked,) = track_signals((samples,), phase_rad, interval_samples=interval_samples, orders=orders)
    return tracked


def track_signals(
    signals: Sequence[Reals],
    phase_rad: Reals,
    *,
    interval_samples: int,
    orders: tuple[float, ...] = ORDERS,
) -> tuple[TrackedOrders, ...]:
    """Fit all orders at once to each interval of signals, by least squares.

    With separate fits, orders would bias one another if an interval is not a whole number of *subharmonic*
    periods. A straight line and a linear change of order 1 are fitted too, so that sensor drift or a sweep
    through a resonance leaves no residual.

    Parameters
    ----------
    signals, phase_rad
        The signals and the drive phase at the same instants, each of shape (samples,); a remainder
        after the last whole interval is not used.
    interval_samples
        Samples per interval; at least two periods of the smallest distance between orders.
    """
    count = phase_rad.size // interval_samples
    if count == 0:
        raise InvalidRequest(
            f"the signal has {phase_rad.size} samples, less than one interval of {interval_samples}"
        )
    turns = abs(float(phase_rad[count * interval_samples - 1] - phase_rad[0])) / (2 * np.pi) / count
    needed = cycles_needed(orders)
    if turns < needed:
        raise InvalidRequest(
            f"an interval of {interval_samples} samples contains {turns:.1f} drive cycles; orders "
            f"{2 / needed:g} apart need at least {needed:g}: use longer intervals or fewer orders"
        )
    used = count * interval_samples
    cut = [each[:used].reshape(count, interval_samples) for each in signals]
    phase = phase_rad[:used].reshape(count, interval_samples)
    parts = []
    for first in range(0, count, _BATCH_INTERVALS):
        batch = slice(first, first + _BATCH_INTERVALS)
        parts.append(_fit(np.stack([each[batch] for each in cut], axis=2), phase[batch], orders))
    value, sd, residual = (np.concatenate(part, axis=-1) for part in zip(*parts, strict=True))
    return tuple(TrackedOrders(orders, *each) for each in zip(value, sd, residual, strict=True))


def order_turns(phase_rad: Reals, orders: tuple[float, ...]) -> list[Complexes]:
    """Return exp(i order phase) for each order.

    Rational orders are computed as powers of one phasor, because products take a tenth of the time of sines.
    """
    fractions = [Fraction(order).limit_denominator(_LARGEST_DENOMINATOR) for order in orders]
    if min(orders) <= 0 or not np.allclose([float(each) for each in fractions], orders, rtol=1e-15, atol=0.0):
        return [np.exp(1j * order * phase_rad) for order in orders]
    together = lcm(*(each.denominator for each in fractions))
    powers = {1: np.exp(1j / together * phase_rad)}
    return [_power(int(each * together), powers) for each in fractions]


def _power(exponent: int, powers: dict[int, Complexes]) -> Complexes:
    """Return a power of ``powers[1]`` by repeated halving, with a cache."""
    if exponent not in powers:
        half = exponent // 2
        powers[exponent] = _power(half, powers) * _power(exponent - half, powers)
    return powers[exponent]


def _fit(signals: Reals, phase: Reals, orders: tuple[float, ...]) -> tuple[Complexes, Reals, Reals]:
    """Fit signals of shape (intervals, samples, signals); results have shape (signals, ..., intervals)."""
    samples, count = signals.shape[1], len(orders)
    *turned, first = order_turns(phase, (*orders, 1.0))
    rising = np.linspace(-1.0, 1.0, samples)
    changing = rising * first
    basis = np.empty((len(phase), 2 * count + 4, samples))
    for place, turn in enumerate(turned):
        basis[:, place], basis[:, count + place] = turn.real, turn.imag
    basis[:, -4], basis[:, -3], basis[:, -2], basis[:, -1] = changing.real, changing.imag, rising, 1.0
    normal = basis @ basis.transpose(0, 2, 1)
    try:
        inverse = np.linalg.inv(normal)
    except np.linalg.LinAlgError as singular:
        raise UnusableData(
            "the drive phase is constant in an interval, so orders cannot be separated there; "
            "leave out the parts without drive"
        ) from singular
    solution = inverse @ (basis @ signals)
    residual = signals - basis.transpose(0, 2, 1) @ solution
    squares = np.sum(residual**2, axis=1)
    value = solution[:, :count] - 1j * solution[:, count : 2 * count]
    diagonal = np.einsum("ikk->ik", inverse)
    mean = (diagonal[:, :count] + diagonal[:, count : 2 * count]) / 2
    variance = squares / max(1, samples - basis.shape[1])
    spread = np.sqrt(variance[:, np.newaxis] * mean[:, :, np.newaxis])
    return value.T, spread.T, np.sqrt(squares / samples).T
