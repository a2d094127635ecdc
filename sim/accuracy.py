"""How exactly a simulation is asked to run: three named levels, each with one tolerance."""

from enum import StrEnum


class Accuracy(StrEnum):
    """Relative error allowed in one step of a contact; flight is exact at every level."""

    QUICK = "quick"
    """1e-4: in chaos, as good as any other."""
    STANDARD = "standard"
    """1e-6: six digits in a periodic motion."""
    REFERENCE = "reference"
    """1e-10: to judge the other two."""

    @property
    def tolerance(self) -> float:
        """Relative error allowed in one step of a contact."""
        return _TOLERANCES[self]


_TOLERANCES = {Accuracy.QUICK: 1e-4, Accuracy.STANDARD: 1e-6, Accuracy.REFERENCE: 1e-10}
