"""Exact mean voltage at the generator's terminal over consecutive intervals.

The output is a timeline of immutable signals, each valid from the time of its command. Signals are functions
of the generator's own time, so block sizes do not affect the samples.
"""

from bisect import bisect_right
from dataclasses import dataclass, field, replace
from enum import Enum, StrEnum

import numpy as np
from numpy.typing import NDArray

from .scpi_message import Codes

# The phase of a generator is steady or swept. Phases are in cycles, times in seconds of the generator's
# clock. Frequencies are integer microhertz, the instrument's resolution. Whole seconds therefore give an
# exact fraction of a cycle, and phases do not drift over hours (like a DDS accumulator without overflow).

Samples = NDArray[np.float64]

MICROHERTZ = 1e-6
UHZ_PER_HZ = 1_000_000
CURVATURE_TOLERANCE_CYCLES = 1e-6
"""Largest deviation of the phase from a straight line within a piece of an interval [cycles]."""
FINEST_SPLIT = 256
"""Maximum number of pieces per interval; only sweeps above about 1e9 Hz/s would need more."""
NO_TIMES: Samples = np.empty(0)


@dataclass(frozen=True)
class SteadyPhase:
    """Phase of a signal with constant frequency."""

    frequency_uhz: int
    offset: float
    """Phase at time zero [cycles, 0 <= offset < 1]."""

    @classmethod
    def with_phase(cls, frequency_uhz: int, phase: float, time_s: float) -> "SteadyPhase":
        """Return the phase as a function of time that has a given phase at a given time."""
        since_zero = cls(frequency_uhz, 0.0).phase(time_s)
        return cls(frequency_uhz, (phase - since_zero) % 1.0)

    def phase(self, time_s: float) -> float:
        """Return the phase at one instant, from 0 to below 1 [cycles]."""
        return float(self._fractions(np.asarray([time_s]))[0])

    def _fractions(self, time_s: Samples) -> Samples:
        whole = np.floor(time_s)
        exact = (self.frequency_uhz % UHZ_PER_HZ) * whole.astype(np.int64) % UHZ_PER_HZ
        within = self.frequency_uhz * MICROHERTZ * (time_s - whole)
        return _fraction(self.offset + exact * MICROHERTZ + within)

    def stretches(self, edges_s: Samples) -> tuple[Samples, Samples]:
        """Return start phase and phase increase of each interval between edges [cycles]."""
        return self._fractions(edges_s[:-1]), self.frequency_uhz * MICROHERTZ * np.diff(edges_s)

    def breakpoints(self, begin_s: float, end_s: float, interval_s: float) -> Samples:  # noqa: ARG002
        """Return no times, because the phase is linear in time."""
        return NO_TIMES


class Spacing(StrEnum):
    """Spacing of frequencies in a sweep."""

    LINEAR = "LINear"
    LOGARITHMIC = "LOGarithmic"


