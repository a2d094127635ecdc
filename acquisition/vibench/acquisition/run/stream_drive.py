"""An analogue output as a drive: samples are written ahead of their time, and reading is the clock."""

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain
from math import ceil

import numpy as np

from ..errors import AcquisitionError, ConfigurationError
from ..excitation.steps import Play, Stream, Tone, Waveform
from ..instruments import AnalogOutput, Samples, Sweep
from ..plan import DriveSource, Measurement, Phase, half_cosine
from .acquisition_loop import BLOCK_S

RELEASE_S = 0.05
"""How long the last sound fades when a sequence ends while something sounds [s]."""


@dataclass(frozen=True)
class _Stretch:
    """A stretch of samples over which the level goes from one value to another on a half cosine."""

    play: Play | None
    begin: int
    end: int
    begin_level: float
    end_level: float

    def levels(self, first: int, count: int) -> Samples:
        """Level of ``count`` samples from number ``first`` of the sequence on; the first has
        ``begin_level``.
        """
        progress = (first - self.begin + np.arange(count)) / (self.end - self.begin)
        rise = self.end_level - self.begin_level
        return np.asarray(self.begin_level + rise * 0.5 * (1 - np.cos(np.pi * progress)))


class OutputSynthesizer:
    """Phases as samples from -1 to 1, made on demand and in order.

    The level is an envelope, sample by sample: a half cosine over a ramp, and constant elsewhere. The
    phase of a tone goes on when its frequency changes. Phase boundaries lie at the samples nearest to
    the sums of all durations, as they do in the recording. When nothing is left, the last sound fades
    within `RELEASE_S`, and silence follows.
    """

    def __init__(self, sample_rate_hz: float) -> None:
        self._rate_hz = sample_rate_hz
        self._coming: Iterator[Phase] = iter(())
        self._stretch = _Stretch(None, 0, 0, 0.0, 0.0)
        self._sample = 0
        self._due_s = 0.0
        self.level = 0.0
        """Level of the next sample, from 0 to 1."""
        self._cycles = 0.0
        self._streamed = 0

    @property
    def is_over(self) -> bool:
        """Whether all that was appended has been handed out, and silence too."""
        return self._stretch.play is None and self.level == 0.0 and self._sample == self._stretch.end

    def append(self, phases: Iterable[Phase]) -> None:
        """Play ``phases`` after what is there; at once when all of it has been handed out."""
        self._coming = chain(self._coming, phases)

    def fade(self, duration_s: float) -> None:
        """Drop what is coming, and fade what sounds, from the next sample on."""
        self._coming = iter(())
        self._fade(duration_s)

    def take(self, count: int) -> Samples:
        """Hand out the next ``count`` samples, shape (count,)."""
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
        """Find the piece that the next sample belongs to; phases shorter than a sample are passed over.

        When nothing is coming, silence lasts for the ``wanted`` samples and no longer, so that what is
        appended then begins with the next one.
        """
        while self._sample >= self._stretch.end:
            phase = next(self._coming, None)
            if phase is not None:
                self._begin(phase)
            elif self.level > 0.0:
                self._fade(RELEASE_S)
            else:
                self._rest(wanted)

    def _begin(self, phase: Phase) -> None:
        self._due_s += phase.duration_s
        end = round(self._due_s * self._rate_hz)
        self._stretch = _Stretch(phase.play, self._sample, end, self.level, phase.end_level)

    def _fade(self, duration_s: float) -> None:
        end = self._sample + max(1, round(duration_s * self._rate_hz))
        self._stretch = _Stretch(self._stretch.play, self._sample, end, self.level, 0.0)
        self._due_s = end / self._rate_hz

    def _rest(self, samples: int) -> None:
        self._stretch = _Stretch(None, self._sample, self._sample + samples, 0.0, 0.0)
        self._due_s = self._stretch.end / self._rate_hz

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
                    "a repeated waveform, or a generator's own sweep, was given to the analogue output, "
                    "which streams. Nothing of it was played; play it by the function generator"
                )


BLIND_FADE_S = 0.1
"""Fade on the ways out on which nothing is read any more: short, yet no step [s]."""
# A duration of a whole number of blocks must not become one part more by rounding.
_ROUNDING = 1e-9


