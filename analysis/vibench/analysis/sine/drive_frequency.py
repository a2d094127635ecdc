"""Whether the recorded drive was at the frequencies of its plan."""

import numpy as np

from ..recordings.checks import Check, Verdict
from ..signals.arrays import Reals

_SAME = 1e-3
"""Of a frequency; two clocks differ by a tenth of it."""


def frequency_check(found_hz: Reals, planned_hz: Reals) -> Check:
    """Compare each frequency, as measured on the drive, with the nearest of the plan [Hz]."""
    nearest = planned_hz[np.argmin(np.abs(found_hz[:, np.newaxis] - planned_hz), axis=1)]
    off = np.abs(found_hz / nearest - 1)
    worst = int(np.argmax(off))
    if off[worst] <= _SAME:
        return Check("Drive frequency", Verdict.PASSED, "as planned")
    text = (
        f"the drive was at {found_hz[worst]:.6g} Hz, which the plan does not have; nearest is "
        f"{nearest[worst]:.6g} Hz. Results are of what was played"
    )
    return Check("Drive frequency", Verdict.WARNING, text)
