"""Analogue output as a drive: samples are written in advance; the clock is the number of samples read."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain
from math import ceil

import numpy as np

from ..errors import AcquisitionError, ConfigurationError
from ..excitation.steps import Play, Stream, Tone, Waveform, full_level
from ..instruments import AnalogOutput, Samples, Sweep
from ..plan import DriveSource, Measurement, Phase, half_cosine
from .acquisition_loop import BLOCK_S

RELEASE_S = 0.05
"""Duration of the fade to zero after the last phase [s]."""


@dataclass(frozen=True)
class _Stretch:
    """A range of samples over which the level follows a half-cosine ramp."""

    play: Play | None
    begin: int
    end: int
    begin_level: float
    end_level: float

    def levels(self, first: int, count: int) -> Samples:
        """Return the levels of ``count`` samples, starting at number ``first`` of the whole sequence."""
        progress = (first - self.begin + np.arange(count)) / (self.end - self.begin)
        rise = self.end_level - self.begin_level
        return np.asarray(self.begin_level + rise * 0.5 * (1 - np.cos(np.pi * progress)))


class OutputSynthesizer:
    """Object that converts a run's phases to samples from -1 to 1, on demand and in order.

    The level is an envelope: a half cosine over a ramp, otherwise constant. A tone continues without a phase
    step when its frequency changes. Phases of the run end at the samples nearest to the sums of all
    durations, as in the recording. At the end, the signal fades within `RELEASE_S`, and silence follows.
    """

    def __init__(self, sample_rate_hz: float) -> None:
        self._rate_hz = sample_rate_hz
        self._coming: Iterator[Phase] = iter(())
        self._stretch = _Stretch(None, 0, 0, 0.0, 0.0)
        self._sample = 0
        self._due_s = 0.0
        self.level = 0.0
        """Level of the signal at the next sample, from 0 to 1."""
        self._cycles = 0.0
        self._streamed = 0

    @property
    def is_over(self) -> bool:
        """Whether all phases and the silence after them have been returned."""
        return self._stretch.play is None and self.level == 0.0 and self._sample == self._stretch.end

    def append(self, phases: Iterable[Phase]) -> None:
        """Append ``phases``; the first phase starts at once if no earlier phase is left."""
        self._coming = chain(self._coming, phases)

    def fade(self, duration_s: float) -> None:
        """Discard the coming phases, and fade the signal from the next sample on."""
        self._coming = iter(())
        self._fade(duration_s)

    def take(self, count: int) -> Samples:
        """Return the next ``count`` samples, shape (count,)."""
        taken = np.empty(count)
        done = 0
        while done < count:
            self._advance_to_next(count - done)
            current = self._stretch
            stretch = min(count - done, current.end - self._sample)
            levels = current.levels(self._sample, stretch + 1)
            taken[done : done + stretch] = self._sound(current.play, stretch) * levels[:-1]
            self.level = float(levels[-1])
            self._sample += stretch
            done += stretch
        return taken

    def _advance_to_next(self, wanted: int) -> None:
        """Advance to the range that contains the next sample, skipping phases shorter than a sample.

        If there are no further phases, silence covers only the ``wanted`` samples. Phases appended later
        start after this silence.
        """
        while self._sample >= self._stretch.end:
            phase = next(self._coming, None)
            if phase is not None:
                self._due_s += phase.duration_s
                end = round(self._due_s * self._rate_hz)
                self._stretch = _Stretch(phase.play, self._sample, end, self.level, phase.end_level)
            elif self.level > 0.0:
                self._fade(RELEASE_S)
            else:
                self._stretch = _Stretch(None, self._sample, self._sample + wanted, 0.0, 0.0)
                self._due_s = self._stretch.end / self._rate_hz

    def _fade(self, duration_s: float) -> None:
        end = self._sample + max(1, round(duration_s * self._rate_hz))
        self._stretch = _Stretch(self._stretch.play, self._sample, end, self.level, 0.0)
        self._due_s = end / self._rate_hz

    def _sound(self, play: Play | None, count: int) -> Samples:
        match play:
            case None:
                return np.zeros(count)
            case Tone(frequency_hz, level):
                cycles = self._cycles + frequency_hz * np.arange(count + 1) / self._rate_hz
                self._cycles = float(cycles[-1] % 1.0)
                return np.asarray(level * np.sin(2 * np.pi * cycles[:-1]))
            case Stream(source):
                first, self._streamed = self._streamed, self._streamed + count
                return source.samples(first, count, self._rate_hz)
            case Waveform() | Sweep():
                raise ConfigurationError(
                    "an analogue output plays only streams, not a repeated waveform or a generator's own "
                    "sweep. Nothing was played; use the function generator"
                )


BLIND_FADE_S = 0.1
"""Duration of the fade when the run ends without sampling [s]."""
# Without this, a rounding error could add a block to a duration of a whole number of blocks.
_ROUNDING = 1e-9


class StreamDrive:
    """A `Drive` that writes every sample, including ramps, `AnalogOutput.ahead_samples` in advance.

    Output and digitizer start at the same trigger, so the number of samples read shows how many have been
    played. Written samples cannot be withdrawn; a stop takes effect when they have been played.
    """

    drive_source = DriveSource.OUTPUT
    coefficients = ()
    is_commanded = False
    can_hold = False

    def __init__(self, output: AnalogOutput, measurement: Measurement, terminal_factor: float) -> None:
        """``terminal_factor`` is the voltage at a generator's terminal per volt of its setting."""
        self._output = output
        self.pause_s = output.ahead_samples / output.sample_rate_hz
        """Playing time of the samples written in advance [s]."""
        self._amplitude_vpp = measurement.excitation.amplitude_vpp
        self._full_v = 0.5 * self._amplitude_vpp * terminal_factor
        self._synthesizer = OutputSynthesizer(output.sample_rate_hz)
        self._read_s = 0.0
        self._written = 0
        self._sounds_until = 0
        """Number of the sample after the last nonzero sample."""
        self._is_playing = False
        self.setting_vpp = 0.0
        """Present amplitude, as the equivalent amplitude setting of a generator [Vpp]."""

    @property
    def is_playing(self) -> bool:
        """Whether samples other than zero are still to be played."""
        return self._is_playing and self._sounds_until > self._played_samples

    def arm(self, coming: Iterable[Phase]) -> None:
        """Write the first samples, which start to play with the digitizer."""
        self._synthesizer.append(coming)
        self._write_ahead()
        self._output.arm()

    def announce(self, coming: Iterable[Phase]) -> None:
        """Append the phases ``coming`` after the silence already written."""
        assert self._synthesizer.is_over, "the previous announcement is shorter than the written samples"
        self._synthesizer.append(coming)

    def perform(self, phase: Phase) -> Iterator[float]:
        """Write ahead while an earlier phase plays; yield how long to read before more is written [s]."""
        self._is_playing = True
        full_vpp = self._amplitude_vpp * full_level(phase.play)
        yield from self._split_duration(phase.duration_s, full_vpp * phase.end_level)

    def ramp_down(self, ramp_s: float, _clock_s: Callable[[], float]) -> Iterator[float]:
        """Play the samples already written, then fade by the device's clock; yield times like `perform`."""
        fade_s = ramp_s if self._synthesizer.level > 0.0 else 0.0
        written_s = self._written / self._output.sample_rate_hz - self._read_s
        self._synthesizer.fade(ramp_s)
        yield from self._split_duration(written_s, self.setting_vpp)
        yield from self._split_duration(fade_s, 0.0)

    def cut(self) -> None:
        """Set the output to zero volts at once."""
        self._is_playing = False
        self.setting_vpp = 0.0
        self._output.stop()

    def silence(self) -> None:
        """Fade as fast as possible, write until the fade has been played, then stop.

        Used when the run ends without sampling. A device that accepts no more samples is stopped at once.
        """
        try:
            with suppress(AcquisitionError):  # after a failed fade, `cut` still follows
                self._fade_blindly()
        finally:
            self.cut()

    @property
    def _played_samples(self) -> int:
        """Number of samples played so far, as derived from the time of reading."""
        return round(self._read_s * self._output.sample_rate_hz)

    def _split_duration(self, duration_s: float, end_vpp: float) -> Iterator[float]:
        """Yield a duration in parts no longer than a block; write samples in advance after each part."""
        begin_vpp = self.setting_vpp
        parts = ceil(duration_s / BLOCK_S * (1 - _ROUNDING))
        for part in range(1, parts + 1):
            self.setting_vpp = begin_vpp + (end_vpp - begin_vpp) * half_cosine(part / parts)
            yield duration_s / parts
            self._read_s += duration_s / parts
            self._write_ahead()

    def _write_ahead(self) -> None:
        room = self._played_samples + self._output.ahead_samples - self._written
        if room > 0:
            self._write(room)

    def _write(self, count: int) -> None:
        volts = self._full_v * self._synthesizer.take(count)
        self._output.write(volts)
        sounding = np.flatnonzero(volts)
        if sounding.size:
            self._sounds_until = self._written + int(sounding[-1]) + 1
        self._written += count

    def _fade_blindly(self) -> None:
        if not self.is_playing:
            return
        self._synthesizer.fade(BLIND_FADE_S)
        ahead = self._output.ahead_samples
        # Each write waits for space: when the last silence is written, the fade has been played.
        left = ceil(BLIND_FADE_S * self._output.sample_rate_hz) + ahead
        while left > 0:
            count = min(left, ahead // 2)
            self._write(count)
            left -= count
