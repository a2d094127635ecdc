"""What a run under a drive of cubics fills on its way, and how it ends. None of it changes a step."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernels import Table, Vector
from ..model import Outcome

REACHED_END = int(Outcome.REACHED_END)
TOO_MANY_IMPACTS = int(Outcome.TOO_MANY_IMPACTS)
LOST = int(Outcome.NOT_FINITE)
STUCK = int(Outcome.STALLED)
TOO_LONG = int(Outcome.TOO_LONG)

NEXT_SAMPLE, IMPACTS = range(2)
"""Places of `Record.counts`."""


class Record(NamedTuple):
    """What a run fills on its way."""

    start: float
    """Time of sample 0 [s]."""
    sample_rate: float
    samples: Table
    """Shape (n, 6); n = 0 keeps none."""
    impact_times: Vector
    """Shape (most impacts,) [s]; a run ends when it is full."""
    counts: NDArray[np.int64]
    """Samples and impacts so far, shape (2,)."""
