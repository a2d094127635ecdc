"""Frequency response to hammer hits, with an exponential window of known decay."""

from dataclasses import dataclass, replace

import numpy as np

from ..errors import NotEnoughData
from ..recordings.channels import RecordedChannels, Stretch
from ..signals import Complexes, Reals, Window
from ..spectra import SpectralAverages
from .modal_fit import Resonance
from .results import Estimator, FrequencyResponse, FrequencyResponseSettings
from .transmissibility import frequency_response_of

_BLOCK = 1 << 19
_PIECE_S, _FEWEST_PIECES = 0.01, 100
"""Usual length [s] and minimum number of the pieces into which the drive is divided to compare energies."""
_SHORT, _MOST_ENERGY = 0.05, 0.9
"""The strongest 0.05 of the time contains over 0.9 of the energy of hits, but 0.06 of that of noise."""
_TRIGGER = 0.1
"""Trigger level of a hit relative to the peak of the hardest hit."""
_LEAD_PERIODS = 2.0
"""Time from the start of a segment to the trigger, in periods of the highest frequency."""
_REMAINDER = 1e-3
"""Largest rms of the windowed response in a segment's last part, relative to its strongest part."""
_PARTS = 20
"""Number of equal parts into which a segment is divided; the rms values of the parts show the decay."""
_NOTHING = 1e-300
EXPONENTIAL = "exponential"
_ASSUMED_SD = 0.01
"""Scatter assumed to weight the lines of a single hit, relative to each line and to the largest line."""


@dataclass(frozen=True)
class Hits:
    """Segments of a record that each begin with a hit."""

    starts: tuple[int, ...]
    """Index of the first sample of each segment."""
    segment_samples: int
    left_out: int
    """Number of hits whose segment is cut short by the next hit or by the end of the record."""


