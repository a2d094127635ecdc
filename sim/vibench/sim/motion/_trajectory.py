"""A solution in time, with how it ended. SI units."""

from dataclasses import dataclass

from ..kernels import Floats
from ..model import Accuracy, Outcome


@dataclass(frozen=True, eq=False)
class Impacts:
    """When m1 touched a stop."""

    times_s: Floats
    """Ascending, shape (count,) [s]."""

    @property
    def count(self) -> int:
        """How many contacts began."""
        return len(self.times_s)


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Where the specimen went, when it struck, and how the run ended."""

    time_s: Floats
    """Shape (n,); empty when no sample rate was asked for."""
    states: Floats
    """Shape (n, 6): x, y, z, vx, vy, vz [m, m/s], absolute."""
    final_state: Floats
    """Shape (6,), at ``end_time_s``."""
    end_time_s: float
    impacts: Impacts
    outcome: Outcome
    """Look here first: only REACHED_END reached the time that was asked for."""
    accuracy: Accuracy
