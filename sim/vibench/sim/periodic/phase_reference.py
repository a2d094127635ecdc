"""Which motion has the phase of a resonance: plans name it, and load no simulation for it."""

from enum import StrEnum
from typing import Literal


class PhaseReference(StrEnum):
    """Which motion of m0 has the phase of a resonance."""

    RELATIVE = "relative"
    """Against the base: of the lowest mode, and wherever contacts leave little of the motion."""
    ABSOLUTE = "absolute"
    """In space: of a mode far above others, where m0 hardly follows the base."""

    def motion(self, transmissibility: complex) -> complex:
        """Give the motion whose phase counts, over that of the base, from m0's displacement over it."""
        return transmissibility - 1.0 if self is PhaseReference.RELATIVE else transmissibility


PhaseReferenceWord = Literal["relative", "absolute"]
