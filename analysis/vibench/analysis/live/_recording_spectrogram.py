"""Which frequencies a stretch of a recording holds when: a picture in decibels, of bounded size."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vibench.acquisition import open_recording

from ..signals.arrays import Reals
from ..spectra.spectrogram import Spectrogram, SpectrogramSums

_PIECE_SAMPLES = 2**18
_LEAST_SEGMENT_S, _MOST_SEGMENT_S = 5e-3, 0.25
_HANN_WIDTH = 1.44
"""Of a line under a Hann window, at half power, times the length of the window."""
_SEGMENTS_IN_SIGHT = 250
"""A segment is so much shorter than what is in sight, within the limits above."""
_LOG_ROWS = 300
_LEAST_HZ = 1.0
_FLOOR_DB = -400.0
"""What silence is drawn as: zero has no logarithm."""


class RowSpacing(StrEnum):
    """How frequencies are laid out."""

    LINEAR = "linear"
    LOGARITHMIC = "logarithmic"


@dataclass(frozen=True)
class SpectrogramRequest:
    """What is to be pictured: samples ``start`` to ``stop`` (exclusive) of a channel."""

    path: Path
    role: str
    start: int
    stop: int
    highest_hz: float
    spacing: RowSpacing
    resolution_hz: float | None = None
    """Wished width of a line [Hz]; chosen by the stretch if absent, which shows events best."""


@dataclass(frozen=True, eq=False)
class DensityPicture:
    """Spectral density over time and frequency; rows and columns are evenly spaced."""

    request: SpectrogramRequest
    unit: str
    """Of the channel; densities are in decibels over 1 unit²/Hz."""
    time_s: tuple[float, float]
    """Left and right edge, since the recording's first sample."""
    frequency_hz: tuple[float, float]
    """Lower and upper edge."""
    decibel: NDArray[np.float32]
    """Shape (rows, columns); NaN where samples were lost."""
    segment_s: float
    """Length of one Hann-windowed Fourier transform."""
    resolution_hz: float


def recording_spectrogram(request: SpectrogramRequest) -> DensityPicture:
    """Picture a stretch; every sample of it is in the picture.

    Raises
    ------
    RecordingError, InvalidRequest, NotEnoughData
        When the file, the channel or the stretch cannot be pictured.

    """
    with open_recording(request.path) as recording:
        rate_hz = recording.sample_rate_hz
        stop = min(request.stop, recording.samples)
        samples = max(0, stop - request.start)
        seen_s = samples / rate_hz
        segment_s = float(np.clip(seen_s / _SEGMENTS_IN_SIGHT, _LEAST_SEGMENT_S, _MOST_SEGMENT_S))
        if request.resolution_hz is not None:
            segment_s = min(_HANN_WIDTH / request.resolution_hz, 0.5 * seen_s)
        highest_hz = min(request.highest_hz, 0.5 * rate_hz)
        sums = SpectrogramSums(rate_hz, samples, highest_hz=highest_hz, segment_s=segment_s)
        for first in range(request.start, stop, _PIECE_SAMPLES):
            sums.add(recording.read(request.role, first, min(first + _PIECE_SAMPLES, stop)))
        unit = recording.channel(request.role).unit
    found = sums.spectrogram()
    half_s = 0.5 * (found.time_s[1] - found.time_s[0]) if found.time_s.size > 1 else 0.5 * segment_s
    begun_s = request.start / rate_hz
    edges_s = (begun_s + float(found.time_s[0]) - half_s, begun_s + float(found.time_s[-1]) + half_s)
    edges_hz, density = _rows(found, request.spacing)
    decibel = 10.0 * np.log10(np.maximum(density, 10.0 ** (_FLOOR_DB / 10.0)))
    return DensityPicture(
        request=request,
        unit=unit,
        time_s=edges_s,
        frequency_hz=edges_hz,
        decibel=decibel.astype(np.float32),
        segment_s=segment_s,
        resolution_hz=found.resolution_hz,
    )


def _rows(found: Spectrogram, spacing: RowSpacing) -> tuple[tuple[float, float], Reals]:
    """Lay the lines out; where one row holds several lines it shows the strongest of them."""
    lines_hz, density = found.frequency_hz, found.density
    step_hz = float(lines_hz[1])
    if spacing is RowSpacing.LINEAR:
        return (-0.5 * step_hz, float(lines_hz[-1]) + 0.5 * step_hz), density
    edges_hz = np.geomspace(max(_LEAST_HZ, 0.5 * step_hz), float(lines_hz[-1]), _LOG_ROWS + 1)
    first = np.clip(np.rint(edges_hz[:-1] / step_hz).astype(int), 0, lines_hz.size - 1)
    last = np.clip(np.rint(edges_hz[1:] / step_hz).astype(int), first + 1, None)
    rows = [np.max(density[low:high], axis=0) for low, high in zip(first, last, strict=True)]
    return (float(edges_hz[0]), float(edges_hz[-1])), np.stack(rows)
