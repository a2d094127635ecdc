"""Accuracy of a simulation: three named levels, each with one tolerance."""

from enum import StrEnum
from typing import Literal


class Accuracy(StrEnum):
    """Largest error of the state after seconds of periodic impacts; flight is exact at every level.

    In units of 100 um and 0.1 m/s, against an independent solution; measured in docs/accuracy.md.
    """

    QUICK = "quick"
    """Error 1e-5. Chaotic motion gains nothing from a finer level."""
    STANDARD = "standard"
    """Error 1e-6."""
    REFERENCE = "reference"
    """Error 1e-9: the reference for the other two."""

    @property
    def tolerance(self) -> float:
        """Relative error allowed in one step of a contact; smaller than `promise` because errors add up."""
        return _TOLERANCES[self]

    @property
    def promise(self) -> float:
        """Largest error of the state of a periodic motion, in the units above."""
        return _PROMISES[self]


AccuracyWord = Literal["quick", "standard", "reference"]
_TOLERANCES = {Accuracy.QUICK: 3e-6, Accuracy.STANDARD: 3e-7, Accuracy.REFERENCE: 1e-10}
_PROMISES = {Accuracy.QUICK: 1e-5, Accuracy.STANDARD: 1e-6, Accuracy.REFERENCE: 1e-9}
