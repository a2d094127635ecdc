"""Analysis of a sweep in memory, block by block as for a recording."""

import numpy as np

from vibench.analysis.sine.sweep import SweepSums

BLOCK = 1 << 19


def sweep_response(
    drive, base, response, rate_hz, *, low_hz, high_hz, interval_s=0.1, delay_s=0.0, linear=None
):
    """Return the sweep response from drive [V], base acceleration [m/s2] and m0 velocity [m/s]."""
    sums = SweepSums(rate_hz, low_hz=low_hz, high_hz=high_hz, interval_s=interval_s)
    for first in range(0, drive.size, BLOCK):
        sums.add(np.stack([row[first : first + BLOCK] for row in (drive, base, response)]))
    return sums.response(delay_s=delay_s, linear=linear)
