"""How exactly a simulation is asked to run: three named levels, each with one tolerance."""

from enum import StrEnum
from typing import Literal


class Accuracy(StrEnum):
    """How far the state may be off after seconds of periodic impacts; flight is exact at every level.

    In units of 100 um and 0.1 m/s, against an independent solution; measured in docs/accuracy.md.
    """

    QUICK = "quick"
    """1e-5: in chaos, as good as any other."""
    STANDARD = "standard"
    """1e-6."""
    REFERENCE = "reference"
    """1e-9: to judge the other two."""

    @property
    def tolerance(self) -> float:
        """Relative error allowed in one step of a contact: less than the promise, for errors add up."""
        return _TOLERANCES[self]

    @property
    def promise(self) -> float:
        """Largest error of the state of a periodic motion, in the units above."""
        return _PROMISES[self]


AccuracyWord = Literal["quick", "standard", "reference"]
_TOLERANCES = {Accuracy.QUICK: 3e-6, Accuracy.STANDARD: 3e-7, Accuracy.REFERENCE: 1e-10}
_PROMISES = {Accuracy.QUICK: 1e-5, Accuracy.STANDARD: 1e-6, Accuracy.REFERENCE: 1e-9}
