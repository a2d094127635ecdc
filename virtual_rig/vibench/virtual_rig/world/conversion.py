"""Conversion of the world's signals to quantised samples, over the cables to the converter's inputs."""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum, IntEnum, StrEnum
from math import ceil, floor

import numpy as np
from numpy.typing import NDArray

from vibench.acquisition.rig import Rig, Role
from vibench.sim.engine.library import Structure
from vibench.sim.engine.run import native_engine

from .sensors import IEPE_BIAS_V, NoiseStream
from .time_grid import USUAL_GRID, FloatArray, RecursiveFilter, TimeGrid

SECOND_DEVICE = "Dev1"
"""Second converter of the virtual system; T-pieces connect it to the same cables."""


class Signal(IntEnum):
    """Rows of the world's signals; rows of further sensors follow in the order of the configuration."""

    DRIVE = 0
    AMPLIFIER = 1
    BASE_ACCELERATION = 2
    M0_VELOCITY = 3


class Coupling(StrEnum):
    """Coupling of a converter's input."""

    AC = "AC"
    DC = "DC"


@dataclass(frozen=True)
class Input:
    """Configuration of one converter input in a task."""

    physical_channel: str
    """Name of the input at the converter (``"cDAQ1Mod1/ai0"``), which the wiring maps to a signal."""
    range_v: float
    """Full scale of the input, plus and minus [V]."""
    coupling: Coupling
    iepe_current_a: float = 0.0
    """Excitation current of an IEPE sensor [A]; IEPE sensors give no signal without this current."""


class Behind(Enum):
    """Source at the far end of a cable."""

    VOLTAGE_SOURCE = "voltage source"
    IEPE_SENSOR = "IEPE sensor"
    NOTHING = "nothing"


@dataclass(frozen=True)
class Cable:
    """Connection of one input of the converter."""

    behind: Behind
    signal: int = Signal.DRIVE
    attenuation: float = 1.0
    """Ratio of the voltage at the source to the voltage at the converter's input."""
    delay_steps: float = 0.0


OPEN_INPUT = Cable(Behind.NOTHING)


def signal_rows(rig: Rig) -> dict[Role, int]:
    """Return the row of the world's signals for each role of a rig."""
    fixed = (Role.DRIVE_VOLTAGE, Role.AMPLIFIER_VOLTAGE, Role.BASE_ACCELERATION, Role.M0_VELOCITY)
    return {role: row for row, role in enumerate((*fixed, *rig.sensors))}


def cables_of(rig: Rig, delay_steps: Mapping[Role, float]) -> dict[str, Cable]:
    """Return the cable of each connected input by its name, such as ``"cDAQ1Mod1/ai0"``."""
    rows = signal_rows(rig)
    return {
        f"{device}/{channel.physical}": Cable(
            behind=_source(rig, channel.role),
            signal=rows[channel.role],
            attenuation=channel.attenuation,
            delay_steps=delay_steps.get(channel.role, 0.0),
        )
        for device in (rig.daq.device, SECOND_DEVICE)
        for channel in rig.daq.channels
    }


def _source(rig: Rig, role: Role) -> Behind:
    sensor = rig.sensor(role)
    return Behind.IEPE_SENSOR if sensor is not None and sensor.iepe == "yes" else Behind.VOLTAGE_SOURCE


# The converter's anti-alias filter computes samples at any lower rate from means over the world's steps. A
# linear-phase windowed sinc (Kaiser window) limits the band and corrects the droop of the means. For an
# integer ratio of rates, one set of weights is used; for other ratios, weights are interpolated between rows
# of a table. A sensor's delay shifts the sample times exactly, even between grid points.

GROUP_DELAY_SAMPLES = 40
"""Common delay of all channels, in output samples: typical of a delta-sigma converter."""

_HALF_WIDTH_SAMPLES = 32
"""Half width of the filter: pass band up to 0.45, and -100 dB from 0.55 of the sample rate."""
_STOP_BAND_DB = 100.0
_KAISER_BETA = 0.1102 * (_STOP_BAND_DB - 8.7)
"""Window parameter by Kaiser (1974); Oppenheim and Schafer, Discrete-Time Signal Processing, eq. 7.75."""

