"""A motion under a harmonic drive, followed stretch by stretch, each watched in its own way. SI units."""

import math
from copy import copy
from dataclasses import dataclass, replace
from enum import Enum
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from ..exponents import energy_metric
from ..flight import FlightTables
from ..kernels import Floats, advance_clock, clock_at
from ..lanes import LaneRun
from ..model import Accuracy, Harmonic, Outcome, Specimen
from ..motion import MAX_IMPACT_RATE_HZ, new_record, start_motion, state_scales
from ..slots import (
    GROWTH,
    IMPACTS,
    LINE_P_IM,
    LINE_P_RE,
    LINE_X_IM,
    LINE_X_RE,
    MODE,
    MOST_STEPS,
    NEXT_SAMPLE,
    NOTHING,
    PEAK_P,
    PEAK_X,
    PEAKS,
    PEAKS_AND_LINES,
    SIDE,
    STEPS_LEFT,
    TANGENT_SIZE,
    no_tangent,
)
from ..stepping import advance_harmonic, harmonic_tables, new_state
from ._nominal_cost import nominal_cost_s


class ObservedQuantities(Enum):
    """What is observed of a stretch."""

    NOTHING = NOTHING
    PEAKS = PEAKS
    """Extremes of x and p."""
    PEAKS_AND_LINES = PEAKS_AND_LINES
    """Their components at the drive frequency as well."""


@dataclass(frozen=True)
class Samples:
    """States to keep: the first at an instant, the others at a rate."""

    first_s: float
    rate_hz: float
    count: int


