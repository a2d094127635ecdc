"""Spectra of long signals: densities with confidence bounds, amplitude spectra, spectrograms.

Records arrive block by block, and memory does not grow with them. Segments that touch lost samples are left
out and counted. An amplitude spectrum shows the amplitude of a sine.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy import fft

from .errors import InvalidRequest, NotEnoughData, UnusableData
from .signals import (
    DEFAULT_CONFIDENCE,
    Complexes,
    Flags,
    Quantity,
    Reals,
    Window,
    by_name,
    chi_square_bounds,
    derivative_factor,
    effective_averages,
    hop_samples,
    taper,
)
from .tables import Tabular

_BATCH_SAMPLES = 1 << 19
"""Number of samples of all channels that are transformed at once: 4 MB, so that a batch fits the cache."""
_PIECE_SAMPLES = 1 << 19
"""Samples per channel of each block of `pieces`."""


@dataclass(frozen=True)
class SpectralAverages:
    """Averaged products of the channels' segment spectra, with the number of independent averages."""

    products: Complexes
    """Mean of conj(X_i) X_j over the used segments, shape (channels, channels, lines); not scaled."""
    segments_used: int
    segments_excluded: int
    """Number of segments left out because they contain invalid samples."""
    n_eff: float
    """Number of independent averages, corrected for overlap and gaps."""
    segment_samples: int
    window: Window
    overlap: float
    window_sum: float
    window_energy: float

    def frequency_hz(self, sample_rate_hz: float) -> Reals:
        """Return the frequencies of the spectral lines, from 0 Hz [Hz]."""
        return np.asarray(fft.rfftfreq(self.segment_samples, 1 / sample_rate_hz)[: self.products.shape[-1]])

    def density(self, first: int, second: int, sample_rate_hz: float) -> Complexes:
        """Return the one-sided (cross-)spectral density of two channels [product of their units per Hz]."""
        scale = np.full(self.products.shape[-1], 2 / (sample_rate_hz * self.window_energy))
        scale[0] /= 2
        if self.segment_samples % 2 == 0:
            scale[-1] /= 2
        return np.asarray(self.products[first, second] * scale)


