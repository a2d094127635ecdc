"""Checks for samples near the ends of an input's range, and for samples that an output must not play."""

import numpy as np

from ..errors import InstrumentError, LimitExceeded
from ..instruments import Overload, Samples

# Vibrometers and converters distort before they clip (hardware reference, section 4).
OVERLOAD_FRACTION = 0.95
# A delta-sigma converter's filter rings about this long after a clip; closer overloads count as one.
_RECOVERY_SAMPLES = 64


def overload_ranges(
    volts: Samples, roles: tuple[str, ...], full_scales_v: tuple[float, ...], first_sample: int
) -> tuple[Overload, ...]:
    """Return the sample ranges of a block in which a channel reaches 95 % of its full scale.

    ``volts`` have the shape (channels, samples) [V]; ``first_sample`` is the number of the block's first
    sample in the run.
    """
    found: list[Overload] = []
    peaks_v = np.max(np.abs(volts), axis=1, initial=0.0)
    for role, row, peak_v, full_scale_v in zip(roles, volts, peaks_v, full_scales_v, strict=True):
        if not peak_v >= OVERLOAD_FRACTION * full_scale_v:  # also skips NaN, which `read_block` refuses
            continue
        past = np.flatnonzero(np.abs(row) >= OVERLOAD_FRACTION * full_scale_v)
        ranges = np.split(past, np.flatnonzero(np.diff(past) > _RECOVERY_SAMPLES) + 1)
        found += [
            Overload(role, first_sample + int(each[0]), first_sample + int(each[-1])) for each in ranges
        ]
    return tuple(found)


def require_playable(volts: Samples, physical: str, limit_v: float, *, is_open: bool) -> None:
    """Raise LimitExceeded for a NaN or a sample beyond the limit, InstrumentError if the output is closed."""
    peak_v = float(np.max(np.abs(volts), initial=0.0))
    if not peak_v <= limit_v:  # this form also refuses a NaN
        raise LimitExceeded(
            f"a peak of {peak_v:g} V was requested from {physical}; at most {limit_v:g} V are allowed. "
            "Nothing was written; lower the amplitude"
        )
    if not is_open:
        raise InstrumentError(f"{physical} is closed; open the bench again")