@dataclass(frozen=True, eq=False)
class Stretch:
    """What was seen of a motion between two instants."""

    start_s: float
    end_s: float
    outcome: Outcome
    impacts: int
    """Contacts that began."""
    peak_x_m: float
    """Largest abs(x); zero where it was not watched."""
    peak_p_m: float
    area_x: complex
    """Integral of x exp(-i (omega t + phase)) [m s]; zero where it was not watched."""
    area_p: complex
    samples: Samples
    """Which states were kept."""
    states: Floats
    """They themselves, shape (n, 6)."""
    growth: float
    """Natural logarithm of how much a small change grew; NaN where no tangent was carried."""

    @property
    def length_s(self) -> float:
        """From its start to its end."""
        return self.end_s - self.start_s

    def thinned(self, every: int) -> "Stretch":
        """Give the same with every so manyth state alone."""
        first, rate_hz, count = self.samples.first_s, self.samples.rate_hz, self.samples.count
        kept = Samples(first + (every - 1) / rate_hz, rate_hz / every, count // every)
        return self if every == 1 else replace(self, samples=kept, states=self.states[every - 1 :: every])


class FollowedRun:
    """A specimen under way; its state is advanced in place.

    Raises ValueError when the specimen cannot be followed in time, or cannot begin so.
    """

    def __init__(
        self, specimen: Specimen, drive: Harmonic, tolerance: float, start: ArrayLike, time_s: float = 0.0
    ) -> None:
        self.specimen = specimen
        self.drive = drive
        self.outcome = Outcome.REACHED_END
        """Of all stretches so far."""
        self._tolerance = tolerance
        self._state = new_state(specimen, start_motion(start), Accuracy.REFERENCE)
        self._clock = clock_at(time_s)
        self._tables = harmonic_tables(specimen, drive)
        self._scales = state_scales(specimen, drive)
        self._metric = energy_metric(specimen)
        self._tangent = no_tangent()
        self._cost_s = 0.0
        self._steps_left = MOST_STEPS

    @property
    def tolerance(self) -> float:
        """Relative error allowed in a step of a contact."""
        return self._tolerance

    @property
    def cost_s(self) -> float:
        """What following it from its beginning has cost, by `nominal_cost_s`."""
        return self._cost_s

    @property
    def time_s(self) -> float:
        """Now."""
        return float(self._clock[0])

    @property
    def state(self) -> Floats:
        """X, y, z, vx, vy, vz now, shape (6,)."""
        return self._state[: len(self._scales)].copy()

    def apart(self, tolerance: float | None = None) -> Self:
        """Give the same motion, to be followed apart from this one, at a tolerance of its own if need be."""
        twin = copy(self)
        twin.__dict__.update(
            _state=self._state.copy(),
            _clock=self._clock.copy(),
            _tangent=no_tangent() if tolerance is not None else self._tangent.copy(),
            _tolerance=self._tolerance if tolerance is None else tolerance,
        )
        return twin

    def pass_over(self, drive_periods: int) -> None:
        """Let so many drive periods pass in which the motion comes back to its state."""
        advance_clock(self._clock, drive_periods / self.drive.frequency_hz)

    @property
    def periods(self) -> int | None:
        """Whole drive periods up to now; None between two."""
        whole = round(self.time_s * self.drive.frequency_hz)
        return whole if whole / self.drive.frequency_hz == self.time_s else None

    @property
    def is_in_flight(self) -> bool:
        """No stop is touched now."""
        return bool(self._state[SIDE] == 0.0)

    @property
    def flight(self) -> FlightTables:
        """Specimen and drive, as `follow_in_lanes` asks for them."""
        return self._tables.flight

    def take(self, found: LaneRun) -> Stretch:
        """Be where a lane has come to that began here, at a whole drive period."""
        periods = len(found.states)
        start_s, frequency_hz = self.time_s, self.drive.frequency_hz
        self._state = found.state
        self._clock = clock_at((round(start_s * frequency_hz) + periods) / frequency_hz)
        length_s = self.time_s - start_s
        self._cost_s += nominal_cost_s(self.specimen.contact, self._tolerance, length_s, found.impacts, 0, 0)
        samples = Samples(start_s + 1.0 / frequency_hz, frequency_hz, periods)
        return Stretch(
            start_s,
            self.time_s,
            self.outcome,
            found.impacts,
            0.0,
            0.0,
            0j,
            0j,
            samples,
            found.states,
            math.nan,
        )

    def follow_tangent(self) -> None:
        """Carry a small change along from now on, in no special direction."""
        self._tangent = np.zeros((1, TANGENT_SIZE))
        self._tangent[0, :GROWTH] = self._scales * np.linspace(1.0, 2.0, GROWTH)

    def drop_tangent(self) -> None:
        """Follow the states alone from now on."""
        self._tangent = no_tangent()

    def pushed(self, push: Floats) -> Self:
        """Give another motion, which begins now and a small change of the state, shape (6,), away."""
        twin = self.apart()
        state = new_state(self.specimen, start_motion(self.state + push), Accuracy.REFERENCE)
        twin.__dict__.update(_state=state)
        return twin

    def follow(
        self,
        until_s: float,
        observe: ObservedQuantities = ObservedQuantities.NOTHING,
        samples: Samples | None = None,
    ) -> Stretch:
        """Advance to an instant; a run that has failed stays where it is."""
        start_s, before = self.time_s, self._size()
        kept = Samples(start_s, 1.0, 0) if samples is None else samples
        record = new_record(start_s, until_s - start_s, None, MAX_IMPACT_RATE_HZ)._replace(
            start=kept.first_s,
            sample_rate=kept.rate_hz,
            samples=np.zeros((kept.count, GROWTH)),
            tangent=self._tangent,
        )
        record.counts[STEPS_LEFT] = self._steps_left
        observations = record.observations
        observations[MODE] = observe.value
        if self.outcome is Outcome.REACHED_END:
            code = advance_harmonic(self._state, self._clock, until_s, self._tables, self._tolerance, record)
            self.outcome = Outcome(code)
        if self.outcome is Outcome.REACHED_END:
            # Samples that rounding puts a hair beyond the end.
            record.samples[record.counts[NEXT_SAMPLE] :] = self._state[:GROWTH]
        made = self._steps_left - int(record.counts[STEPS_LEFT])
        self._steps_left -= made
        self._cost_s += nominal_cost_s(
            self.specimen.contact,
            self._tolerance,
            self.time_s - start_s,
            int(record.counts[IMPACTS]),
            len(self._tangent),
            made,
        )
        return Stretch(
            start_s=start_s,
            end_s=self.time_s,
            outcome=self.outcome,
            impacts=int(record.counts[IMPACTS]),
            peak_x_m=float(observations[PEAK_X]),
            peak_p_m=float(observations[PEAK_P]),
            area_x=complex(observations[LINE_X_RE], observations[LINE_X_IM]),
            area_p=complex(observations[LINE_P_RE], observations[LINE_P_IM]),
            samples=kept,
            states=record.samples,
            growth=self._size() - before,
        )

    def _size(self) -> float:
        """Natural logarithm of the small change, by its energy without stops; NaN where there is none.

        Only a stop can add to it: however fast a mode is over the drive, a change that it turns from
        displacement to velocity has not grown.
        """
        if len(self._tangent) == 0:
            return math.nan
        change = self._tangent[0, :GROWTH]
        return 0.5 * math.log(change @ self._metric @ change) + float(self._tangent[0, GROWTH])
