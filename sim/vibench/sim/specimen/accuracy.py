"""Accuracy of a simulation: three named levels, each with a tolerance."""

from enum import StrEnum
from typing import Literal


class Accuracy(StrEnum):
    """Accuracy level: largest allowed error of the state after some seconds of periodic impacts.

    Errors are in units of 100 um and 0.1 m/s, measured against an independent solution (docs/accuracy.md).
    """

    QUICK = "quick"
    """Error 1e-5: enough for chaotic motion, whose results a stricter level does not improve."""
    STANDARD = "standard"
    """Error 1e-6: between the two other levels."""
    REFERENCE = "reference"
    """Error 1e-9: reference with which the two other levels are checked."""

    @property
    def tolerance(self) -> float:
        """Relative tolerance of one time step in contact; smaller than `promise` because errors add up."""
        return _TOLERANCES[self]

    @property
    def promise(self) -> float:
        """Largest error of the state of a periodic motion, in the units of the class docstring."""
        return _PROMISES[self]


AccuracyWord = Literal["quick", "standard", "reference"]
_TOLERANCES = {Accuracy.QUICK: 3e-6, Accuracy.STANDARD: 3e-7, Accuracy.REFERENCE: 1e-10}
_PROMISES = {Accuracy.QUICK: 1e-5, Accuracy.STANDARD: 1e-6, Accuracy.REFERENCE: 1e-9}
