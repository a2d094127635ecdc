"""What a run fills on its way, and how it ends. None of it changes a single step. SI units."""

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

NEXT_SAMPLE, IMPACTS, STEPS_LEFT = range(3)
"""Places of `Record.counts`."""
MOST_STEPS = 2_000_000_000
"""Steps of flight in a run: seconds of work, and two days of the paper's specimen. One whose fastest mode is
a million times faster than its drive would be followed for weeks."""
RESOLVED_STEP = 50
"""Steps of flight that a step through a force counts as: it takes as long."""


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
    """Samples and impacts so far, and steps that may still be made, shape (3,)."""
    observations: Vector
    tangent: Table | None
    """Small changes of the state that are carried along, as `vibench.sim.slots` says, shape (m,
    TANGENT_SIZE). m = 0 carries none; None carries none either, and tells a kernel so by its type."""
