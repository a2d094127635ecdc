"""The samples of what is to be played, written down phase by phase, without a step between any two."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np

from ..errors import ConfigurationError
from ..excitation import Play, Stream, Tone, Waveform
from ..instruments import Samples
from ..plan import Phase

RELEASE_S = 0.05
"""How long the last sound fades when a score ends while something sounds [s]."""


@dataclass(frozen=True)
class _Piece:
    """A stretch of samples over which the level goes from one value to another on a half cosine."""

    play: Play | None
    begin: int
    end: int
    begin_level: float
    end_level: float

    def levels(self, first: int, count: int) -> Samples:
        """Level of ``count`` samples from number ``first`` of the score on; the first has ``begin_level``."""
        progress = (first - self.begin + np.arange(count)) / (self.end - self.begin)
        rise = self.end_level - self.begin_level
        return np.asarray(self.begin_level + rise * 0.5 * (1 - np.cos(np.pi * progress)))


class Score:
    """Phases as samples from -1 to 1, made on demand and in order.

    The level is an envelope, sample by sample: a half cosine over a ramp, and constant elsewhere. The
    phase of a tone goes on when its frequency changes. Phase boundaries lie at the samples nearest to
    the sums of all durations, as they do in the recording. When nothing is left, the last sound fades
    within `RELEASE_S`, and silence follows.
    """

    def __init__(self, sample_rate_hz: float) -> None:
        self._rate_hz = sample_rate_hz
        self._coming: Iterator[Phase] = iter(())
        self._piece = _Piece(None, 0, 0, 0.0, 0.0)
        self._sample = 0
        self._due_s = 0.0
        self._level = 0.0
        self._cycles = 0.0
        self._streamed = 0

    @property
    def level(self) -> float:
        """Level of the next sample, from 0 to 1."""
        return self._level

    @property
    def is_over(self) -> bool:
        """Whether all that was appended has been handed out, and silence too."""
        return self._piece.play is None and self._level == 0.0 and self._sample == self._piece.end

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
            self._turn_the_page(count - done)
            piece = self._piece
            stretch = min(count - done, piece.end - self._sample)
            levels = piece.levels(self._sample, stretch + 1)
            taken[done : done + stretch] = self._sound(piece.play, stretch) * levels[:-1]
            self._level = float(levels[-1])
            self._sample += stretch
            done += stretch
        return taken

    def _turn_the_page(self, wanted: int) -> None:
        """Find the piece that the next sample belongs to; phases shorter than a sample are passed over.

        When nothing is coming, silence lasts for the ``wanted`` samples and no longer, so that what is
        appended then begins with the next one.
        """
        while self._sample >= self._piece.end:
            phase = next(self._coming, None)
            if phase is not None:
                self._begin(phase)
            elif self._level > 0.0:
                self._fade(RELEASE_S)
            else:
                self._rest(wanted)

    def _begin(self, phase: Phase) -> None:
        self._due_s += phase.duration_s
        end = round(self._due_s * self._rate_hz)
        self._piece = _Piece(phase.play, self._sample, end, self._level, phase.end_level)

    def _fade(self, duration_s: float) -> None:
        end = self._sample + max(1, round(duration_s * self._rate_hz))
        self._piece = _Piece(self._piece.play, self._sample, end, self._level, 0.0)
        self._due_s = end / self._rate_hz

    def _rest(self, samples: int) -> None:
        self._piece = _Piece(None, self._sample, self._sample + samples, 0.0, 0.0)
        self._due_s = self._piece.end / self._rate_hz

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
            case Waveform():
                raise ConfigurationError(
                    "a repeated waveform was given to the analogue output, which streams. Nothing of it was "
                    "played; play it by the function generator"
                )