class SegmentSpectra:
    """Sum of the products of segment spectra over blocks of samples.

    The FFT of each segment is computed once and shared by all pairs of channels. The mean is not removed,
    because removing it per segment would disturb the lowest lines. An offset reaches only lines 0 and 1 with
    a Hann window, and only line 0 with a boxcar.
    """

    def __init__(
        self, channels: int, segment_samples: int, *, window: Window | str = Window.HANN, overlap: float = 0.5
    ) -> None:
        if segment_samples < 2:
            raise InvalidRequest(f"a segment of {segment_samples} samples has no spectrum; use at least 2")
        self._window = by_name(Window, window)
        self._overlap = overlap
        self._hop = hop_samples(segment_samples, overlap)
        self._taper = taper(self._window, segment_samples)
        self._sums = np.zeros((channels, channels, segment_samples // 2 + 1), dtype=np.complex128)
        self._carry = np.empty((channels, 0))
        self._carry_valid = np.empty(0, dtype=np.bool_)
        self._used: list[Flags] = []

    def add(self, block: Reals, valid: Flags | None = None) -> None:
        """Add the next samples of all channels.

        Parameters
        ----------
        block
            Shape (channels, samples), contiguous with the previous block.
        valid
            Flags of valid samples, shape (samples,); segments with invalid samples are left out.
        """
        marks = np.ones(block.shape[1], dtype=np.bool_) if valid is None else valid
        data = np.concatenate((self._carry, block), axis=1) if self._carry.shape[1] else block
        marks = np.concatenate((self._carry_valid, marks))
        count = max(0, (data.shape[1] - self._taper.size) // self._hop + 1)
        if count:
            invalid = np.concatenate(([0], np.cumsum(~marks)))
            starts = np.arange(count) * self._hop
            used = invalid[starts + self._taper.size] == invalid[starts]
            self._used.append(used)
            segments = sliding_window_view(data, self._taper.size, axis=1)
            size = max(1, _BATCH_SAMPLES // (data.shape[0] * self._taper.size))
            usable = starts[used]
            for first in range(0, usable.size, size):
                batch = segments[:, usable[first : first + size]] * self._taper
                spectra = np.asarray(fft.rfft(batch, axis=-1, overwrite_x=True))
                # Add conj(X_i) X_j for i <= j; `averages` fills in the other half.
                for i, each in enumerate(spectra):
                    power = np.einsum("kf,kf->f", each.real, each.real)
                    self._sums[i, i] += power + np.einsum("kf,kf->f", each.imag, each.imag)
                    others = spectra[i + 1 :]
                    self._sums[i, i + 1 :] += np.einsum("kf,jkf->jf", np.conj(each), others)
        self._carry = data[:, count * self._hop :].copy()
        self._carry_valid = marks[count * self._hop :]

    def averages(self) -> SpectralAverages:
        """Return the averages over everything added so far.

        Raises NotEnoughData without a usable segment; UnusableData when a sample marked valid is not finite.
        """
        used = np.concatenate(self._used) if self._used else np.empty(0, dtype=np.bool_)
        count = int(np.count_nonzero(used))
        if count == 0:
            raise NotEnoughData(
                f"no whole valid segment of {self._taper.size} samples was found "
                f"({used.size} contain invalid samples); use shorter segments or a longer record"
            )
        products = self._sums / count
        lower = np.tril_indices(products.shape[0], -1)
        products[lower] = np.conj(products[lower[::-1]])
        if not np.all(np.isfinite(products)):
            raise UnusableData("a sample is not a finite number; mark such samples as invalid")
        return SpectralAverages(
            products=products,
            segments_used=count,
            segments_excluded=used.size - count,
            n_eff=effective_averages(self._taper, self._hop, used),
            segment_samples=self._taper.size,
            window=self._window,
            overlap=self._overlap,
            window_sum=float(np.sum(self._taper)),
            window_energy=float(self._taper @ self._taper),
        )


def pieces(signals: tuple[Reals, ...], valid: Flags | None) -> Iterator[tuple[Reals, Flags | None]]:
    """Yield long signals in short blocks; the whole record is never copied."""
    length = signals[0].size
    if any(signal.shape != (length,) for signal in signals) or (
        valid is not None and valid.shape != (length,)
    ):
        shapes = ", ".join(str(signal.shape) for signal in signals)
        marks = "" if valid is None else f", and valid of {valid.shape}"
        raise InvalidRequest(f"signals (and valid) must be 1-D and equally long; got shapes {shapes}{marks}")
    for first in range(0, length, _PIECE_SAMPLES):
        part = slice(first, first + _PIECE_SAMPLES)
        block = np.stack([np.asarray(signal[part], dtype=np.float64) for signal in signals])
        yield block, None if valid is None else valid[part]


@dataclass(frozen=True)
class SpectralDensity(Tabular):
    """One-sided spectral density with bounds; arrays of shape (lines,)."""

    OWN_UNITS: ClassVar = {
        "density": "({unit})2 Hz-1",
        "lower": "({unit})2 Hz-1",
        "upper": "({unit})2 Hz-1",
        "amplitude_density": "{unit} Hz-0.5",
    }

    frequency_hz: Reals
    density: Reals
    """Spectral density [unit^2 / Hz]."""
    lower: Reals
    upper: Reals
    """Bounds of each line, which contain the true density with probability ``confidence``."""
    n_eff: float
    """Number of independent averages, corrected for overlap and gaps."""
    noise_bandwidth_hz: float
    """Equivalent noise bandwidth; its product with the density is the power of a sine on a line."""
    segments_used: int
    segments_excluded: int
    sample_rate_hz: float
    segment_samples: int
    window: Window
    overlap: float
    confidence: float

    @property
    def amplitude_density(self) -> Reals:
        """Square root of the density [unit / sqrt(Hz)]."""
        return np.sqrt(self.density)

    def rms(self, low_hz: float, high_hz: float) -> float:
        """Return the root mean square of the signal between two frequencies."""
        kept = (self.frequency_hz >= low_hz) & (self.frequency_hz <= high_hz)
        return float(np.sqrt(np.sum(self.density[kept]) * self.sample_rate_hz / self.segment_samples))


class DensitySums:
    """Spectral density of a long signal that arrives in blocks."""

    def __init__(self, sample_rate_hz: float, *, segment_samples: int, overlap: float = 0.5) -> None:
        self._sample_rate_hz = sample_rate_hz
        self._spectra = SegmentSpectra(1, segment_samples, overlap=overlap)

    def add(self, samples: Reals, valid: Flags | None = None) -> None:
        """Add the next samples, shape (samples,)."""
        self._spectra.add(samples[np.newaxis], valid)

    def density(self) -> SpectralDensity:
        """Return the spectral density of all samples so far."""
        averages = self._spectra.averages()
        density = averages.density(0, 0, self._sample_rate_hz).real
        lower, upper = chi_square_bounds(density, averages.n_eff, DEFAULT_CONFIDENCE)
        return SpectralDensity(
            frequency_hz=averages.frequency_hz(self._sample_rate_hz),
            density=density,
            lower=lower,
            upper=upper,
            n_eff=averages.n_eff,
            noise_bandwidth_hz=self._sample_rate_hz * averages.window_energy / averages.window_sum**2,
            segments_used=averages.segments_used,
            segments_excluded=averages.segments_excluded,
            sample_rate_hz=self._sample_rate_hz,
            segment_samples=averages.segment_samples,
            window=averages.window,
            overlap=averages.overlap,
            confidence=DEFAULT_CONFIDENCE,
        )


def spectral_density(
    samples: Reals, sample_rate_hz: float, *, segment_samples: int, overlap: float = 0.5
) -> SpectralDensity:
    """Estimate the spectral density of a signal by Welch's method, with chi-square bounds.

    Equal to ``scipy.signal.welch(..., detrend=False)`` for equal settings; see `transmissibility` for the
    parameters and errors.
    """
    sums = DensitySums(sample_rate_hz, segment_samples=segment_samples, overlap=overlap)
    for block, _ in pieces((samples,), None):
        sums.add(block[0])
    return sums.density()


@dataclass(frozen=True)
class AmplitudeSpectrum(Tabular):
    """Amplitude spectrum, in which a sine of amplitude 1 has the value 1."""

    OWN_UNITS: ClassVar = {"value": "{unit}", "amplitude": "{unit}"}

    frequency_hz: Reals
    value: Complexes
    """Complex amplitude (peak), phase at the first sample [unit]; shape (lines,)."""
    noise_bandwidth_hz: float
    sample_rate_hz: float
    samples: int
    window: Window

    @property
    def amplitude(self) -> Reals:
        """Peak amplitude of each spectral line, |value| [unit]."""
        return np.abs(self.value)

    @property
    def spacing_hz(self) -> float:
        """Spacing of the spectral lines [Hz]."""
        return self.sample_rate_hz / self.samples

    def convert(self, given: Quantity, wanted: Quantity) -> "AmplitudeSpectrum":
        """Return the spectrum of another quantity, such as velocity / (i w); integrals are NaN at 0 Hz."""
        power = wanted.derivatives - given.derivatives
        return replace(self, value=self.value * derivative_factor(self.frequency_hz, power))


def amplitude_spectrum(
    samples: Reals, sample_rate_hz: float, *, window: Window | str = Window.HANN
) -> AmplitudeSpectrum:
    """Return the amplitude spectrum of a signal.

    Parameters
    ----------
    samples
        Shape (samples,); the mean is removed, so that an offset does not hide the lowest lines.
    window
        Hann by default, which shows up to 15 % too little for a sine between lines; flat top is within 0.1 %.
    """
    count = samples.size
    if count < 2:
        raise InvalidRequest(f"a spectrum of {count} samples was requested; it needs at least 2")
    chosen = by_name(Window, window)
    values = taper(chosen, count)
    spectrum = fft.rfft((samples - np.mean(samples)) * values)
    scale = np.full(spectrum.size, 2 / np.sum(values))
    scale[0] /= 2
    if count % 2 == 0:
        scale[-1] /= 2
    return AmplitudeSpectrum(
        frequency_hz=np.asarray(fft.rfftfreq(count, 1 / sample_rate_hz)),
        value=np.asarray(spectrum * scale),
        noise_bandwidth_hz=sample_rate_hz * float(values @ values) / float(np.sum(values)) ** 2,
        sample_rate_hz=sample_rate_hz,
        samples=count,
        window=chosen,
    )


MOST_COLUMNS = 600
"""Maximum number of columns, since a figure has no more pixels."""
_TAPER = Window.HANN


@dataclass(frozen=True, eq=False)
class Spectrogram(Tabular):
    """Amplitude of a signal over time and frequency."""

    OWN_UNITS: ClassVar = {"amplitude": "{unit}", "density": "({unit})2 Hz-1"}

    time_s: Reals
    """Middle of each column, from the first sample, shape (columns,)."""
    frequency_hz: Reals
    """Frequency of each row, shape (rows,)."""
    amplitude: Reals
    """Peak amplitude of a sine with the power of each cell, shape (rows, columns)."""
    resolution_hz: float
    """Width of the window's main lobe at half power."""
    noise_bandwidth_hz: float
    """Equivalent noise bandwidth of a row [Hz]."""

    @property
    def density(self) -> Reals:
        """One-sided spectral density [unit²/Hz], shape (rows, columns)."""
        return np.asarray(0.5 * self.amplitude**2 / self.noise_bandwidth_hz)


class SpectrogramSums:
    """Spectrogram of a signal that arrives in blocks; only one segment and the result are in memory.

    Parameters
    ----------
    samples
        Length of the whole record, which sets the time per column.
    highest_hz
        Frequency of the last row.
    segment_s
        Length of a segment; segments overlap by half.
    """

    def __init__(
        self, sample_rate_hz: float, samples: int, *, highest_hz: float, segment_s: float = 0.25
    ) -> None:
        self._length = round(segment_s * sample_rate_hz)
        if not (0 < highest_hz <= sample_rate_hz / 2 and self._length >= 2):
            raise InvalidRequest(
                f"a spectrogram up to {highest_hz:g} Hz with segments of {segment_s:g} s was requested at "
                f"{sample_rate_hz:g} samples/s; give at most half of this, and segments of 2 or more samples"
            )
        if samples < self._length:
            raise NotEnoughData(
                f"{samples} samples are less than one segment of {segment_s:g} s; use shorter segments"
            )
        self._hop = max(1, self._length // 2)
        segments = 1 + (samples - self._length) // self._hop
        self._columns = min(MOST_COLUMNS, segments)
        self._segments = segments
        self._window = taper(_TAPER, self._length)
        self._rate_hz = sample_rate_hz
        self._rows = int(highest_hz * self._length / sample_rate_hz) + 1
        self._power = np.zeros((self._rows, self._columns))
        self._count = np.zeros(self._columns)
        self._done = 0
        self._carry = np.empty(0)

    def add(self, block: Reals) -> None:
        """Add the next samples, shape (samples,)."""
        data = np.concatenate((self._carry, block))
        first = 0
        while first + self._length <= data.size and self._done < self._segments:
            column = self._done * self._columns // self._segments
            spectrum = np.fft.rfft(self._window * data[first : first + self._length])[: self._rows]
            self._power[:, column] += spectrum.real**2 + spectrum.imag**2
            self._count[column] += 1
            self._done += 1
            first += self._hop
        self._carry = data[first:].copy()

    def spectrogram(self) -> Spectrogram:
        """Return the spectrogram of all samples so far."""
        filled = self._count > 0
        mean = self._power[:, filled] / self._count[filled]
        starts = np.arange(self._segments) * self._columns // self._segments
        middle = np.arange(self._segments) * self._hop + 0.5 * self._length
        time_s = np.bincount(starts, middle, self._columns)[filled] / np.bincount(starts)[filled]
        return Spectrogram(
            time_s=np.asarray(time_s / self._rate_hz),
            frequency_hz=np.arange(self._rows, dtype=np.float64) * (self._rate_hz / self._length),
            amplitude=2 * np.sqrt(mean) / self._window.sum(),
            resolution_hz=1.44 * self._rate_hz / self._length,
            noise_bandwidth_hz=float(self._rate_hz * np.sum(self._window**2) / np.sum(self._window) ** 2),
        )
