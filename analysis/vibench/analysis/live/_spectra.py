"""Live spectra and transmission of the newest seconds of a run."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from vibench.acquisition import open_recording

from ..frequency_response.results import (
    Estimator,
    FrequencyResponse,
    FrequencyResponseSettings,
    converted_frequency_response,
)
from ..frequency_response.transmissibility import frequency_response_of
from ..signals import (
    DEFAULT_CONFIDENCE,
    Flags,
    Quantity,
    Reals,
    Window,
    effective_averages,
    hop_samples,
    taper,
)
from ..spectra import SpectralAverages, Spectrogram, SpectrogramSums
from ..tables import Tabular
from ._ring import Values

_LEAST_SEGMENTS = 2
"""Minimum number of segments; the coherence of a single segment is always 1."""
_OVERLAP = 0.5


@dataclass(frozen=True, eq=False)
class LiveSpectrum(Tabular):
    """Amplitude spectral density of every channel."""

    frequency_hz: Reals
    amplitude_density: Reals
    """Amplitude spectral density, shape (channels, lines) [unit of the channel / sqrt(Hz)]."""
    n_eff: float
    """Number of independent averages."""


class LiveSpectra:
    """Welch average of the newest segments; each segment is Fourier-transformed once.

    Segments with lost samples are skipped. By default, spectral lines are 6.25 Hz apart at 51.2 kS/s.
    """

    def __init__(
        self, channels: int, sample_rate_hz: float, segment_samples: int = 8192, averages: int = 24
    ) -> None:
        self._rate_hz = sample_rate_hz
        self._size = segment_samples
        self._hop = hop_samples(segment_samples, _OVERLAP)
        self._taper = taper(Window.HANN, segment_samples)
        self._short_taper = self._taper.astype(np.float32)
        shape = averages, channels, segment_samples // 2 + 1
        self._spectra: NDArray[np.complex64] = np.zeros(shape, dtype=np.complex64)
        self._is_used: Flags = np.zeros(averages, dtype=np.bool_)
        self._carry = np.empty((channels, 0), dtype=np.float32)
        self.segments = 0
        """Number of completed segments; when this number changes, earlier results are out of date."""

    def add(self, values: Values) -> None:
        """Add the next samples, shape (channels, samples)."""
        data = np.concatenate((self._carry, values), axis=1)
        whole = max(0, (data.shape[1] - self._size) // self._hop + 1)
        # If many segments have arrived since the last call, transform only the newest segments.
        for number in range(max(0, whole - self._is_used.size), whole):
            self._take(data[:, number * self._hop : number * self._hop + self._size])
        self._carry = data[:, whole * self._hop :].copy()

    def leave_out(self, newest_s: float) -> None:
        """Exclude the segments of the newest ``newest_s`` seconds."""
        count = min(self.segments, self._is_used.size, int(np.ceil(newest_s * self._rate_hz / self._hop)))
        self._is_used[(self.segments - 1 - np.arange(count)) % self._is_used.size] = False

    def _take(self, segment: Values) -> None:
        place = self.segments % self._is_used.size
        self.segments += 1
        self._is_used[place] = bool(np.isfinite(segment).all())
        if self._is_used[place]:
            self._spectra[place] = fft.rfft(segment * self._short_taper, axis=-1)

    def spectrum(self) -> LiveSpectrum | None:
        """Return the spectral density of every channel; None before the first complete segment."""
        used = self._valid_entries()
        if not used.any():
            return None
        _, channels, lines = self._spectra.shape
        averages = self._averages(used, range(channels), lines)
        density = [averages.density(each, each, self._rate_hz).real for each in range(channels)]
        return LiveSpectrum(averages.frequency_hz(self._rate_hz), np.sqrt(density), averages.n_eff)

    def frequency_response(
        self,
        rows: Sequence[int],
        quantity: Quantity = Quantity.VELOCITY,
        *,
        low_hz: float,
        high_hz: float,
        delay_s: float = 0.0,
    ) -> FrequencyResponse | None:
        """Return transmissibility, coherence and bounds; None with fewer than two valid segments.

        Parameters
        ----------
        rows
            Row numbers of base acceleration and response, and optionally of the drive voltage, which gives an
            estimate without bias due to noise.
        quantity
            Quantity of the response channel.
        low_hz, high_hz
            Ends of the frequency band.
        delay_s
            Lag of the response channel behind the base channel [s].
        """
        used = self._valid_entries()
        if int(np.count_nonzero(used)) < _LEAST_SEGMENTS:
            return None
        estimator = Estimator.DRIVE if len(rows) == 3 else Estimator.H1
        settings = FrequencyResponseSettings(
            estimator=estimator,
            sample_rate_hz=self._rate_hz,
            segment_samples=self._size,
            window=Window.HANN.value,
            overlap=_OVERLAP,
            confidence=DEFAULT_CONFIDENCE,
        )
        highest = int(high_hz * self._size / self._rate_hz) + 2
        found = frequency_response_of(self._averages(used, rows, highest), settings).between(low_hz, high_hz)
        return converted_frequency_response(
            found.without_delay(delay_s),
            drive=(Quantity.ACCELERATION, Quantity.DISPLACEMENT),
            response=(quantity, Quantity.DISPLACEMENT),
        )

    def _averages(self, used: Flags, rows: Sequence[int], lines: int) -> SpectralAverages:
        chosen = self._spectra[:, :, :lines][used][:, list(rows)]
        products = np.einsum("kif,kjf->ijf", np.conj(chosen), chosen) / chosen.shape[0]
        return SpectralAverages(
            products=products.astype(np.complex128),
            segments_used=chosen.shape[0],
            segments_excluded=min(self.segments, used.size) - chosen.shape[0],
            n_eff=effective_averages(self._taper, self._hop, used),
            segment_samples=self._size,
            window=Window.HANN,
            overlap=_OVERLAP,
            window_sum=float(np.sum(self._taper)),
            window_energy=float(self._taper @ self._taper),
        )

    def _valid_entries(self) -> Flags:
        """Return, for each stored segment, whether the segment is valid."""
        known = np.arange(self._is_used.size) < self.segments
        return np.asarray(self._is_used & known)


_PIECE_SAMPLES = 2**18
_LEAST_SEGMENT_S, _MOST_SEGMENT_S = 5e-3, 0.25
_HANN_WIDTH = 1.44
"""Product of a spectral line's half-power width and the window length, for a Hann window."""
_SEGMENTS_IN_SIGHT = 250
"""Ratio of the shown time span to the default segment length, if that length is within its limits."""
_LOG_ROWS = 300
_LEAST_HZ = 1.0
_FLOOR_DB = -400.0
"""Smallest density drawn [dB], because zero has no logarithm."""


