"""Finding a jump between two branches by bisection, never measuring a frequency from the wrong side."""

from collections.abc import Generator
from dataclasses import dataclass
from math import inf, log

from ..recording import JumpSide


@dataclass(frozen=True)
class SettledPoint:
    """A frequency at which the motion was let settle, and the Response II that was found."""

    frequency_hz: float
    response: float
    period: int = 1
    """Of the motion, in drive periods; 0 when it has none."""


@dataclass(frozen=True)
class LocatedJump:
    """A jump between two settled frequencies of one pass."""

    before: SettledPoint
    after: SettledPoint

    @property
    def frequency_hz(self) -> float:
        """Middle of the bracket [Hz]."""
        return 0.5 * (self.before.frequency_hz + self.after.frequency_hz)

    def is_jump(self, factor: float) -> bool:
        """Whether the response still changes by more than ``factor`` across the bracket."""
        return ratio(self.before, self.after) > factor


Seek = Generator[float, SettledPoint, LocatedJump]
"""Asks for a frequency to be reached on the branch before the jump, and is told what was found there."""


def located(before: SettledPoint, after: SettledPoint, resolution_hz: float) -> Seek:
    """Halve the bracket until it is no wider than ``resolution_hz``.

    `side` says where a middle belongs. Whoever answers must reach each frequency from ``before``'s side.
    """
    while abs(after.frequency_hz - before.frequency_hz) > resolution_hz * (1 + 1e-9):
        middle = yield 0.5 * (before.frequency_hz + after.frequency_hz)
        match side(middle, before, after):
            case JumpSide.BEFORE:
                before = middle
            case JumpSide.AFTER:
                after = middle
    return LocatedJump(before, after)


def side(point: SettledPoint, before: SettledPoint, after: SettledPoint) -> JumpSide:
    """Say on which side of a jump a response lies that was found between them.

    Before it is what is nearer to the response before, and no further from that than the one after: a
    third branch has been jumped to, just as the second.
    """
    away = ratio(point, before)
    return JumpSide.BEFORE if away <= min(ratio(point, after), ratio(before, after)) else JumpSide.AFTER


def ratio(one: SettledPoint, other: SettledPoint) -> float:
    """Larger over smaller response; 1 when they are equal, and infinite when one of them is none."""
    if min(one.response, other.response) <= 0.0:
        return 1.0 if one.response == other.response else inf
    return float(2.0 ** abs(log(one.response / other.response, 2)))


def is_on_branch(point: SettledPoint, expected: SettledPoint, factor: float) -> bool:
    """Whether a motion is the one that was found before at the same frequency.

    It has the same period, or as little of one. The branches differ by ``factor`` at least; half of
    that, in decibels, tells them apart. Two looks at one chaotic motion differ more than two at a
    periodic one: the whole factor is granted to them.
    """
    if point.period != expected.period:
        return False
    return bool(ratio(point, expected) < (factor if point.period == 0 else factor**0.5))
