"""The level of the drive as it was recorded, for branches that are laid over the recording."""

import numpy as np

from ..errors import NotEnoughData
from ..signals.arrays import Reals

MOST_BINS = 100


def recorded_level(frequency_hz: Reals, drive_amplitude_m: Reals) -> tuple[tuple[float, float], ...]:
    """Give pairs of frequency [Hz] and amplitude [m] of a sweep or of steps, ascending, 100 at most.

    Parameters
    ----------
    frequency_hz, drive_amplitude_m
        As measured, in any order, up and down together; shape (n,). In each bin stands the median, so that
        one bad interval does not bend the level.

    Raises
    ------
    NotEnoughData
        When the drive had fewer than two frequencies.

    """
    known = np.isfinite(frequency_hz) & np.isfinite(drive_amplitude_m) & (drive_amplitude_m > 0.0)
    place, level = frequency_hz[known], drive_amplitude_m[known]
    if place.size < 2 or np.ptp(place) < 1e-3 * float(place.max()):
        raise NotEnoughData(
            "this recording holds no drive over a range of frequencies; take a stepped sine or a sweep"
        )
    bins = min(MOST_BINS, place.size)
    edges = np.linspace(place.min(), place.max(), bins + 1)
    owner = np.clip(np.searchsorted(edges, place, side="right") - 1, 0, bins - 1)
    pairs = [
        (float(np.median(place[owner == k])), float(np.median(level[owner == k])))
        for k in range(bins)
        if bool(np.any(owner == k))
    ]
    return tuple(pairs)