class RowSpacing(StrEnum):
    """Spacing of the frequency rows."""

    LINEAR = "linear"
    LOGARITHMIC = "logarithmic"


@dataclass(frozen=True)
class SpectrogramRequest:
    """Samples ``start`` to ``stop`` (exclusive) of a channel, and the frequency rows of the picture."""

    path: Path
    role: str
    start: int
    stop: int
    highest_hz: float
    spacing: RowSpacing
    resolution_hz: float | None = None
    """Resolution [Hz]; by default chosen from the number of samples so that events are visible."""


@dataclass(frozen=True, eq=False)
class DensityPicture:
    """Spectral density over time and frequency, with evenly spaced rows and columns."""

    request: SpectrogramRequest
    unit: str
    """Unit of the channel; densities are in decibels relative to 1 unit²/Hz."""
    time_s: tuple[float, float]
    """Left and right edge [s since the first sample of the recording]."""
    frequency_hz: tuple[float, float]
    """Lower and upper edge of the picture [Hz]."""
    decibel: NDArray[np.float32]
    """Density in decibels, shape (rows, columns); NaN where samples were lost."""
    segment_s: float
    """Length of one Hann-windowed segment [s]."""
    resolution_hz: float


def recording_spectrogram(request: SpectrogramRequest) -> DensityPicture:
    """Return the spectrogram of part of a recording; every sample of this part contributes.

    Raises RecordingError, InvalidRequest or NotEnoughData for an unusable file, channel or stretch.
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
    """Return the ends of the frequency axis, and the rows; each row has the density of its strongest line."""
    lines_hz, density = found.frequency_hz, found.density
    step_hz = float(lines_hz[1])
    if spacing is RowSpacing.LINEAR:
        return (-0.5 * step_hz, float(lines_hz[-1]) + 0.5 * step_hz), density
    edges_hz = np.geomspace(max(_LEAST_HZ, 0.5 * step_hz), float(lines_hz[-1]), _LOG_ROWS + 1)
    first = np.clip(np.rint(edges_hz[:-1] / step_hz).astype(int), 0, lines_hz.size - 1)
    last = np.clip(np.rint(edges_hz[1:] / step_hz).astype(int), first + 1, None)
    rows = [np.max(density[low:high], axis=0) for low, high in zip(first, last, strict=True)]
    return (float(edges_hz[0]), float(edges_hz[-1])), np.stack(rows)
