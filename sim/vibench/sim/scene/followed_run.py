"""Motion under a harmonic drive, integrated in stretches with different observations. SI units."""

import math
import sys
from collections import defaultdict
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, replace
from typing import Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ..engine.batch import BatchedMotion, follow_batch, is_batchable
from ..engine.run import (
    DIRECTIONS,
    MAX_IMPACT_RATE_HZ,
    MOST_STEPS,
    NativeRun,
    Outcome,
    RunRecord,
    Watch,
    most_impacts,
    start_motion,
)
from ..specimen.contact_laws import ContactLaw, PowerLaw
from ..specimen.drive import WHOLE, Harmonic
from ..specimen.specimen import Floats, Specimen, energy_metric

# Nominal cost of integrating a motion: the processor time on the machine of docs/accuracy.md [s]. Budgets use
# this cost instead of measured time: a scene with a budget then has the same result on every machine.

FLIGHT = 5e-5
"""Computing cost of one second of motion without contact [s]."""
CONTACTS: dict[str, tuple[float, float, float]] = {
    "hertz": (1.8e-6, 2.2, 5.0),
    "hunt_crossley": (4.5e-6, 2.0, 2.0),
    "linear_gap": (2e-6, 1.25, 1.0),
    "rigid": (9e-7, 1.3, 1.0),
    "power": (7e-9, 2.5, 1.0),
    "linear": (0.0, 1.0, 1.0),
}
"""Computing cost of an impact [s], or of a step of power laws; its factors with a tangent vector, and for
tolerances below `STRICT_TOLERANCE`."""
STRICT_TOLERANCE = 1e-8
STEP = 1e-9
"""Smallest computing cost of a step without contact [s]; matters for modes far faster than the paper's."""
SAMPLE_STEPS = 700
"""A stored state under a power law costs as much as this number of steps."""
TANGENT_STEPS = 4
"""A step with a tangent vector counts as this many steps toward the largest number of steps."""


def nominal_cost_s(
    run: NativeRun, contact: ContactLaw, length_s: float, impacts: int, steps: int = 0, samples: int = 0
) -> float:
    """Return the nominal computing cost of a stretch [s], from its numbers of events and tangent vectors."""
    each_s, tangent, strict = CONTACTS[contact.kind]
    count = steps + SAMPLE_STEPS * samples if isinstance(contact, PowerLaw) else impacts
    factor = (tangent if len(run.growth) else 1.0) * (strict if run.tolerance < STRICT_TOLERANCE else 1.0)
    by_motion_s = FLIGHT * length_s + each_s * count * factor
    return max(by_motion_s, STEP * steps)


@dataclass(frozen=True)
class Samples:
    """Times at which states are stored, given by first time, sample rate and number of times."""

    first_s: float
    rate_hz: float
    count: int


