"""A motion under a harmonic drive, followed stretch by stretch, each watched in its own way. SI units."""

import math
import sys
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from ..engine.batch import BatchedMotion, follow_batch
from ..engine.run import DIRECTIONS, MOST_STEPS, NativeRun, RunRecord, Watch, most_impacts
from ..exponents.tangent_run import energy_metric
from ..model.arrays import Floats
from ..model.drive import Harmonic
from ..model.outcome import Outcome
from ..model.specimen import Specimen
from ..motion.integrate import MAX_IMPACT_RATE_HZ, start_motion
from ..motion.poincare import state_scales
from .nominal_cost import nominal_cost_s


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
        self._run = NativeRun(specimen, drive, start_motion(start), tolerance, start_time_s=time_s)
        self._scales = state_scales(specimen, drive)
        self._metric = energy_metric(specimen)
        self._cost_s = 0.0
        self._steps_left = MOST_STEPS

    @property
    def tolerance(self) -> float:
        """Relative error allowed in a step of a contact."""
        return self._run.tolerance

    @property
    def cost_s(self) -> float:
        """What following it from its beginning has cost, by `nominal_cost_s`."""
        return self._cost_s

    @property
    def time_s(self) -> float:
        """Now."""
        return self._run.time_s

    @property
    def state(self) -> Floats:
        """X, y, z, vx, vy, vz now, shape (6,)."""
        return self._run.motion

    def apart(self, tolerance: float | None = None) -> Self:
        """Give the same motion, to be followed apart from this one, at a tolerance of its own if need be."""
        twin = copy(self)
        twin.__dict__.update(_run=self._run.apart(tolerance))
        return twin

    def pass_over(self, drive_periods: int) -> None:
        """Let so many drive periods pass in which the motion comes back to its state."""
        self._run.pass_over(drive_periods / self.drive.frequency_hz)

    @property
    def periods(self) -> int | None:
        """Whole drive periods up to now; None between two."""
        whole = round(self.time_s * self.drive.frequency_hz)
        return whole if whole / self.drive.frequency_hz == self.time_s else None

    @property
    def is_in_flight(self) -> bool:
        """No stop is touched now."""
        return self._run.is_in_flight

    def _batched(self, start_s: float, motion: BatchedMotion) -> Stretch:
        """Return the stretch from an instant until now, which was followed in a batch."""
        length_s, frequency_hz, count = self.time_s - start_s, self.drive.frequency_hz, len(motion.states)
        self._cost_s += nominal_cost_s(self.specimen.contact, self.tolerance, length_s, motion.impacts, 0, 0)
        return Stretch(
            start_s=start_s,
            end_s=self.time_s,
            outcome=self.outcome,
            impacts=motion.impacts,
            peak_x_m=0.0,
            peak_p_m=0.0,
            area_x=0j,
            area_p=0j,
            samples=Samples(start_s + 1.0 / frequency_hz, frequency_hz, count),
            states=motion.states,
            growth=math.nan,
        )

    def follow_tangent(self) -> None:
        """Carry a small change along from now on, in no special direction."""
        self._run.carry((self._scales * np.linspace(1.0, 2.0, DIRECTIONS))[None])

    def drop_tangent(self) -> None:
        """Follow the states alone from now on."""
        self._run.carry(np.empty((0, DIRECTIONS)))

    def pushed(self, push: Floats) -> Self:
        """Give another motion, which begins now and a small change of the state, shape (6,), away."""
        twin, run = self.apart(), self._run.apart()
        run.place(start_motion(self.state + push))
        twin.__dict__.update(_run=run)
        return twin

    def follow(
        self,
        until_s: float,
        observe: Watch = Watch.NOTHING,
        samples: Samples | None = None,
    ) -> Stretch:
        """Advance to an instant; a run that has failed stays where it is."""
        start_s, before = self.time_s, self._size()
        kept = Samples(start_s, 1.0, 0) if samples is None else samples
        record = RunRecord(
            most_impacts(MAX_IMPACT_RATE_HZ, until_s - start_s),
            start_s=kept.first_s,
            sample_rate_hz=kept.rate_hz,
            samples=kept.count,
            steps=self._steps_left,
        )
        record.watch(observe)
        if self.outcome is Outcome.REACHED_END:
            self.outcome = self._run.advance(until_s, record)
        made = self._steps_left - record.steps_left
        self._steps_left -= made
        self._cost_s += nominal_cost_s(
            self.specimen.contact,
            self.tolerance,
            self.time_s - start_s,
            record.impacts,
            len(self._run.growth),
            made,
        )
        return Stretch(
            start_s=start_s,
            end_s=self.time_s,
            outcome=self.outcome,
            impacts=record.impacts,
            peak_x_m=record.peak_x_m,
            peak_p_m=record.peak_p_m,
            area_x=record.area_x,
            area_p=record.area_p,
            samples=kept,
            # Samples that rounding puts a hair beyond the end.
            states=record.all_samples(self.state if self.outcome is Outcome.REACHED_END else 0.0),
            growth=self._size() - before,
        )

    def _size(self) -> float:
        """Natural logarithm of the small change, by its energy without stops; NaN where there is none.

        Only a stop can add to it: however fast a mode is over the drive, a change that it turns from
        displacement to velocity has not grown.
        """
        if len(self._run.growth) == 0:
            return math.nan
        change = self._run.changes[0]
        # Strong damping may shrink it below the smallest number.
        energy = max(change @ self._metric @ change, sys.float_info.min)
        return 0.5 * math.log(energy) + float(self._run.growth[0])


def follow_together(runs: Sequence[FollowedRun], periods: Sequence[int]) -> list[Stretch | None]:
    """Follow motions of one specimen in a batch, each for whole drive periods, by their states alone.

    None for one that was lost, which is where it was.
    """
    starts_s = [run.time_s for run in runs]
    found = follow_batch([run._run for run in runs], periods)  # noqa: SLF001 - of the same file
    return [
        None if motion is None else run._batched(start_s, motion)  # noqa: SLF001
        for run, start_s, motion in zip(runs, starts_s, found, strict=True)
    ]