class StreamDrive:
    """A `Drive` that writes every sample, ramps included, `AnalogOutput.ahead_samples` before it is played.

    Output and digitizer begin at the same trigger, so what has been read has been played: the room
    in front of the output is known without asking the device. What was written cannot be taken back,
    so breaking off takes effect after at most that long.
    """

    drive_source = DriveSource.OUTPUT
    coefficients = ()
    is_commanded = False
    can_hold = False

    def __init__(self, output: AnalogOutput, measurement: Measurement, terminal_factor: float) -> None:
        """``terminal_factor``: volts that the generator's terminal would show per volt of setting."""
        self._output = output
        self._amplitude_vpp = measurement.excitation.amplitude_vpp
        self._full_v = 0.5 * self._amplitude_vpp * terminal_factor
        self._synthesizer = OutputSynthesizer(output.sample_rate_hz)
        self._read_s = 0.0
        self._written = 0
        self._sounds_until = 0
        """The first sample after the last one that is not silent."""
        self._is_playing = False
        self.setting_vpp = 0.0
        """What plays now, as the setting of the generator that would play the same [V]."""

    @property
    def pause_s(self) -> float:
        """As long as it takes to play what is written ahead [s]."""
        return self._output.ahead_samples / self._output.sample_rate_hz

    @property
    def is_playing(self) -> bool:
        """Whether anything but silence is still to be played."""
        return self._is_playing and self._sounds_until > self._played

    def arm(self, coming: Iterable[Phase]) -> None:
        """Write the first stretch, and wait for the digitizer's start."""
        self._synthesizer.append(coming)
        self._write_ahead()
        self._output.arm()

    def announce(self, coming: Iterable[Phase]) -> None:
        """Let ``coming`` follow the silence that has been written already."""
        assert self._synthesizer.is_over, "what was told before is shorter than what is written ahead"
        self._synthesizer.append(coming)

    def perform(self, phase: Phase) -> Iterator[float]:
        """Write ahead while a phase, written before, plays; yields how long to read until more fits."""
        self._is_playing = True
        yield from self._listened(phase.duration_s, self._full_vpp(phase) * phase.end_level)

    def ramp_down(self, ramp_s: float) -> Iterator[float]:
        """Let what is written play out, then fade; yields as `perform` does."""
        fade_s = ramp_s if self._synthesizer.level > 0.0 else 0.0
        written_s = self._written / self._output.sample_rate_hz - self._read_s
        self._synthesizer.fade(ramp_s)
        yield from self._listened(written_s, self.setting_vpp)
        yield from self._listened(fade_s, 0.0)

    def cut(self) -> None:
        """Go to zero volts at once, whatever was written."""
        self._is_playing = False
        self.setting_vpp = 0.0
        self._output.stop()

    def silence(self) -> None:
        """Fade within the shortest time, wait by writing until that has been played, then stop.

        For the ways out on which no samples can be counted. A device that takes no more samples is
        stopped at once.
        """
        try:
            with suppress(AcquisitionError):  # what fails here leaves it to stop()
                self._fade_blindly()
        finally:
            self.cut()

    @property
    def _played(self) -> int:
        """Samples that have been played: as many as fit into the time read."""
        return round(self._read_s * self._output.sample_rate_hz)

    def _full_vpp(self, phase: Phase) -> float:
        match phase.play:
            case Tone(_, level):
                return self._amplitude_vpp * level
            case _:
                return self._amplitude_vpp

    def _listened(self, duration_s: float, end_vpp: float) -> Iterator[float]:
        """Yield a duration in parts, none longer than a block, and write ahead after each."""
        begin_vpp = self.setting_vpp
        parts = ceil(duration_s / BLOCK_S * (1 - _ROUNDING))
        for part in range(1, parts + 1):
            self.setting_vpp = begin_vpp + (end_vpp - begin_vpp) * half_cosine(part / parts)
            yield duration_s / parts
            self._read_s += duration_s / parts
            self._write_ahead()

    def _write_ahead(self) -> None:
        room = self._played + self._output.ahead_samples - self._written
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
        # Writing waits for room: when the last silence has gone in, the fade has been played.
        left = ceil(BLIND_FADE_S * self._output.sample_rate_hz) + ahead
        while left > 0:
            count = min(left, ahead // 2)
            self._write(count)
            left -= count
