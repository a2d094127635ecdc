"""A running conversion: the world's signals in, quantised samples of the configured inputs out."""

from collections import deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .decimation import Decimator, decimator
from .disturbance import NoiseStream
from .input_stage import InputStage
from .wiring import Cable

FloatArray = NDArray[np.float64]

CONVERTER_BITS = 24
_MOST_COUNTS = 2.0 ** (CONVERTER_BITS - 1)


def volts_per_count(range_v: float) -> float:
    """Smallest step of an input [V]: its range, plus and minus, in 24 bits, as the driver reports it."""
    return range_v / _MOST_COUNTS


class ConverterInput:
    """One channel: input stage, anti-alias filter, noise, quantiser."""

    def __init__(self, stage: InputStage, filtered: Decimator, noise_v: float, noise: NoiseStream) -> None:
        """``noise_v`` is the rms of the converter's own noise, in its band."""
        self.has_clipped = False
        self._stage = stage
        self._filter = filtered
        self._noise_v = noise_v
        self._noise = noise
        self._count_v = volts_per_count(stage.configured.range_v)
        self._means = np.empty(0)
        self._means_first_step = 0

    def plug(self, physical_channel: str, cable: Cable) -> None:
        """Change what is connected, if this is the channel; the filter's delay stays as it began."""
        if self._stage.configured.physical_channel == physical_channel:
            self._stage.plug(cable)

    def begin(self, history: FloatArray, first_step: int) -> None:
        """Take in what the signals were before the conversion began; clipping in it does not count."""
        self._means, _ = self._stage.pass_on(history)
        self._means_first_step = first_step

    def take(self, signals: FloatArray, sample: int, count: int) -> FloatArray:
        """Take in the next steps of the world and hand out the ``count`` samples they complete [V]."""
        volts, clips = self._stage.pass_on(signals)
        self.has_clipped |= clips
        self._means = np.concatenate([self._means, volts])
        samples = self._filter.convert(self._means, self._means_first_step, sample, count)
        # The next sample may fall between grid points: one more step is kept than it needs.
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


class Conversion:
    """A `Sampler` on the world: its samples become ready as the world advances, and wait to be read."""

    def __init__(
        self,
        inputs: tuple[ConverterInput, ...],
        steps_per_sample: float,
        start_step: int,
        advance: Callable[[int], None],
        end: Callable[["Conversion"], None],
    ) -> None:
        """``advance`` lets the world go on up to a step; ``end`` takes this conversion off the world."""
        self._inputs = inputs
        self._steps_per_sample = steps_per_sample
        self._start_step = start_step
        self._advance = advance
        self._end = end
        self._converted = 0
        self._handed_out = 0
        self._waiting: deque[FloatArray] = deque()

    def read(self, count: int) -> FloatArray:
        """Next ``count`` samples, shape (inputs, count) [V]; the world advances as far as they need."""
        self._advance(self._step_after(self._handed_out + count))
        parts, missing = [np.empty((len(self._inputs), 0))], count
        while missing > 0:
            part = self._waiting.popleft()
            if part.shape[1] > missing:
                self._waiting.appendleft(part[:, missing:])
                part = part[:, :missing]
            parts.append(part)
            missing -= part.shape[1]
        self._handed_out += count
        return np.concatenate(parts, axis=1)

    def overloaded(self) -> NDArray[np.bool_]:
        """Which inputs have clipped since the last call, shape (inputs,)."""
        clipped = np.array([channel.has_clipped for channel in self._inputs], dtype=np.bool_)
        for channel in self._inputs:
            channel.has_clipped = False
        return clipped

    def plug(self, physical_channel: str, cable: Cable) -> None:
        """Change what one input is connected to, from now on."""
        for channel in self._inputs:
            channel.plug(physical_channel, cable)

    def close(self) -> None:
        """Stop converting. Legal at any time."""
        self._end(self)

    def take(self, signals: FloatArray, first_step: int) -> None:
        """Convert what the world has just computed, shape (signals, steps), from ``first_step`` on."""
        done = first_step + signals.shape[1] - self._start_step
        # The last sample whose last step is computed; the rounding guards a step that ends on a sample.
        complete = int(np.floor(done / self._steps_per_sample + _ROUNDING))
        count = complete - self._converted
        parts = [channel.take(signals, self._converted, count) for channel in self._inputs]
        if count:
            self._waiting.append(np.array(parts))
        self._converted = complete

    def _step_after(self, samples: int) -> int:
        return self._start_step + int(np.ceil(samples * self._steps_per_sample - _ROUNDING))


_ROUNDING = 1e-6
"""In steps: far more than rounding, far less than anything that matters."""


def converter_input(
    stage: InputStage, steps_per_sample: float, start_step: int, noise_v: float, noise: NoiseStream
) -> ConverterInput:
    """Put one channel together for a conversion that begins at a step of the world."""
    filtered = decimator(steps_per_sample, start_step, stage.cable.delay_steps)
    return ConverterInput(stage, filtered, noise_v, noise)
