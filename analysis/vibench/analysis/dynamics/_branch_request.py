"""Request for branches: a specimen, a range of frequency or level, and a method."""

import math
from enum import StrEnum
from itertools import pairwise
from typing import Annotated, Self

import numpy as np
from pydantic import Field, PositiveFloat, model_validator

from vibench.sim import (
    AmplitudePath,
    BalanceOptions,
    DrivePath,
    FrequencyPath,
    Harmonic,
    HarmonicSet,
    Parameter,
    PhaseReference,
    PowerLaw,
    RigidStops,
)
from vibench.sim.branches import MotionSearch
from vibench.sim.study import TargetError, TargetTime

from ..errors import NotEnoughData
from ..signals.arrays import Reals
from ._specimen_choice import SpecimenChoice

EXACT_ENOUGH = 1e-4
"""Largest relative change of the fundamental of p due to the neglected harmonics."""


class BranchMethod(StrEnum):
    """Method to find and follow motions."""

    SHOOTING = "shooting"
    """Shooting: exact motions of any period with every contact, for any contact law."""
    BALANCE = "balance"
    """Harmonic balance, as many harmonics as needed; for motions of the drive's period, no rigid stops."""
    FIRST_ORDER = "first-order"
    """Harmonic balance with one harmonic, the paper's eq. 5; for power laws only."""


