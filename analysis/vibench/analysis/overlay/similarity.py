"""Similarity of two response curves: the paper's difference of logarithms and rate of similar points."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ..errors import InvalidRequest, NotEnoughData
from ..signals import Flags, Reals
from ..tables import Tabular

SIMILARITY_THRESHOLD = 0.1
"""Largest `Similarity.difference` at which points count as similar (Gong et al. 2025, section 4)."""
DRAWS = 2000
"""Number of bootstrap resamples; with these, an interval's limits scatter by about 1/40 of its width."""
CONFIDENCE = 0.95


class LogarithmOf(StrEnum):
    """Argument of the logarithm in eq. 6; similarity rates depend on it, but the paper does not state it."""

    NORMALISED = "normalised"
    """Response over drive amplitude, x / A0."""
    METRES = "m"
    MILLIMETRES = "mm"
    MICROMETRES = "um"


_PER_METRE = {LogarithmOf.METRES: 1.0, LogarithmOf.MILLIMETRES: 1e3, LogarithmOf.MICROMETRES: 1e6}


@dataclass(frozen=True, eq=False)
class SimilarityCurve:
    """A response curve, simulated or measured; arrays of shape (points,)."""

    frequency_hz: Reals
    response: Reals
    """Response I or II, relative to the drive amplitude; NaN if missing."""
    amplitude_m: float
    """Drive amplitude A0 [m]."""

    def __post_init__(self) -> None:
        if self.frequency_hz.ndim != 1 or self.frequency_hz.shape != self.response.shape:
            raise InvalidRequest(
                f"frequencies of shape {self.frequency_hz.shape} and responses of {self.response.shape} were "
                "given; give one-dimensional arrays of equal length"
            )
        if not np.all(np.diff(self.frequency_hz) > 0):
            raise InvalidRequest("the frequencies of a curve do not ascend; sort them, and remove duplicates")
        if not 0.0 < self.amplitude_m < np.inf:
            raise InvalidRequest(
                f"a drive amplitude of {self.amplitude_m} m is not allowed; give a positive amplitude"
            )

    def at(self, frequency_hz: Reals) -> "SimilarityCurve":
        """Return the curve interpolated at these frequencies, on logarithmic axes.

        Raises InvalidRequest for frequencies outside the curve.
        """
        low, high = self.frequency_hz[0], self.frequency_hz[-1]
        if frequency_hz[0] < low or frequency_hz[-1] > high:
            raise InvalidRequest(
                f"{frequency_hz[0]:g} to {frequency_hz[-1]:g} Hz was requested, but the curve covers only "
                f"{low:g} to {high:g} Hz; compare within this range"
            )
        between = np.interp(np.log(frequency_hz), np.log(self.frequency_hz), np.log(self.response))
        return SimilarityCurve(frequency_hz, np.exp(between), self.amplitude_m)

    def logarithm(self, of: LogarithmOf) -> Reals:
        """Return log10 of the response in the named unit, shape (points,)."""
        is_normalised = of is LogarithmOf.NORMALISED
        value = self.response if is_normalised else self.response * self.amplitude_m * _PER_METRE[of]
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.log10(value))


@dataclass(frozen=True, eq=False)
class Similarity(Tabular):
    """Similarity of a model's response to the reference; arrays of shape (points,)."""

    frequency_hz: Reals
    difference: Reals
    """|log10(model) - log10(reference)| / |log10(reference)| (eq. 6); NaN if either is missing."""
    logarithm_of: LogarithmOf
    threshold: float
    rate: float
    """Fraction of points at which the two curves are similar (eq. 7)."""
    low: float
    high: float
    """95 % interval of the similarity rate for other choices of frequencies in the same band."""
    block_points: int
    """Block length of the bootstrap; blocks keep the correlation of neighbouring points."""
    left_out: int
    """Number of points at which one of the curves has no value."""

    @property
    def is_similar(self) -> Flags:
        """Flags of points whose difference is at most the threshold."""
        return np.asarray(self.difference <= self.threshold)


def similarity(
    reference: SimilarityCurve,
    model: SimilarityCurve,
    logarithm_of: LogarithmOf = LogarithmOf.MILLIMETRES,
    threshold: float = SIMILARITY_THRESHOLD,
    *,
    seed: int = 0,
) -> Similarity:
    """Compare a model's response curve with the reference's (Gong et al. 2025, eqs. 6 and 7).

    Raises InvalidRequest when the frequencies differ or the threshold is not positive; NotEnoughData when no
    point has a value in both curves.

    Parameters
    ----------
    reference, model
        Response of the piece-wise model (or a measurement) and of its substitute, at the same frequencies;
        `SimilarityCurve.at` interpolates.
    logarithm_of
        Unit inside the logarithm, which the paper does not state. Where the reference is 1 in this unit, a
        point is similar only if both curves are equal, because the difference is otherwise infinite.
    threshold
        Largest difference of a similar point.
    seed
        Seed of the bootstrap (circular blocks; Politis and Romano 1992).
    """
    if not np.array_equal(reference.frequency_hz, model.frequency_hz):
        raise InvalidRequest(
            "the curves have different frequencies; interpolate one of them with SimilarityCurve.at"
        )
    if not threshold > 0.0:
        raise InvalidRequest(f"a threshold of {threshold} is not allowed; give a positive value, such as 0.1")
    base, other = reference.logarithm(logarithm_of), model.logarithm(logarithm_of)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.abs(other - base) / np.abs(base)
    # Equal values have no difference, even if the logarithm of the reference is zero.
    difference = np.where(other == base, 0.0, ratio)
    known = np.isfinite(base) & np.isfinite(other)
    if not known.any():
        raise NotEnoughData("no frequency has a value in both curves, so nothing can be compared")
    flags = np.asarray(difference[known] <= threshold, dtype=np.float64)
    block = _block_length(flags)
    low, high = _interval(flags, block, np.random.default_rng(seed))
    return Similarity(
        frequency_hz=reference.frequency_hz,
        difference=difference,
        logarithm_of=logarithm_of,
        threshold=threshold,
        rate=float(np.mean(flags)),
        low=low,
        high=high,
        block_points=block,
        left_out=int(np.sum(~known)),
    )


def _block_length(flags: Reals) -> int:
    """Return twice the correlation length of flags, but at least the cube root of the number of flags."""
    count = flags.size
    usual = int(np.ceil(count ** (1 / 3)))
    centred = flags - flags.mean()
    power = float(np.mean(centred**2))
    if power == 0.0:
        return min(usual, count)
    length = 1.0
    for lag in range(1, count // 2):
        correlation = float(np.mean(centred[lag:] * centred[:-lag])) / power
        if correlation <= 0.0:
            break
        length += 2 * correlation
    return min(max(usual, int(np.ceil(2 * length))), count)


def _interval(flags: Reals, block: int, rng: np.random.Generator) -> tuple[float, float]:
    count = flags.size
    blocks = -(-count // block)
    starts = rng.integers(0, count, size=(DRAWS, blocks, 1))
    places = (starts + np.arange(block)).reshape(DRAWS, -1)[:, :count] % count
    rates = flags[places].mean(axis=1)
    tail = 0.5 * (1 - CONFIDENCE)
    low, high = np.quantile(rates, (tail, 1 - tail))
    return float(low), float(high)