_DROOP_REACH = 3
"""Number of grid points on each side of a step that the droop correction uses."""
_DROOP_BAND = 0.23
"""Upper end of the fit of the droop correction, in cycles per step."""
_DROOP_FIT_POINTS = 200

_PHASES_PER_SAMPLE = 512
"""Number of table rows per output sample. The error of linear interpolation is 110 dB below the signal."""
_LANES = 8
"""Number of weights per SIMD operation of the native engine."""

EARLIEST_STEPS = -4.0
"""Smallest delay of a channel for which the filter needs no future means [steps]; negative for a lead."""


class Decimator:
    """Filter that computes samples of one channel from means over the world's steps."""

    def __init__(self, ratio: float, start_step: int, delay_steps: float) -> None:
        """Create a filter with ``ratio`` steps per sample; integer ratios are faster.

        ``delay_steps`` is the part of the sensor's delay that the means do not include yet.
        """
        self._ratio = ratio
        self._delay_steps = max(delay_steps, EARLIEST_STEPS)
        centre = self._centre(0)
        if ratio == round(ratio):
            fractions = np.array([centre - floor(centre)])
        else:
            rows = ceil(_PHASES_PER_SAMPLE / max(ratio, 1.0))
            fractions = np.arange(rows + 1) / rows
        table = _weights(ratio, fractions)
        self.reach = int(table.shape[1])
        """Number of filter weights per sample."""
        self._oldest = start_step + _half_width_steps(ratio) + 2 - self.reach
        self._work: Structure = native_engine().new(
            "Decimation", table=table, reach=self.reach, ratio=ratio, begin=self._centre(-1)
        )

    def _centre(self, sample: int) -> float:
        """Return the position of a sample in steps, relative to the middle of the first mean."""
        group_delay = GROUP_DELAY_SAMPLES * max(self._ratio, 1.0)
        return (sample + 1) * self._ratio - group_delay - self._delay_steps - 0.5

    def first_step(self, sample: int) -> int:
        """Return the number of the oldest step that a sample needs."""
        return self._oldest + floor(self._centre(sample))

    def convert(self, means: FloatArray, means_first_step: int, sample: int, count: int) -> FloatArray:
        """Return ``count`` samples from number ``sample`` on, shape (count,), from means."""
        engine, samples = native_engine(), np.empty(count)
        origin = self._oldest - means_first_step
        engine.fill(self._work, means=means, origin=origin, first=sample, samples=samples)
        engine.call("decimate", self._work)
        return samples


def history_steps(ratio: float, delay_steps: float) -> int:
    """Return how many steps from before the start of a conversion the first sample needs."""
    filter_span = GROUP_DELAY_SAMPLES * max(ratio, 1.0) + _half_width_steps(ratio)
    return ceil(filter_span + max(delay_steps, 0.0)) + 2 * _LANES


def _half_width_steps(ratio: float) -> int:
    return ceil(_HALF_WIDTH_SAMPLES * max(ratio, 1.0)) + _DROOP_REACH


def _weights(ratio: float, fractions: FloatArray) -> FloatArray:
    """Return weights, oldest first, one row for each delay of a sample relative to a grid point [steps].

    All rows are computed at once, because a run waits while a conversion starts.
    """
    newest = _half_width_steps(ratio) + 1
    count = ceil(2 * newest / _LANES) * _LANES
    positions = newest - np.arange(count - 1, -1, -1.0) - fractions[:, np.newaxis]
    # Symmetric weights that invert sin(pi f)/(pi f), which is the gain of a mean over one step.
    frequency = np.linspace(0, _DROOP_BAND, _DROOP_FIT_POINTS)
    cosines = [np.ones_like(frequency)]
    cosines += [2 * np.cos(2 * np.pi * order * frequency) for order in range(1, _DROOP_REACH + 1)]
    matrix = np.array(cosines).T
    half, *_ = np.linalg.lstsq(matrix * np.sinc(frequency)[:, np.newaxis], np.ones_like(frequency))
    correction = np.concatenate([half[:0:-1], half])
    weights = np.zeros_like(positions)
    for shift, weight in zip(range(-_DROOP_REACH, _DROOP_REACH + 1), correction, strict=True):
        weights += weight * _windowed_sinc(positions - shift, ratio)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def _windowed_sinc(positions: FloatArray, ratio: float) -> FloatArray:
    samples = positions / max(ratio, 1.0)
    inside = np.clip(1 - (samples / _HALF_WIDTH_SAMPLES) ** 2, 0, None)
    window = np.where(inside > 0, np.i0(_KAISER_BETA * np.sqrt(inside)), 0.0)
    return np.asarray(np.sinc(samples) * window)