@dataclass(frozen=True, eq=False)
class Stretch:
    """Observations of a motion between two times."""

    start_s: float
    end_s: float
    outcome: Outcome
    impacts: int
    """Number of contacts that began in the stretch."""
    samples: Samples
    """Times of the stored states; see ``states``."""
    states: Floats
    """Stored states x, y, z, vx, vy, vz of the motion, shape (n, 6)."""
    peak_x_m: float = 0.0
    """Largest abs(x) in the stretch [m]; zero if not observed."""
    peak_p_m: float = 0.0
    area_x: complex = 0j
    """Integral of x exp(-i (omega t + phase)) over the stretch [m s]; zero if not observed."""
    area_p: complex = 0j
    growth: float = math.nan
    """Natural logarithm of the growth of the tangent vector; NaN without one."""

    @property
    def length_s(self) -> float:
        """Length of the stretch [s]."""
        return self.end_s - self.start_s

    def every_nth(self, every: int) -> "Stretch":
        """Return the stretch with only every ``every``-th stored state."""
        first, rate_hz, count = self.samples.first_s, self.samples.rate_hz, self.samples.count
        kept = Samples(first + (every - 1) / rate_hz, rate_hz / every, count // every)
        return self if every == 1 else replace(self, samples=kept, states=self.states[every - 1 :: every])


class FollowedRun(NativeRun):
    """Motion of a specimen, integrated step by step from a start (initial state).

    Raises ValueError when the specimen cannot be simulated from this start.
    """

    def __init__(self, specimen: Specimen, drive: Harmonic, tolerance: float, start: ArrayLike) -> None:
        super().__init__(specimen, drive, start, tolerance)
        self.drive = drive
        self.outcome = Outcome.REACHED_END
        """Outcome of the last integrated stretch."""
        self.scales = np.repeat([1.0, 2.0 * math.pi * drive.frequency_hz], 3)
        """Scale of each coordinate, shape (6,): 1 for displacements, 2 pi f for velocities."""
        self._metric = energy_metric(specimen)
        self.cost_s = 0.0
        """Nominal computing cost since the start of the run [s]; see `nominal_cost_s`."""
        self._steps_left = MOST_STEPS
        self.tries = 0
        """Number of successive calls of `follow_together` that ended in contact, at most `TRIES`."""

    def place(self, motion: ArrayLike) -> None:
        """Set the current state, shape (6,); raise ValueError if this state is not allowed."""
        super().place(start_motion(motion))

    @property
    def periods(self) -> int | None:
        """Number of drive periods since time zero; None between two whole periods."""
        whole = round(self.time_s * self.drive.frequency_hz)
        return whole if whole / self.drive.frequency_hz == self.time_s else None

    def batch_periods(self, until_s: float) -> int:
        """Return the number of drive periods until a time [s]; 0 or less if no batch can integrate them."""
        end = until_s * self.drive.frequency_hz
        is_ready = self.outcome is Outcome.REACHED_END and self.is_in_flight and self.periods is not None
        is_ready = is_ready and abs(end - round(end)) <= WHOLE * end
        is_ready = is_ready and is_batchable(self.specimen, self.tolerance)
        return round(end) - (self.periods or 0) if is_ready else 0

    def _batch_stretch(self, start_s: float, before: float, motion: BatchedMotion) -> Stretch:
        """Return the stretch that a batch integrated from ``start_s``, when `_size` was ``before``."""
        length_s, frequency_hz, count = self.time_s - start_s, self.drive.frequency_hz, len(motion.states)
        self.cost_s += nominal_cost_s(self, self.specimen.contact, length_s, motion.impacts)
        samples = Samples(start_s + 1.0 / frequency_hz, frequency_hz, count)
        return Stretch(
            *(start_s, self.time_s, self.outcome, motion.impacts, samples, motion.states),
            *(motion.peak_x_m, motion.peak_p_m, motion.area_x, motion.area_p, self._size() - before),
        )

    def follow_tangent(self) -> None:
        """Propagate a tangent vector, in a direction without symmetry, from now on."""
        scales = min(self.specimen.gaps_m) * self.scales
        self.carry((scales * np.linspace(1.0, 2.0, DIRECTIONS))[None])

    def drop_tangent(self) -> None:
        """Propagate no tangent vector from now on."""
        self.carry(np.empty((0, DIRECTIONS)))

    def with_push(self, push: Floats) -> Self:
        """Return a copy of the motion whose current state is changed by ``push``, shape (6,)."""
        twin = self.copy()
        twin.place(self.motion + push)
        return twin

    def follow(
        self,
        until_s: float,
        observe: Watch = Watch.NOTHING,
        samples: Samples | None = None,
    ) -> Stretch:
        """Integrate to a time [s] and return the stretch; a run that has failed is not advanced."""
        start_s, before = self.time_s, self._size()
        kept = Samples(start_s, 1.0, 0) if samples is None else samples
        counts_as = TANGENT_STEPS if len(self.growth) else 1
        steps = self._steps_left // counts_as
        record = RunRecord(
            most_impacts(MAX_IMPACT_RATE_HZ, until_s - start_s),
            start_s=kept.first_s,
            sample_rate_hz=kept.rate_hz,
            samples=kept.count,
            steps=steps,
        )
        record.watch(observe)
        if self.outcome is Outcome.REACHED_END:
            self.outcome = self.advance(until_s, record)
        made = steps - record.steps_left
        self._steps_left -= counts_as * made
        self.cost_s += nominal_cost_s(
            self, self.specimen.contact, self.time_s - start_s, record.impacts, made, kept.count
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
            # Because of rounding, the last samples may lie just after the end of the stretch.
            states=record.all_samples(self.motion if self.outcome is Outcome.REACHED_END else 0.0),
            growth=self._size() - before,
        )

    def image(self, drive_periods: int) -> tuple[Floats, Floats]:
        """Return the state `drive_periods` later and its Jacobian, (6,) and (6, 6); NaN if the run fails."""
        made = self.time_s * self.drive.frequency_hz if self.periods is None else self.periods
        until_s = (made + drive_periods) / self.drive.frequency_hz
        steps = self._steps_left // TANGENT_STEPS
        record = RunRecord(most_impacts(MAX_IMPACT_RATE_HZ, until_s - self.time_s), steps=steps)
        image = self.copy().advance_with_jacobian(until_s, record)
        self._steps_left -= TANGENT_STEPS * (steps - record.steps_left)
        return image

    def _size(self) -> float:
        """Return the natural logarithm of the norm of the tangent vector; NaN without one.

        The norm is the square root of the vector's energy in the linear system. Only contact can increase
        this energy. An exchange between displacement and velocity therefore does not count as growth.
        """
        if len(self.growth) == 0:
            return math.nan
        change = self.changes[0]
        # With strong damping, the energy may be below the smallest float.
        energy = max(change @ self._metric @ change, sys.float_info.min)
        return 0.5 * math.log(energy) + float(self.growth[0])


TRIES = 8
"""Largest number of drive periods to wait until one ends without contact, so that a batch can begin."""


def follow_together(
    runs: Sequence[FollowedRun], periods: Sequence[int], observe: Watch = Watch.NOTHING
) -> list[Stretch]:
    """Integrate motions of one specimen from the end of a drive period, and store a state per period.

    The motions advance by ``periods`` in a batch, without tangent vector. A motion in contact is first
    integrated alone for a period. After `TRIES` contacts, or if the batch fails, it is integrated alone.
    """
    flying = [place for place, run in enumerate(runs) if run.is_in_flight and run.tries < TRIES]
    batched = _batch([runs[place] for place in flying], [periods[place] for place in flying], observe)
    found: dict[int, Stretch] = {}
    for place, stretch in zip(flying, batched, strict=True):
        if stretch is None:
            runs[place].tries = TRIES
        else:
            found[place] = stretch
    for place, run in enumerate(runs):
        if place not in found:
            count = 1 if run.tries < TRIES else periods[place]
            end_s = (round(run.time_s * run.drive.frequency_hz) + count) / run.drive.frequency_hz
            found[place] = follow_with_section(run, end_s, observe)
        if run.tries < TRIES:
            run.tries = 0 if run.is_in_flight else run.tries + 1
    return [found[place] for place in range(len(runs))]


def _batch(runs: Sequence[FollowedRun], periods: Sequence[int], observe: Watch) -> list[Stretch | None]:
    """Integrate motions of one specimen in flight in a batch; None for a failed motion."""
    begun = [(run.time_s, run._size()) for run in runs]  # noqa: SLF001 - of the same file
    motions = follow_batch(runs, periods, observe) if runs else []
    return [
        None if motion is None else run._batch_stretch(*start, motion)  # noqa: SLF001
        for run, start, motion in zip(runs, begun, motions, strict=True)
    ]


Found = TypeVar("Found")
Steps = Generator[tuple[float, Watch], Stretch, Found]
"""Evaluation of a motion that asks for stretches, by end time [s] and observed quantities, one at a time."""


def take_steps(run: FollowedRun, steps: Steps[Found]) -> Found:
    """Return the result of an evaluation whose stretches are integrated alone."""
    return take_steps_of_all([run], [steps], are_batched=False)[0]


def take_steps_of_all(
    runs: Sequence[FollowedRun], steps: Sequence[Steps[Found]], *, are_batched: bool
) -> list[Found]:
    """Return the results of evaluations whose stretches are integrated alone, or in batches if possible."""
    found: dict[int, Found] = {}
    stretches: dict[int, Stretch | None] = dict.fromkeys(range(len(runs)))
    while stretches:
        asked: dict[int, tuple[float, Watch]] = {}
        for place, stretch in stretches.items():
            try:
                asked[place] = steps[place].send(stretch)  # type: ignore[arg-type]
            except StopIteration as end:
                found[place] = end.value
        alike = defaultdict[tuple[Specimen, float, Watch], dict[int, int]](dict)
        for place, (until_s, watch) in asked.items():
            run = runs[place]
            if are_batched and (periods := run.batch_periods(until_s)) > 0:
                alike[run.specimen, run.tolerance, watch][place] = periods
        stretches = {}
        for (_, _, watch), group in alike.items():
            batched = _batch([runs[place] for place in group], [*group.values()], watch)
            stretches |= zip(group, batched, strict=True)
        for place, (until_s, watch) in asked.items():
            if stretches.get(place) is None:
                stretches[place] = follow_with_section(runs[place], until_s, watch)
    return [found[place] for place in range(len(runs))]


BLOCKS = 10
"""Number of blocks of a window, from which the scatter of Response I is estimated."""
FIRST, LAST = 2, 3
"""Number of first and last blocks of a window in which growth is measured, to prove that chaos lasts. They
cover both halves of the observed time, with or without a stretch before the window."""


@dataclass(frozen=True)
class Block:
    """Peaks and spectral lines of a part of a motion with whole drive periods."""

    peak_x_m: float
    """Largest abs(x) in this part of the motion [m]."""
    peak_p_m: float
    line_x_m: complex
    """Phasor of x at the drive frequency, x = Re(line_x_m * exp(i (omega t + phase))) [m]."""
    line_p_m: complex


@dataclass(frozen=True, eq=False)
class ObservedWindow:
    """Observations of a motion in a window. SI units."""

    begins: FollowedRun
    """State of the run at the start of the window."""
    stretches: tuple[Stretch, ...]
    """Consecutive stretches of which the window consists."""
    blocks: tuple[Block, ...]
    """Blocks of the window; their lengths differ by at most one drive period."""
    line_periods: int
    """Number of drive periods at the end of the window over which spectral lines are computed: as many whole
    periods of the motion as fit."""
    line_x_m: complex
    """Phasor of x at the drive frequency, x = Re(line_x_m * exp(i (omega t + phase))) [m]."""
    line_p_m: complex

    @property
    def length_s(self) -> float:
        """Length of the window [s]."""
        return self.stretches[-1].end_s - self.stretches[0].start_s

    @property
    def largest_x_m(self) -> float:
        """Largest abs(x) in the window [m]."""
        return max(stretch.peak_x_m for stretch in self.stretches)

    @property
    def largest_p_m(self) -> float:
        """Largest abs(p) in the window [m]."""
        return max(stretch.peak_p_m for stretch in self.stretches)

    @property
    def responses_m(self) -> Floats:
        """Largest abs(x) and amplitude of x at the drive frequency, then both for p, shape (4,) [m]."""
        return np.array([self.largest_x_m, abs(self.line_x_m), self.largest_p_m, abs(self.line_p_m)])

    @property
    def impacts(self) -> int:
        """Number of contacts that began in the window."""
        return sum(stretch.impacts for stretch in self.stretches)


def whole_periods(duration_s: float, frequency_hz: float) -> int:
    """Return the number of whole drive periods in a duration."""
    return math.floor(duration_s * frequency_hz * (1.0 + WHOLE))


def samples_between(rate_hz: float, start_s: float, end_s: float) -> Samples:
    """Return the multiples of 1 / ``rate_hz`` after ``start_s`` and up to ``end_s`` as sample times."""
    first, last = (math.floor(time_s * rate_hz * (1.0 + WHOLE) + WHOLE) for time_s in (start_s, end_s))
    return Samples((first + 1) / rate_hz, rate_hz, max(0, last - first))


def follow_with_section(run: FollowedRun, until_s: float, observe: Watch = Watch.NOTHING) -> Stretch:
    """Integrate a motion to a time [s], and store its state once per drive period."""
    end_s = max(until_s, run.time_s)
    return run.follow(end_s, observe, samples_between(run.drive.frequency_hz, run.time_s, end_s))


def observe_window(run: FollowedRun, window_s: float, cycle: int = 1) -> ObservedWindow:
    """Observe a motion alone in a window that begins now; see `window_steps`."""
    return take_steps(run, window_steps(run, window_s, cycle))


def window_steps(
    run: FollowedRun,
    window_s: float,
    cycle: int = 1,
    is_chaos: Callable[[Sequence[Stretch]], bool] | None = None,
) -> Steps[ObservedWindow]:
    """Observe a motion in a window that begins now and contains at least one drive period.

    If the motion repeats after ``cycle`` drive periods and the window is long enough, lines are computed over
    a multiple of ``cycle``, which avoids leakage. If ``is_chaos`` returns True for the first parts, the
    tangent vector is propagated only at both ends of the window.
    """
    begins, start_s, frequency = run.copy(), run.time_s, run.drive.frequency_hz
    end_s = start_s + window_s
    periods = whole_periods(window_s, frequency)
    periods = cycle * (periods // cycle) or periods
    line_s = max(end_s - periods / frequency, start_s)
    count = min(BLOCKS, periods)
    edges = [end_s - (periods * (count - k) // count) / frequency for k in range(1, count)] + [end_s]
    head = [(yield line_s, Watch.PEAKS)] if run.time_s < line_s else []
    parts: list[Stretch] = []
    for edge in edges:
        if is_chaos is not None and count == BLOCKS:
            if len(parts) == FIRST and is_chaos(parts):
                run.drop_tangent()
            elif len(parts) == BLOCKS - LAST and math.isnan(parts[-1].growth):
                run.follow_tangent()
        parts.append((yield edge, Watch.PEAKS_AND_LINES))
    return window_of(begins, parts, head)


def window_of(begins: FollowedRun, parts: Sequence[Stretch], head: Sequence[Stretch] = ()) -> ObservedWindow:
    """Return a window of ``parts`` of whole drive periods; the preceding ``head`` only adds peak values."""
    frequency = begins.drive.frequency_hz
    periods = round(sum(part.length_s for part in parts) * frequency)
    scale = 2.0 * frequency / max(periods, 1)
    return ObservedWindow(
        begins=begins,
        stretches=(*head, *parts),
        blocks=blocks_of(parts),
        line_periods=periods,
        line_x_m=scale * sum(part.area_x for part in parts),
        line_p_m=scale * sum(part.area_p for part in parts),
    )


def blocks_of(parts: Sequence[Stretch]) -> tuple[Block, ...]:
    """Return peaks and spectral lines of each part; a line is 2 / T times the integral of the `Stretch`."""
    return tuple(
        Block(
            part.peak_x_m,
            part.peak_p_m,
            2.0 * part.area_x / part.length_s,
            2.0 * part.area_p / part.length_s,
        )
        for part in parts
        if part.peak_x_m > 0.0 and part.length_s > 0.0
    )


def states_of(stretches: Sequence[Stretch]) -> Floats:
    """Return all stored states of consecutive stretches, shape (n, 6)."""
    return np.concatenate([np.empty((0, 6)), *(stretch.states for stretch in stretches)])


LEAST_RATE_HZ = 20_000.0
"""Lowest sample rate of a spectrum [1/s]: ten times the contact rate, as contact pulses hardly move m0."""
HIGHEST = 0.25
"""Ratio of the spectrum's highest frequency to the sample rate; m0 attenuates aliases in this range."""


@dataclass(frozen=True, eq=False)
class LineSpectrum:
    """Amplitude spectrum of x without taper, exact at multiples of the drive frequency."""

    frequency_hz: Floats
    """Frequencies of the spectral lines, shape (lines,) [Hz]."""
    amplitude_m: Floats
    """Amplitude of x at each frequency, shape (lines,) [m]."""


def spectrum_of(window: ObservedWindow) -> LineSpectrum:
    """Integrate a window again, with samples, and return the spectrum over the window's whole periods.

    Sampling does not change the motion: both runs agree to the last digit, even in chaos.
    """
    run, periods = window.begins.copy(), window.line_periods
    frequency = run.drive.frequency_hz
    per_period = math.ceil(LEAST_RATE_HZ / frequency)
    rate, count = per_period * frequency, per_period * periods
    followed = [
        run.follow(stretch.end_s, samples=samples_between(rate, stretch.start_s, stretch.end_s))
        for stretch in window.stretches
    ]
    states = states_of(followed)[-count:]
    amplitudes = np.abs(np.fft.rfft(states[:, 0])) * 2.0 / count
    amplitudes[0] *= 0.5
    frequencies = np.arange(len(amplitudes), dtype=np.float64) * (frequency / periods)
    is_kept = frequencies <= HIGHEST * rate
    return LineSpectrum(frequencies[is_kept], amplitudes[is_kept])