class BranchRequest(SpecimenChoice):
    """Request for all periodic motions over a range."""

    method: BranchMethod = BranchMethod.SHOOTING
    """Shooting (exact), harmonic balance, or first order (one harmonic: eq. 5 of the paper)."""
    along: Parameter = Parameter.FREQUENCY
    """Parameter that varies: frequency or amplitude of the drive."""
    amplitude_m: PositiveFloat = 5e-6
    """Amplitude of the base displacement when the frequency varies."""
    frequency_hz: PositiveFloat = 260.0
    """Frequency of the drive when the amplitude varies."""
    start: PositiveFloat = 50.0
    """Lower end of the range of frequencies [Hz] or amplitudes [m]."""
    stop: PositiveFloat = 600.0
    """Upper end of the range of frequencies [Hz] or amplitudes [m]."""
    error: TargetError | None = None
    """Error of each motion relative to the fundamental of p, such as 0.01 or "1 %"; 1e-4 by default. Harmonic
    balance uses as many harmonics as needed; the error of shooting is fixed, usually below 1e-6."""
    time_s: TargetTime | None = None
    """Time limit of the search, such as 20 or "20 s"; the result contains the branches found by then. Without
    it, also with an error, the search takes as long as it needs."""
    harmonics: Annotated[int, Field(ge=3, le=1023)] = 511
    """Highest harmonic of the harmonic balance."""
    places: Annotated[int, Field(ge=2, le=1000)] = 8
    """Number of values in the range at which motions are searched for."""
    starts: Annotated[int, Field(ge=0, le=10_000)] = 12
    """Number of random initial states at each value; a larger number may find further isolated branches."""
    most_periods: Annotated[int, Field(ge=1, le=16)] = 4
    """Longest period to search for, in drive periods."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the random initial states."""
    resonance_band_hz: tuple[PositiveFloat, PositiveFloat] | None = None
    """Two frequencies [Hz] around a mode whose phase resonance is followed while the amplitude varies."""
    phase_of: PhaseReference = PhaseReference.RELATIVE
    """Motion of m0 that lags the base by a quarter of a period at the phase resonance."""
    loop_time_s: PositiveFloat | None = None
    """Latency of the bench's feedback loop [s], which limits the unstable motions that the bench can hold."""
    recorded_level: tuple[tuple[PositiveFloat, PositiveFloat], ...] = ()
    """Recorded base amplitude over frequency, as pairs [Hz, m], instead of one constant amplitude."""

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        if not self.start < self.stop:
            raise ValueError(
                f"the range {self.start:g} to {self.stop:g} does not ascend; give the lower value first"
            )
        law = self.chosen_specimen.contact
        if self.method is BranchMethod.FIRST_ORDER and not isinstance(law, PowerLaw):
            raise ValueError(
                f"one harmonic cannot describe {self.law}: choose a power law such as power:5, or the "
                "method 'balance' or 'shooting'"
            )
        if self.method is BranchMethod.BALANCE and isinstance(law, RigidStops):
            raise ValueError(
                "harmonic balance needs a finite contact force, and rigid stops have none; choose "
                "the method 'shooting'"
            )
        if self.error is not None and self.method is BranchMethod.FIRST_ORDER:
            raise ValueError(
                f"an error of {self.error:g} was given, but the error of one harmonic is fixed; use "
                "the method 'balance' or 'shooting', or leave out the error"
            )
        self._refuse_other_resonances()
        pairs = self.recorded_level
        if pairs and self.along is Parameter.AMPLITUDE:
            raise ValueError(
                "a recorded level needs branches along frequency; along amplitude, give one frequency"
            )
        if pairs and (len(pairs) < 2 or not all(a[0] < b[0] for a, b in pairwise(pairs))):
            raise ValueError("a recorded level needs two or more ascending frequencies")
        Harmonic(*self.path.drive(self.stop))  # raises an error if the drive is impossible
        return self

    def _refuse_other_resonances(self) -> None:
        if self.resonance_band_hz is None:
            return
        low_hz, high_hz = self.resonance_band_hz
        if not low_hz < high_hz:
            raise ValueError(f"the band {low_hz:g} to {high_hz:g} Hz does not ascend; swap the two ends")
        lower, upper = self.chosen_specimen.gaps_m
        followed = self.along, self.method, self.time_s
        if followed != (Parameter.AMPLITUDE, BranchMethod.SHOOTING, None) or lower != upper:
            raise ValueError(
                "a phase resonance is followed along amplitude, by shooting, with two equal stops and no "
                "time limit; give a range of amplitudes and a specimen with one gap, and leave out the time"
            )

    @property
    def path(self) -> DrivePath:
        """Path in frequency and amplitude along which branches are followed."""
        if self.along is Parameter.AMPLITUDE:
            return AmplitudePath(self.frequency_hz)
        if self.recorded_level:
            frequencies_hz, amplitudes_m = zip(*self.recorded_level, strict=True)
            return FrequencyPath(amplitudes_m, frequencies_hz)
        return FrequencyPath((self.amplitude_m,))

    @property
    def search(self) -> MotionSearch:
        """Settings of the search for motions."""
        return MotionSearch(
            places=self.places,
            starts=self.starts,
            most_periods=self.most_periods,
            seed=self.seed,
            time_s=math.inf if self.time_s is None else self.time_s,
        )

    @property
    def balance_options(self) -> BalanceOptions:
        """Options of harmonic balance."""
        lower, upper = self.chosen_specimen.gaps_m
        kept = HarmonicSet.ODD if lower == upper else HarmonicSet.ALL
        most = 1 if self.method is BranchMethod.FIRST_ORDER else self.harmonics
        return BalanceOptions(kept, fewest=min(15, most), most=most, tolerance=self.error or EXACT_ENOUGH)

    @property
    def title(self) -> str:
        """Title of the request for curves and figures."""
        where = f"{1e6 * self.amplitude_m:g} µm"
        if self.resonance_band_hz is not None:
            low_hz, high_hz = self.resonance_band_hz
            return f"{self.law}, {self.phase_of.value} phase resonance between {low_hz:g} and {high_hz:g} Hz"
        if self.along is Parameter.AMPLITUDE:
            where = f"{self.frequency_hz:g} Hz"
        elif self.recorded_level:
            where = "recorded level"
        return f"{self.law}, {where}, {self.method.value}"

    @property
    def sentence(self) -> str:
        """Return the caption of a figure, with all options."""
        text = f"{self.title}; {self.specimen_text}"
        if self.resonance_band_hz is not None:
            return f"{text}."
        return (
            f"{text}; motions searched at {self.places} values from {self.starts} random states each, seed "
            f"{self.seed}, up to {self.most_periods} drive periods long."
        )


MOST_BINS = 100


def recorded_level(frequency_hz: Reals, drive_amplitude_m: Reals) -> tuple[tuple[float, float], ...]:
    """Return up to 100 pairs of frequency [Hz] and base amplitude [m] of a sweep or stepped sine, ascending.

    Raises NotEnoughData when the drive had fewer than two frequencies.

    Parameters
    ----------
    frequency_hz, drive_amplitude_m
        Measured values in any order, shape (n,). The median of each bin is used, so that one outlier has no
        effect.
    """
    known = np.isfinite(frequency_hz) & np.isfinite(drive_amplitude_m) & (drive_amplitude_m > 0.0)
    place, level = frequency_hz[known], drive_amplitude_m[known]
    if place.size < 2 or np.ptp(place) < 1e-3 * float(place.max()):
        raise NotEnoughData(
            "the drive of this recording covers no range of frequencies; choose a stepped sine or a sweep"
        )
    bins = min(MOST_BINS, place.size)
    edges = np.linspace(place.min(), place.max(), bins + 1)
    owner = np.clip(np.searchsorted(edges, place, side="right") - 1, 0, bins - 1)
    return tuple(
        (float(np.median(place[owner == k])), float(np.median(level[owner == k])))
        for k in range(bins)
        if bool(np.any(owner == k))
    )