AC_CUT_HZ = 0.5
"""-3 dB frequency of the AC coupling of NI 9234 and USB-4431, modelled as first order."""
LEAST_EXCITATION_A = 1e-3
"""Smallest current at which an IEPE sensor works."""
SOURCE_OHM = 50.0
"""Output resistance of generator, divider and decoder [ohm]; excitation currents cause a voltage drop."""
COMPLIANCE_V = 19.0
"""Voltage of an open input with excitation [V]."""
OVER_RANGE = 1.02
"""Level at which the modulator clips, relative to the range; counts are limited to the range itself."""


class InputStage:
    """One input, from the connector to the converter, computed together with the world."""

    def __init__(self, configured: Input, cables: Mapping[str, Cable], grid: TimeGrid = USUAL_GRID) -> None:
        """``cables`` are the cables of all inputs, keyed by name; cables may be replaced at any time."""
        self.configured = configured
        self._cables = cables
        self._clip_v = configured.range_v * OVER_RANGE
        half_turn = np.pi * AC_CUT_HZ * grid.step_s
        self._capacitor = RecursiveFilter(
            np.array([1.0, -1.0]) / (1 + half_turn), [1.0, -(1 - half_turn) / (1 + half_turn)]
        )

    @property
    def cable(self) -> Cable:
        """The present connection of the input."""
        return self._cables.get(self.configured.physical_channel, OPEN_INPUT)

    def pass_on(self, signals: FloatArray) -> tuple[FloatArray, bool]:
        """Return volts at the converter, and whether they clip, for ``signals`` of shape (signals, steps)."""
        offset_v, gain = _operating_point(self.configured, self.cable)
        signal = signals[self.cable.signal]
        match self.configured.coupling:
            case Coupling.AC:
                # When a conversion starts, the capacitor is already charged to the constant part.
                volts = self._capacitor.run(signal * gain)
            case Coupling.DC:
                volts = signal * gain
                volts += offset_v
        clips = bool(np.abs(volts).max(initial=0.0) > self._clip_v)
        return np.clip(volts, -self._clip_v, self._clip_v) if clips else volts, clips


def _operating_point(configured: Input, cable: Cable) -> tuple[float, float]:
    """Return the constant voltage at the input, and the gain from signal to input."""
    powered = configured.iepe_current_a >= LEAST_EXCITATION_A
    match cable.behind:
        case Behind.VOLTAGE_SOURCE:
            return configured.iepe_current_a * SOURCE_OHM, 1 / cable.attenuation
        case Behind.IEPE_SENSOR if powered:
            return IEPE_BIAS_V, 1 / cable.attenuation
        case Behind.NOTHING if powered:
            return COMPLIANCE_V, 0.0
        case _:
            return 0.0, 0.0


CONVERTER_BITS = 24
_MOST_COUNTS = 2.0 ** (CONVERTER_BITS - 1)


def volts_per_count(range_v: float) -> float:
    """Return the quantisation step of a 24-bit input with a range of plus and minus ``range_v`` [V]."""
    return range_v / _MOST_COUNTS