@dataclass(frozen=True)
class SweptPhase:
    """One triggered sweep and a hold at the stop frequency; the start frequency applies before and after."""

    start_hz: float
    stop_hz: float
    sweep_s: float
    hold_s: float
    spacing: Spacing
    begin_s: float
    """Time of the trigger [s]; ``math.inf`` while the sweep waits."""
    anchor_s: float
    offset: float
    """Phase at the time ``anchor_s`` [cycles]."""

    def phase(self, time_s: float) -> float:
        """Return the phase at one instant, from 0 to below 1 [cycles]."""
        return float(_fraction(self._cycles(np.asarray([time_s])))[0])

    def _cycles(self, time_s: Samples) -> Samples:
        before = self._since_zero(np.asarray([self.anchor_s]))[0]
        return np.asarray(self.offset + self._since_zero(time_s) - before)

    def _since_zero(self, time_s: Samples) -> Samples:
        after_s = np.maximum(time_s - self.begin_s, 0.0)
        swept = self._cycles_within(np.minimum(after_s, self.sweep_s))
        held_s = np.clip(after_s - self.sweep_s, 0.0, self.hold_s)
        back_s = np.maximum(after_s - self.sweep_s - self.hold_s, 0.0)
        waited_s = np.minimum(time_s, self.begin_s) + back_s
        return np.asarray(self.start_hz * waited_s + swept + self.stop_hz * held_s)

    def _cycles_within(self, time_s: Samples) -> Samples:
        """Return the integral of the frequency since the start of the sweep [cycles]."""
        if self.spacing is Spacing.LINEAR or self.start_hz == self.stop_hz:
            rate = (self.stop_hz - self.start_hz) / self.sweep_s
            return np.asarray(time_s * (self.start_hz + 0.5 * rate * time_s))
        growth = np.log(self.stop_hz / self.start_hz) / self.sweep_s
        return np.asarray(self.start_hz * np.expm1(growth * time_s) / growth)

    def stretches(self, edges_s: Samples) -> tuple[Samples, Samples]:
        """Return start phase and phase increase of each interval between edges [cycles]."""
        cycles = self._cycles(edges_s)
        return _fraction(cycles[:-1]), np.diff(cycles)

    def breakpoints(self, begin_s: float, end_s: float, interval_s: float) -> Samples:
        """Return start and end of sweep and hold, and times in the sweep where the phase is curved."""
        end_of_sweep_s = self.begin_s + self.sweep_s
        corners = np.array([self.begin_s, end_of_sweep_s, end_of_sweep_s + self.hold_s])
        corners = corners[(corners > begin_s) & (corners < end_s)]
        first_s, last_s = max(begin_s, self.begin_s), min(end_s, end_of_sweep_s)
        steepest = abs(self.stop_hz - self.start_hz) / self.sweep_s
        if self.spacing is Spacing.LOGARITHMIC:
            growth = abs(np.log(self.stop_hz / self.start_hz)) / self.sweep_s
            steepest = max(self.start_hz, self.stop_hz) * growth
        if first_s >= last_s or steepest * interval_s**2 <= 8 * CURVATURE_TOLERANCE_CYCLES:
            return corners
        step_s = max(np.sqrt(8 * CURVATURE_TOLERANCE_CYCLES / steepest), interval_s / FINEST_SPLIT)
        first = int(np.floor((first_s - self.begin_s) / step_s)) + 1
        last = int(np.ceil((last_s - self.begin_s) / step_s)) - 1
        times = self.begin_s + step_s * np.arange(first, last + 1)
        return np.concatenate((corners, times[(times > first_s) & (times < last_s)]))


PhaseCourse = SteadyPhase | SweptPhase


def _fraction(cycles: Samples) -> Samples:
    """Return the fractional part, strictly below one (a tiny negative number would round up to one)."""
    fraction = cycles - np.floor(cycles)
    return np.asarray(np.where(fraction >= 1.0, 0.0, fraction))


# Periodic shapes between -1 and 1, with their exact means over ``span`` >= 0 cycles that begin at phase
# ``start`` (0 <= start < 1). Over a span of 0, the mean is the value at ``start``.


@dataclass(frozen=True)
class Sine:
    """Sine: sin(2 pi phase)."""

    def mean(self, start: Samples, span: Samples) -> Samples:
        """Return the mean: the sine at the middle phase, multiplied by sinc(span)."""
        return np.asarray(np.sin(np.pi * (2 * start + span)) * np.sinc(span))


@dataclass(frozen=True)
class Rectangle:
    """Square wave: 1 for the fraction ``duty`` of the cycle, then -1."""

    duty: float = 0.5

    def mean(self, start: Samples, span: Samples) -> Samples:
        """Return the mean, computed from the part of the phase range in which the output is high."""
        end = start + span
        cycles = np.floor(end)
        high = cycles * self.duty + np.minimum(end - cycles, self.duty) - np.minimum(start, self.duty)
        stretch = end - start
        share = np.divide(high, stretch, out=np.zeros_like(stretch), where=stretch > 0)
        now = np.where(start < self.duty, 1.0, 0.0)
        return np.asarray(np.where(stretch > 0, 2 * np.clip(share, 0, 1) - 1, 2 * now - 1))


