"""Hidden motion of a short part of a recording, for a plot."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from vibench.acquisition.recording import open_recording
from vibench.sim import UnknownSpecimenError, load_specimen

from ..errors import InvalidRequest
from ..signals import Reals, Samples
from ..tables import Tabular
from ._tracking_model import Numbers

LONGEST_VIEW_S = 2.0
"""Longest part of a recording that is shown [s]; its motion is computed in about one second."""
_NUMBERS_SHOWN = 3
"""Number of shown parameters: both gaps and m1."""
_LEAD_S = 0.15
"""Additional motion before and after the shown part [s], to start the track and to smooth its end."""


@dataclass(frozen=True)
class HiddenViewRequest:
    """Part of a recording to show, and the specimen parameters to use."""

    path: Path
    low_s: float
    high_s: float
    specimen: str = ""
    """Name of a shipped specimen or path of a file; by default the recording's description."""
    numbers: Numbers = Numbers.AS_DESCRIBED


@dataclass(frozen=True, eq=False)
class HiddenView(Tabular):
    """Hidden motion to plot, and the parameters used."""

    OWN_UNITS: ClassVar = {"p": "m", "free_p": "m"}

    request: HiddenViewRequest
    time_s: Reals
    p: Samples
    """Relative displacement from tracking, NaN without a track [m]."""
    free_p: Samples
    """Relative displacement without a contact model [m]."""
    stops_m: tuple[float, float]
    """Positions of the lower and the upper stop on the axis of p."""
    sentence: str


def hidden_view(request: HiddenViewRequest) -> HiddenView:
    """Return the hidden motion of the requested part of a recording.

    Raises AnalysisError as `hidden_motion` does.
    """
    # Import late: the window needs this module when it starts, and this import loads scipy.stats.
    from ._hidden_motion import hidden_motion, parameter_rows  # noqa: PLC0415

    try:
        specimen = load_specimen(request.specimen).specimen() if request.specimen else None
    except UnknownSpecimenError as error:
        raise InvalidRequest(str(error)) from error
    with open_recording(request.path) as recording:
        end_s = recording.samples / recording.sample_rate_hz
        motion = hidden_motion(
            recording,
            specimen,
            start_s=max(0.0, request.low_s - _LEAD_S),
            stop_s=min(end_s, request.high_s + _LEAD_S),
            numbers=request.numbers,
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
        f"p tracked in {100 * followed:.3g} % of this part, with parameters of the specimen {request.numbers}"
        + "".join(f"; {name} {value}" for name, value, _ in parameter_rows(motion)[:_NUMBERS_SHOWN])
        + (f"; elsewhere {why}" if followed < 1.0 and why else ""),
    )