class ConverterInput:
    """One channel: input stage, anti-alias filter, noise, quantiser."""

    def __init__(
        self,
        stage: InputStage,
        steps_per_sample: float,
        start_step: int,
        history: FloatArray,
        noise_v: float,
        noise: NoiseStream,
    ) -> None:
        """Begin at a step of the world; ``history`` contains the signals of the preceding steps.

        ``noise_v`` is the rms noise of the converter in the converter's band. The filter keeps the delay of
        the present cable, even if the cable is replaced.
        """
        self.has_clipped = False
        self._stage = stage
        self._filter = Decimator(steps_per_sample, start_step, stage.cable.delay_steps)
        self._noise_v = noise_v
        self._noise = noise
        self._count_v = volts_per_count(stage.configured.range_v)
        self._means, _ = stage.pass_on(history)  # ignore clipping before the start
        self._means_first_step = start_step - history.shape[1]

    def take(self, signals: FloatArray, sample: int, count: int) -> FloatArray:
        """Process the next steps of the world and return the ``count`` samples that they complete [V]."""
        volts, clips = self._stage.pass_on(signals)
        self.has_clipped |= clips
        self._means = np.concatenate([self._means, volts])
        samples = self._filter.convert(self._means, self._means_first_step, sample, count)
        # The next sample may lie between grid points, so keep one step more than the sample needs.
        done = self._filter.first_step(sample + count) - 1 - self._means_first_step
        self._means = self._means[max(done, 0) :]
        self._means_first_step += max(done, 0)
        noise = self._noise.draw(sample, count)
        samples += self._noise_v * noise
        samples /= self._count_v
        counts = np.rint(samples, out=samples)
        if np.abs(counts).max(initial=0.0) >= _MOST_COUNTS:
            self.has_clipped |= bool(np.any((counts >= _MOST_COUNTS) | (counts < -_MOST_COUNTS)))
            counts = np.clip(counts, -_MOST_COUNTS, _MOST_COUNTS - 1.0)
        counts *= self._count_v
        return counts


class SampleQueue:
    """Queue of converted samples in order of time."""

    def __init__(self, channels: int) -> None:
        self._empty = np.empty((channels, 0))
        self._blocks: deque[FloatArray] = deque()

    def append(self, block: FloatArray) -> None:
        """Store samples, shape (channels, samples)."""
        self._blocks.append(block)

    def take(self, count: int) -> FloatArray:
        """Return and remove the ``count`` oldest samples, shape (channels, count)."""
        parts = [self._empty]
        while count > 0:
            block = self._blocks.popleft()
            if block.shape[1] > count:
                self._blocks.appendleft(block[:, count:])
                block = block[:, :count]
            parts.append(block)
            count -= block.shape[1]
        return np.concatenate(parts, axis=1)


class Conversion:
    """A running conversion: samples are computed while the world advances, and stored until they are read."""

    def __init__(
        self,
        inputs: tuple[ConverterInput, ...],
        steps_per_sample: float,
        start_step: int,
        advance: Callable[[int], None],
        end: Callable[["Conversion"], None],
    ) -> None:
        """``advance`` advances the world to a step; ``end`` removes this conversion from the world."""
        self._inputs = inputs
        self._steps_per_sample = steps_per_sample
        self._start_step = start_step
        self._advance = advance
        self._end = end
        self._converted = 0
        self._handed_out = 0
        self._waiting = SampleQueue(len(inputs))

    def read(self, count: int) -> FloatArray:
        """Return the next ``count`` samples, shape (inputs, count) [V]; the world advances as necessary."""
        self._handed_out += count
        steps = int(np.ceil(self._handed_out * self._steps_per_sample - _ROUNDING))
        self._advance(self._start_step + steps)
        return self._waiting.take(count)

    def overload_flags(self) -> NDArray[np.bool_]:
        """Return which inputs have clipped since the last call, shape (inputs,)."""
        clipped = np.array([channel.has_clipped for channel in self._inputs], dtype=np.bool_)
        for channel in self._inputs:
            channel.has_clipped = False
        return clipped

    def close(self) -> None:
        """Stop the conversion; allowed at any time."""
        self._end(self)

    def take(self, signals: FloatArray, first_step: int) -> None:
        """Convert new signals of the world: an array (signals, steps) that begins at ``first_step``."""
        done = first_step + signals.shape[1] - self._start_step
        # Count samples with complete steps. With the tolerance, a sample that ends with the last step counts.
        complete = int(np.floor(done / self._steps_per_sample + _ROUNDING))
        count = complete - self._converted
        parts = [channel.take(signals, self._converted, count) for channel in self._inputs]
        if count:
            self._waiting.append(np.array(parts))
        self._converted = complete


_ROUNDING = 1e-6
"""Tolerance of times in steps, far above rounding errors and far below any relevant time."""
