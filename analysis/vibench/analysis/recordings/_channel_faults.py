"""What makes a channel useless for any analysis: it never moved, or it was cut off throughout."""

from collections.abc import Iterator, Sequence

from ..errors import UnusableData
from ._channel_levels import ChannelLevel
from ._channels import BASE, DRIVE, RESPONSE

_CLIPPED_SHARE = 0.2
"""A sine that just fills its range spends 3 % of its time within a thousandth of it; this is no sine."""


def require_moving_channels(levels: Sequence[ChannelLevel]) -> None:
    """Refuse channels that hold nothing to analyse.

    Raises
    ------
    UnusableData
        One sentence that names every such channel and what to look at.

    """
    faults = [
        each for level in levels if level.header.role in (DRIVE, BASE, RESPONSE) for each in _faults(level)
    ]
    if faults:
        raise UnusableData("; ".join(faults))


def _faults(level: ChannelLevel) -> Iterator[str]:
    role = level.header.role
    if level.span == 0:
        yield (
            f"{role} holds the same value throughout, so its sensor or its cable gave nothing; "
            "check it and measure again"
        )
    elif level.share_at_full_scale > _CLIPPED_SHARE:
        yield (
            f"{role} lay at its full scale of {level.full_scale:.3g} {level.header.unit} for "
            f"{100 * level.share_at_full_scale:.0f} % of the time, so its waveform is cut off throughout; "
            "choose a larger range or a smaller drive and measure again"
        )
