"""Average spectra of a record that arrives block by block, in memory that does not grow with it."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy import fft

from ..errors import InvalidRequest, NotEnoughData, UnusableData
from ..signals.arrays import Complexes, Flags, Reals
from ..signals.window import Window, effective_averages, hop_samples, named_window, taper

_BATCH_SAMPLES = 1 << 19
"""Samples (all channels) transformed at once: 4 MB, so that a batch stays near the processor."""
_PIECE_SAMPLES = 1 << 19
"""Samples per channel that `pieces` hands over at once."""


@dataclass(frozen=True)
class SpectralAverages:
    """Averaged products of the channels' segment spectra, and how many averages they are worth."""

    products: Complexes
    """Mean of conj(X_i) X_j over the used segments, shape (channels, channels, lines); not scaled."""
    segments_used: int
    segments_excluded: int
    """Segments left out because they touched an invalid sample."""
    n_eff: float
    """Independent averages, corrected for overlap and gaps."""
    segment_samples: int
    window: Window
    overlap: float
    window_sum: float
    window_energy: float

    def frequency_hz(self, sample_rate_hz: float) -> Reals:
        """Frequencies of the lines that there are, from 0 Hz on [Hz]."""
        return np.asarray(fft.rfftfreq(self.segment_samples, 1 / sample_rate_hz)[: self.products.shape[-1]])

    def density(self, first: int, second: int, sample_rate_hz: float) -> Complexes:
        """One-sided (cross-)spectral density of two channels [product of their units per Hz]."""
        scale = np.full(self.products.shape[-1], 2 / (sample_rate_hz * self.window_energy))
        scale[0] /= 2
        if self.segment_samples % 2 == 0:
            scale[-1] /= 2
        return np.asarray(self.products[first, second] * scale)


class SegmentSpectra:
    """Cuts blocks of samples into overlapping segments and sums the products of their spectra.

    The FFT of each segment is computed once and shared by all pairs of channels. Nothing is
    subtracted from a segment: with a Hann window an offset reaches lines 0 and 1 only, with a
    boxcar line 0 only, and a mean removed per segment would disturb the lowest lines instead.
    """

    def __init__(
        self, channels: int, segment_samples: int, *, window: Window | str = Window.HANN, overlap: float = 0.5
    ) -> None:
        if segment_samples < 2:
            raise InvalidRequest(f"a segment of {segment_samples} samples has no spectrum; use at least 2")
        self._window = named_window(window)
        self._overlap = overlap
        self._hop = hop_samples(segment_samples, overlap)
        self._taper = taper(self._window, segment_samples)
        self._sums = np.zeros((channels, channels, segment_samples // 2 + 1), dtype=np.complex128)
        self._carry = np.empty((channels, 0))
        self._carry_valid = np.empty(0, dtype=np.bool_)
        self._used: list[Flags] = []

    def add(self, block: Reals, valid: Flags | None = None) -> None:
        """Take the next samples of all channels.

        Parameters
        ----------
        block
            Shape (channels, samples), following the block before without a gap.
        valid
            Which samples may be used, shape (samples,); a segment that touches an invalid one is left out.

        """
        marks = np.ones(block.shape[1], dtype=np.bool_) if valid is None else valid
        data = np.concatenate((self._carry, block), axis=1) if self._carry.shape[1] else block
        marks = np.concatenate((self._carry_valid, marks))
        count = (
            (data.shape[1] - self._taper.size) // self._hop + 1 if data.shape[1] >= self._taper.size else 0
        )
        if count:
            self._sum_segments(data, marks, count)
        self._carry = data[:, count * self._hop :].copy()
        self._carry_valid = marks[count * self._hop :]

    def _sum_segments(self, data: Reals, marks: Flags, count: int) -> None:
        invalid = np.concatenate(([0], np.cumsum(~marks)))
        starts = np.arange(count) * self._hop
        used = invalid[starts + self._taper.size] == invalid[starts]
        self._used.append(used)
        segments = sliding_window_view(data, self._taper.size, axis=1)
        size = max(1, _BATCH_SAMPLES // (data.shape[0] * self._taper.size))
        usable = starts[used]
        for first in range(0, usable.size, size):
            batch = segments[:, usable[first : first + size]] * self._taper
            self._sum_products(np.asarray(fft.rfft(batch, axis=-1, overwrite_x=True)))

    def _sum_products(self, spectra: Complexes) -> None:
        """Add conj(X_i) X_j for i <= j; the other half is filled in at the end."""
        for i, first in enumerate(spectra):
            self._sums[i, i] += np.einsum("kf,kf->f", first.real, first.real)
            self._sums[i, i] += np.einsum("kf,kf->f", first.imag, first.imag)
            if i + 1 < len(spectra):
                conjugate = np.conj(first)
                for j in range(i + 1, len(spectra)):
                    self._sums[i, j] += np.einsum("kf,kf->f", conjugate, spectra[j])

    def averages(self) -> SpectralAverages:
        """Give the averages over everything added so far.

        Raises NotEnoughData when no segment could be used, and UnusableData when a sample that was not marked
        invalid is not finite.
        """
        used = np.concatenate(self._used) if self._used else np.empty(0, dtype=np.bool_)
        count = int(np.count_nonzero(used))
        if count == 0:
            raise NotEnoughData(
                f"no whole valid segment of {self._taper.size} samples was found "
                f"({used.size} touched invalid samples); use shorter segments or a longer record"
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
    """Hand over long signals in short blocks, so that stacking them never copies the whole record."""
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
