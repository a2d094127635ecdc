"""A whole recording in a hundred columns: what a list of recordings shows beside a name."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vibench.acquisition import RecordingError, open_recording
from vibench.acquisition.recording import Recording

from ..recordings import RESPONSE
from ._overview import has_overview, overview_of

THUMBNAIL_COLUMNS = 120
READ_WHOLE_SAMPLES = 50_000_000
"""Values that are read for the thumbnail of a file without an overview: about a second."""


@dataclass(frozen=True, eq=False)
class Thumbnail:
    """The response of a whole recording, in few columns; each between -1 and 1."""

    low: NDArray[np.float32]
    high: NDArray[np.float32]


def thumbnail(path: Path) -> Thumbnail | None:
    """Draw a recording small; None where there is nothing to draw, or it would take too long."""
    try:
        with open_recording(path) as recording:
            if recording.samples == 0 or not _is_quickly_seen(recording):
                return None
            role = RESPONSE if RESPONSE in recording.roles else recording.roles[-1]
            picture = overview_of(recording).picture((role,), 0, recording.samples, THUMBNAIL_COLUMNS)
    except RecordingError:
        return None
    known = np.isfinite(picture.low[0]) & np.isfinite(picture.high[0])
    if not known.any():
        return None
    low, high = (np.asarray(each[0], dtype=np.float32) for each in (picture.low, picture.high))
    largest = max(float(np.max(np.abs(low[known]))), float(np.max(np.abs(high[known]))))
    return Thumbnail(low / largest, high / largest) if largest > 0 else None


def _is_quickly_seen(recording: Recording) -> bool:
    return has_overview(recording) or recording.samples * len(recording.roles) <= READ_WHOLE_SAMPLES