@dataclass(frozen=True)
class Triangle:
    """A ramp with 50 % symmetry: from 0 to 1 in a quarter of a cycle, then to -1, then to 0."""

    def mean(self, start: Samples, span: Samples) -> Samples:
        """Return the mean: the middle value if the phase range has no corner, else its integral / span."""
        begin = start + 0.25  # the phase is counted from the lowest point
        end = begin + span
        straight = np.floor(2 * begin) == np.floor(2 * end)
        middle = self._value(0.5 * (begin + end))
        area = self._integral(end) - self._integral(begin)
        return np.asarray(np.where(straight, middle, area / np.where(straight, 1.0, span)))

    @staticmethod
    def _value(phase: Samples) -> Samples:
        fraction = phase - np.floor(phase)
        return np.asarray(np.where(fraction < 0.5, 4 * fraction - 1, 3 - 4 * fraction))

    @staticmethod
    def _integral(phase: Samples) -> Samples:
        fraction = phase - np.floor(phase)
        rising = 2 * fraction**2 - fraction
        falling = 3 * fraction - 2 * fraction**2 - 1
        return np.asarray(np.where(fraction < 0.5, rising, falling))


@dataclass(frozen=True, eq=False)
class Table:
    """A waveform memory played with a zero-order hold: each point lasts 1/N of the cycle.

    Codes from 0 to ``top_code`` span -1..1. The integral is a cumulative sum of integers, so means are exact
    except for one rounding.
    """

    codes: Codes
    top_code: int
    _sums: NDArray[np.int64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        sums = np.concatenate(([0], np.cumsum(self.codes, dtype=np.int64)))
        object.__setattr__(self, "_sums", sums)

    def mean(self, start: Samples, span: Samples) -> Samples:
        """Return the mean of the staircase between two phases."""
        points = len(self.codes)
        begin = start * points
        end = begin + span * points
        first = np.floor(begin).astype(np.int64)
        last = np.floor(end).astype(np.int64)
        first_code = self.codes[first % points].astype(np.float64)
        last_code = self.codes[last % points].astype(np.float64)
        inside = self._sum(last) - self._sum(first + 1)
        area = (first + 1 - begin) * first_code + inside + (end - last) * last_code
        held = first == last
        mean_code = np.where(held, first_code, area / np.where(held, 1.0, end - begin))
        return np.asarray(2 * mean_code / self.top_code - 1)

    def _sum(self, points_passed: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the sum of all codes before a point, over any number of cycles."""
        cycles, rest = np.divmod(points_passed, len(self.codes))
        return np.asarray(cycles * self._sums[-1] + self._sums[rest])


PeriodicShape = Sine | Rectangle | Triangle | Table

OUTPUT_RESISTANCE_OHM = 50.0
NO_BLOCK = -1
NOISE_BLOCK = 4096
"""Number of noise samples per block; each block has its own seed."""
_CONTINUES = 1e-3
"""Largest gap between the end of one block and the start of the next, in intervals."""


class Relay(Enum):
    """State of the relay between the generator and its terminal."""

    OPEN = "open"
    CLOSED = "closed"


@dataclass(frozen=True)
class Burst:
    """Start and end of a burst; before and after it, the output stays at the level of the start phase."""

    begin_s: float
    end_s: float
    start_phase: float


@dataclass(frozen=True)
class Signal:
    """Open-circuit voltage from one command to the next, in the generator's own time."""

    relay: Relay = Relay.OPEN
    course: PhaseCourse = field(default_factory=lambda: SteadyPhase(0, 0.0))
    shape: PeriodicShape = field(default_factory=Sine)
    amplitude_vpp: float = 0.0
    """Amplitude, peak to peak, in open circuit [V]."""
    offset_v: float = 0.0
    burst: Burst | None = None

    def breakpoints(self, begin_s: float, end_s: float, interval_s: float) -> Samples:
        """Return the times within (begin, end) at which an interval must be divided to compute its mean."""
        times = self.course.breakpoints(begin_s, end_s, interval_s)
        if self.burst is None:
            return times
        ends = np.asarray([self.burst.begin_s, self.burst.end_s])
        return np.concatenate([times, ends[(ends > begin_s) & (ends < end_s)]])

    def means(self, edges_s: Samples) -> Samples:
        """Return the mean open-circuit voltage of every piece between edges."""
        start, span = self.course.stretches(edges_s)
        if self.burst is not None:
            middle = 0.5 * (edges_s[:-1] + edges_s[1:])
            runs = (middle >= self.burst.begin_s) & (middle < self.burst.end_s)
            start = np.where(runs, start, self.burst.start_phase)
            span = np.where(runs, span, 0.0)
        return self.offset_v + 0.5 * self.amplitude_vpp * self.shape.mean(start, span)


@dataclass(frozen=True)
class Terminal:
    """Properties of the output that no command changes."""

    load_ohm: float = 15e3
    """Actual load (``math.inf`` for none); by default the amplifier's input."""
    clock_error_ppm: float = 0.0
    """Error of the generator's clock relative to rig time [ppm]."""
    noise_v_per_rt_hz: float = 50e-9
    """One-sided noise density of the output (assumed; the data sheet gives no value)."""
    seed: int = 0
    clock_offset_s: float = 0.0
    """Total shift of the generator's clock since switch-on [s]."""

    @property
    def divider(self) -> float:
        """Ratio of the voltage at the terminal to the open-circuit voltage."""
        return 1 / (1 + OUTPUT_RESISTANCE_OHM / self.load_ohm)

    def own_time(self, time_s: Samples) -> Samples:
        """Return the time that the generator's clock shows at a rig time [s]."""
        return time_s + time_s * (self.clock_error_ppm * 1e-6) + self.clock_offset_s


class Timeline:
    """The signals of one output in time order, and their samples."""

    def __init__(self, terminal: Terminal, power_on: Signal) -> None:
        self.terminal = terminal
        self._since_s: list[float] = [-np.inf]
        self._signals: list[Signal] = [power_on]
        self._origin_s = 0.0
        self._interval_s = 0.0
        self._rendered = 0
        """Number of samples since ``_origin_s``, all for intervals of the same length."""
        self._noise_index = 0
        self._noise_block = NO_BLOCK, np.empty(0)
        self._end_s = -np.inf

    @property
    def latest(self) -> Signal:
        """The signal that the last command set."""
        return self._signals[-1]

    def jump(self, by_s: float) -> None:
        """Shift the generator's clock from the next rendered sample on."""
        self.terminal = replace(self.terminal, clock_offset_s=self.terminal.clock_offset_s + by_s)

    def effective(self, time_s: float) -> tuple[float, float]:
        """Return when a command sent at ``time_s`` takes effect, in rig time and in generator time [s].

        A command does not take effect before the end of the rendered part.
        """
        at_s = max(time_s, self._end_s, self._since_s[-1])
        return at_s, float(self.terminal.own_time(np.asarray(at_s)))

    def change(self, signal: Signal, time_s: float) -> None:
        """Start a signal at a rig time returned by ``effective``."""
        if time_s == self._since_s[-1]:
            self._signals[-1] = signal
        else:
            self._since_s.append(time_s)
            self._signals.append(signal)

    def render(self, start_s: float, interval_s: float, count: int) -> Samples:
        """Return the mean terminal voltage over ``count`` intervals from ``start_s``, shape (count,) [V]."""
        edges_s = self._edges(start_s, interval_s, count)
        volts = np.zeros(count)
        if count == 0:
            return volts
        noise = self._noise(count)
        # Remove the signals that ended before the first interval.
        ended = max(bisect_right(self._since_s, edges_s[0]) - 1, 0)
        del self._since_s[:ended], self._signals[:ended]
        until = [*self._since_s[1:], np.inf]
        for since_s, until_s, signal in zip(self._since_s, until, self._signals, strict=True):
            if since_s < edges_s[-1] and until_s > edges_s[0] and signal.relay is Relay.CLOSED:
                volts += self._contribution(signal, edges_s, (since_s, until_s), noise)
        self._end_s = float(edges_s[-1])
        return volts * self.terminal.divider

    def _edges(self, start_s: float, interval_s: float, count: int) -> Samples:
        """Return the edges of the intervals [s]; consecutive blocks share one time grid."""
        expected_s = self._origin_s + self._rendered * self._interval_s
        if interval_s != self._interval_s or abs(start_s - expected_s) > _CONTINUES * interval_s:
            self._origin_s, self._interval_s, self._rendered = start_s, interval_s, 0
        edges_s = self._origin_s + self._interval_s * np.arange(self._rendered, self._rendered + count + 1)
        self._rendered += count
        return np.asarray(edges_s, dtype=np.float64)

    def _contribution(
        self, signal: Signal, edges_s: Samples, valid: tuple[float, float], noise: Samples
    ) -> Samples:
        """Return the contribution of one signal to the mean of every interval (open circuit) [V]."""
        begin_s, end_s = max(valid[0], edges_s[0]), min(valid[1], edges_s[-1])
        first = max(bisect_right(edges_s, begin_s) - 1, 0)
        last = int(np.searchsorted(edges_s, end_s, side="left"))
        local = np.clip(edges_s[first : last + 1], begin_s, end_s)
        own = self.terminal.own_time(local)
        own_interval_s = self._interval_s * (1 + self.terminal.clock_error_ppm * 1e-6)
        cuts = signal.breakpoints(float(own[0]), float(own[-1]), own_interval_s)
        weights = np.diff(local) / self._interval_s
        means = signal.means(own) if len(cuts) == 0 else _mean_over_pieces(signal, own, cuts)
        volts = np.zeros(len(edges_s) - 1)
        # The rms noise of a mean is the density times the root of the bandwidth 1/(2 interval).
        rms_v = self.terminal.noise_v_per_rt_hz / np.sqrt(2 * self._interval_s)
        volts[first:last] = weights * means + np.sqrt(weights) * rms_v * noise[first:last]
        return volts

    def _noise(self, count: int) -> Samples:
        """Return noise of unit variance that depends only on the seed and the sample number."""
        begin, self._noise_index = self._noise_index, self._noise_index + count
        blocks = range(begin // NOISE_BLOCK, (self._noise_index - 1) // NOISE_BLOCK + 1)
        drawn = np.concatenate([self._draw(block) for block in blocks])
        skip = begin - blocks[0] * NOISE_BLOCK
        return drawn[skip : skip + count]

    def _draw(self, block: int) -> Samples:
        """Return a block of noise of unit variance; the last block is cached."""
        if self._noise_block[0] != block:
            generator = np.random.default_rng((self.terminal.seed, block))
            self._noise_block = block, generator.standard_normal(NOISE_BLOCK)
        return self._noise_block[1]


def _mean_over_pieces(signal: Signal, edges_s: Samples, cuts_s: Samples) -> Samples:
    """Return the interval means of a signal whose intervals must be divided."""
    times = np.unique(np.concatenate((edges_s, cuts_s)))
    durations = np.diff(times)
    interval = np.searchsorted(edges_s, times[:-1], side="right") - 1
    intervals = len(edges_s) - 1
    means = signal.means(times)
    pieces = np.bincount(interval, minlength=intervals)
    sums = np.bincount(interval, weights=durations * means, minlength=intervals)
    widths = np.bincount(interval, weights=durations, minlength=intervals)
    # Equal edges give empty intervals, which have no weight.
    result = np.divide(sums, widths, out=np.zeros_like(sums), where=widths > 0)
    whole = interval[pieces[interval] == 1]
    # An undivided interval must keep its mean to the last bit, even if other intervals are divided.
    result[whole] = means[pieces[interval] == 1]
    return np.asarray(result, dtype=np.float64)
