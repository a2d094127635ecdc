"""A curve that can be laid over others: motion of m0 over motion of the base, against frequency.

Transmissions of noise, Responses I and II of sweeps, steps and dwells, and predictions of them all are
ratios of displacements, so they share one axis. What each of them is stands in its name: a transmission
of a colliding specimen is not its Response I.
"""

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from ..errors import NotEnoughData
from ..live import column_starts, envelope
from ..model.difference import CurveDifference, logarithmic_difference
from ..signals.arrays import Reals
from ..tables import Labelled


class CurveOrigin(StrEnum):
    """Where a curve comes from."""

    MEASURED = "measured"
    SIMULATED = "simulated"
    """Rig and specimen under the recorded voltage, or the specimen under the recorded base motion, through
    the same estimator."""
    PREDICTED = "predicted"
    """The specimen under sines."""
    STABLE = "stable branches"
    """Periodic motions that an experiment can rest on; several at one frequency."""
    UNSTABLE = "unstable branches"
    """Periodic motions that only feedback holds; several at one frequency."""


class CurveKind(StrEnum):
    """What a curve tells of the motion."""

    TRANSMISSIBILITY = "transmission"
    RESPONSE_I = "Response I"
    RESPONSE_II = "Response II"


@dataclass(frozen=True, eq=False)
class Curve(Labelled):
    """One curve; arrays of shape (points,), frequencies ascending but on branches."""

    source: str
    """Name of the recording or of the prediction."""
    origin: CurveOrigin
    response: CurveKind
    frequency_hz: Reals
    magnitude: Reals
    """Displacement of m0 over displacement of the base; NaN where there is none."""
    relative_sd: Reals
    """Of the magnitude; NaN where nothing is known of it."""
    note: str = ""
    """What else is to be known: averages, window, accuracy."""
    level_m: float | None = None
    """Amplitude of the base for which a simulated curve holds [m]; None where none was asked for."""

    @property
    def name(self) -> str:
        """``"sweep_weak, Response II, measured"``."""
        return f"{self.source}, {self.response.value}, {self.origin.value}"

    @property
    def is_single_valued(self) -> bool:
        """Each frequency has one value: no branches, which fold."""
        return self.origin not in (CurveOrigin.STABLE, CurveOrigin.UNSTABLE)

    @property
    def lower(self) -> Reals:
        """Magnitude less two standard deviations, on a logarithmic scale; a tenth of it at the least."""
        return np.asarray(self.magnitude * np.exp(-self._reach))

    @property
    def upper(self) -> Reals:
        """Magnitude and two standard deviations, on a logarithmic scale; ten times it at the most."""
        return np.asarray(self.magnitude * np.exp(self._reach))

    def band(self, columns: int) -> tuple[Reals, Reals, Reals]:
        """Give frequencies, lowest and highest bounds in at most so many columns: areas are slow to draw."""
        starts = column_starts(self.frequency_hz.size, columns)
        low, _ = envelope(self.lower, columns)
        _, high = envelope(self.upper, columns)
        return self.frequency_hz[starts], np.asarray(low, np.float64), np.asarray(high, np.float64)

    @property
    def _reach(self) -> Reals:
        """Bounds that reach further say that nothing is known, and would only fill the picture."""
        return np.minimum(2 * self.relative_sd, np.log(10.0))

    def at(self, frequency_hz: Reals) -> "Curve":
        """Read the curve at other frequencies, straight between points in both logarithms; NaN outside.

        NaN everywhere on branches, which have several values at one frequency.
        """
        known = np.isfinite(self.magnitude) & (self.magnitude > 0)
        if not known.any() or not self.is_single_valued:
            return replace(
                self,
                frequency_hz=frequency_hz,
                magnitude=np.full(frequency_hz.shape, np.nan),
                relative_sd=np.full(frequency_hz.shape, np.nan),
            )
        place, given = np.log(frequency_hz), np.log(self.frequency_hz[known])
        magnitude = np.interp(place, given, np.log(self.magnitude[known]), left=np.nan, right=np.nan)
        spread = np.interp(place, given, self.relative_sd[known], left=np.nan, right=np.nan)
        return replace(self, frequency_hz=frequency_hz, magnitude=np.exp(magnitude), relative_sd=spread)


def sorted_curve(curve: Curve) -> Curve:
    """Bring the points into ascending order, each frequency once: sweeps downwards come the other way."""
    frequency_hz, first = np.unique(curve.frequency_hz, return_index=True)
    return replace(
        curve,
        frequency_hz=frequency_hz,
        magnitude=curve.magnitude[first],
        relative_sd=curve.relative_sd[first],
    )


def curve_difference(curve: Curve, reference: Curve) -> CurveDifference:
    """Say how far a curve lies above another, at its own frequencies within both.

    Raises
    ------
    NotEnoughData
        When the two have no frequency in common.

    """
    for each in (curve, reference):
        if not each.is_single_valued:
            raise NotEnoughData(
                f"{each.name} has several values at one frequency, so that there is no one difference; "
                "compare curves of recordings or predictions"
            )
    low = max(curve.frequency_hz[0], reference.frequency_hz[0])
    high = min(curve.frequency_hz[-1], reference.frequency_hz[-1])
    shared = (curve.frequency_hz >= low) & (curve.frequency_hz <= high) & np.isfinite(curve.magnitude)
    if not shared.any():
        raise NotEnoughData(
            f"{curve.name} and {reference.name} have no frequency in common; compare curves that overlap"
        )
    place = curve.frequency_hz[shared]
    other = reference.at(place)
    return logarithmic_difference(
        place,
        (curve.magnitude[shared], np.nan_to_num(curve.relative_sd[shared])),
        (other.magnitude, np.nan_to_num(other.relative_sd)),
    )
