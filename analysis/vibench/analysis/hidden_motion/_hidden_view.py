"""The hidden motion of a short stretch, for a picture: what is asked, and what is drawn of it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vibench.acquisition.recording import open_recording

from ..signals import Reals

LONGEST_VIEW_S = 2.0
"""Of a picture: worked out in about a second."""
_LEAD_S = 0.15
"""Before and behind what is shown, so that a track has begun and its end is smoothed."""


@dataclass(frozen=True)
class HiddenViewRequest:
    """A stretch of a recording."""

    path: Path
    low_s: float
    high_s: float


@dataclass(frozen=True, eq=False)
class HiddenView:
    """What is drawn of it."""

    request: HiddenViewRequest
    time_s: Reals
    p: Reals
    """Tracked, NaN where it was not followed [m]."""
    free_p: Reals
    """Without a contact model [m]."""
    stops_m: tuple[float, float]
    """Places of the lower and the upper stop."""
    sentence: str


def hidden_view(request: HiddenViewRequest) -> HiddenView:
    """Tell the hidden motion of a stretch with the specimen as the recording describes it.

    Raises
    ------
    AnalysisError
        As `hidden_motion` does.

    """
    # The window takes the words above when it begins, and what works them out loads scipy.stats.
    from ._hidden_motion import Numbers, hidden_motion  # noqa: PLC0415

    with open_recording(request.path) as recording:
        end_s = recording.samples / recording.sample_rate_hz
        motion = hidden_motion(
            recording,
            start_s=max(0.0, request.low_s - _LEAD_S),
            stop_s=min(end_s, request.high_s + _LEAD_S),
            numbers=Numbers.AS_DESCRIBED,
        )
    time_s = motion.time_s
    shown = (time_s >= request.low_s) & (time_s <= request.high_s)
    followed = float(np.mean(~np.isnan(motion.tracked.p[shown]))) if shown.any() else 0.0
    why = next((each.reason for each in motion.tracked.not_followed), "")
    lower, upper = motion.gaps_m
    return HiddenView(
        request,
        time_s[shown],
        motion.tracked.p[shown],
        motion.free.p[shown],
        (-lower, upper),
        f"p tracked in {100 * followed:.3g} % of this stretch, with the specimen as described"
        + (f"; elsewhere {why}" if followed < 1.0 and why else ""),
    )