def find_hits(
    channels: RecordedChannels, stretch: Stretch, band_hz: tuple[float, float], segment_s: float | None
) -> Hits | None:
    """Return the segments of the hits in the drive; None if the drive does not consist of hits.

    Pulses within a period of the lowest frequency count as one hit. The default segment length keeps as much
    recorded time as possible from at least two hits.

    Raises NotEnoughData when no hit has a segment of the given length.

    Parameters
    ----------
    channels, stretch
        The record, and its part to search.
    band_hz
        Lowest and highest frequency of the analysis.
    segment_s
        Length of a segment, if given.
    """
    rate, low_hz, high_hz = channels.sample_rate_hz, *band_hz
    blocks = range(stretch.start, stretch.stop, _BLOCK)
    piece = max(1, min(round(_PIECE_S * rate), stretch.samples // _FEWEST_PIECES))
    powers = [_drive(channels, first, min(first + _BLOCK, stretch.stop)) ** 2 for first in blocks]
    energies = np.concatenate([np.add.reduceat(each, np.arange(0, each.size, piece)) for each in powers])
    short = np.sort(energies)[::-1][: max(1, int(_SHORT * energies.size))]
    if not np.sum(short) > _MOST_ENERGY * np.sum(energies):
        return None
    drive = _drive(channels, stretch.start, stretch.stop)
    above = np.flatnonzero(np.abs(drive) > _TRIGGER * np.max(np.abs(drive)))
    firsts = above[np.diff(above, prepend=-drive.size) > rate / low_hz]
    starts = stretch.start + np.maximum(firsts - round(_LEAD_PERIODS * rate / high_hz), 0)
    clear = np.diff(starts, append=stretch.stop)
    segment = _longest(clear) if segment_s is None else round(segment_s * rate)
    kept = starts[clear >= segment]
    if not kept.size or segment < rate / low_hz:
        raise NotEnoughData(
            f"{starts.size} hits were found, at most {np.max(clear) / rate:.3g} s apart; a segment of "
            f"{segment / rate:.3g} s must end before the next hit and contain a period of "
            f"{low_hz:g} Hz: request another segment length, or wait longer between hits"
        )
    return Hits(tuple(int(each) for each in kept), int(segment), int(starts.size - kept.size))


def _drive(channels: RecordedChannels, start: int, stop: int) -> Reals:
    """Return the drive without its offset; lost samples are zero."""
    drive = np.nan_to_num(channels.read(start, stop)[0])
    return np.asarray(drive - np.median(drive))


def _longest(clear: Reals) -> int:
    """Return the segment length that maximises (segments - 1) * length; the longest if all products are 0."""
    kept_s = [(np.count_nonzero(clear >= each) - 1) * each for each in clear]
    return int(clear[int(np.argmax(kept_s))] if max(kept_s) > 0 else np.max(clear))


@dataclass(frozen=True, eq=False)
class HitSpectra:
    """Spectra of the hits under an exponential window, from which responses are estimated.

    The window multiplies all channels by exp(-decay t), which turns H(i w) into H(i w + decay). The decay is
    the smallest that reduces the response to a thousandth at the end of a segment; 0 with ``Window.BOXCAR``.
    """

    settings: FrequencyResponseSettings
    spectra: Complexes
    """Base, response and drive of each hit, shape (hits, 3, lines)."""
    left_out: int

    @property
    def count(self) -> int:
        """Number of hits in the spectra."""
        return len(self.spectra)

    def response(self, estimator: Estimator, noise_ratio: float | None = None) -> FrequencyResponse:
        """Estimate response over base; bounds are infinite for a single hit, whose scatter is unknown."""
        products = np.einsum("kif,kjf->ijf", np.conj(self.spectra), self.spectra) / self.count
        averages = SpectralAverages(
            products, self.count, self.left_out, max(self.count, 2.0), self.settings.segment_samples,
            Window.BOXCAR, 0.0, 1.0, 1.0,
        )  # fmt: skip
        settings = replace(self.settings, estimator=estimator, noise_ratio=noise_ratio)
        added_hz = (settings.decay_per_s or 0.0) / np.pi
        found = replace(frequency_response_of(averages, settings), resolution_hz=added_hz)
        if self.count > 1:
            return found
        unknown = np.full(found.frequency_hz.size, np.inf)
        return replace(
            found, n_eff=1.0, relative_sd_magnitude=unknown, sd_phase_rad=unknown, half_width=unknown,
            coherence_significance=1.0, steady_relative_sd=None,
        )  # fmt: skip

    def without_each(self) -> tuple["HitSpectra", ...]:
        """For each hit, return the set of spectra without that hit."""
        return tuple(
            replace(self, spectra=np.delete(self.spectra, each, axis=0)) for each in range(self.count)
        )


def hit_spectra(
    data: Reals, hits: Hits, settings: FrequencyResponseSettings, high_hz: float, *, fades: bool
) -> HitSpectra:
    """Return the spectra of the segments that begin with hits.

    Parameters
    ----------
    data
        Drive, base and response of each usable hit, shape (hits, 3, samples).
    hits
        Positions of the hits in the record.
    settings
        Settings of the response; window and decay are filled in.
    high_hz
        Highest frequency to keep.
    fades
        Whether to apply an exponential window if the response has not decayed by the end of a segment.
    """
    rate, size = settings.sample_rate_hz, hits.segment_samples
    # A free body still moves after a hit, so the velocity is known to be zero only before the hit.
    data = data - np.mean(data[..., : max(round(rate / high_hz), 1)], axis=2, keepdims=True)
    levels = np.sqrt([np.mean(part**2) for part in np.array_split(data[:, 2], _PARTS, axis=1)])
    lasting = np.log(max(levels[-1] / max(np.max(levels), _NOTHING) / _REMAINDER, 1.0)) if fades else 0.0
    decay_per_s = float(lasting) * rate / size
    lines = int(high_hz * size / rate) + 1
    windowed = data[:, [1, 2, 0]] * np.exp(-decay_per_s * np.arange(size) / rate)
    chosen = replace(
        settings, segment_samples=size, window=EXPONENTIAL if lasting else Window.BOXCAR.value, overlap=0.0,
        decay_per_s=decay_per_s,
    )  # fmt: skip
    return HitSpectra(chosen, np.fft.rfft(windowed)[..., :lines], hits.left_out)


def with_assumed_scatter(response: FrequencyResponse) -> FrequencyResponse:
    """Return a single hit's response with an assumed scatter, for a fit without bounds."""
    # Assume that all lines of the velocity have the same noise and, in addition, the same relative error.
    size = response.magnitude / response.frequency_hz
    assumed = _ASSUMED_SD * np.hypot(1.0, np.max(size) / np.maximum(size, _NOTHING))
    return replace(
        response, relative_sd_magnitude=assumed, coherence_significance=0.0, reference_coherence=None
    )


def without_bounds(found: Resonance) -> Resonance:
    """Return the resonance with infinite standard deviations."""
    return replace(
        found, sd_frequency_hz=np.inf, sd_damping_ratio=np.inf, sd_peak_magnitude=np.inf,
        reduced_chi_square=np.nan, overlap=1.0,
    )  # fmt: skip
