"""Read blocks from the converter, check them, record them, and count the samples."""

import json
from collections.abc import Callable, Iterator
from dataclasses import asdict

from ..errors import LimitExceeded
from ..excitation.steps import Segment
from ..instruments import Block, Digitizer, read_block
from ..recording import EventKind, RecordingWriter

BLOCK_S = 0.1
"""Longest time between two checks of limits and stop switch [s]; ten reads per second suit NI-DAQmx."""


class AcquisitionLoop:
    """Loop that reads and records blocks. Its clock is the number of samples read: waiting means reading.

    Methods that return an iterator yield the size of each block; `read` each block before the next size.
    """

    def __init__(self, digitizer: Digitizer, sink: RecordingWriter, advance: Callable[[], None]) -> None:
        """Create a loop, which calls ``advance`` after every block of samples."""
        self._advance = advance
        self._digitizer = digitizer
        self._sink = sink
        self.segment: Segment | None = None
        """Segment that is being recorded; None outside segments."""
        self.samples = 0
        """Number of samples recorded so far."""
        self.lost_samples = 0
        """Number of samples lost by the converter; the recording marks them."""
        self._due_s = 0.0

    @property
    def elapsed_s(self) -> float:
        """Duration of the samples recorded so far [s]."""
        return self.samples / self._digitizer.sample_rate_hz

    def sizes_for(self, duration_s: float, lead_s: float = 0.0) -> Iterator[int]:
        """Yield the sizes of the blocks of another ``duration_s``.

        The last sample is the one nearest to the sum of all durations so far, so rounding does not
        accumulate. The last ``lead_s`` [s] are left for the next call.
        """
        rate_hz = self._digitizer.sample_rate_hz
        self._due_s += duration_s
        longest = max(1, round(BLOCK_S * rate_hz))
        # A slow consumer of the blocks delays the goal, so compute the goal again for every block.
        while self.samples < (goal := round((self._due_s - lead_s) * rate_hz)):
            yield min(longest, goal - self.samples)

    def time_s(self) -> float:
        """Return the sum of all durations so far, including delays [s]."""
        return self._due_s

    @property
    def waiting_s(self) -> float:
        """Time since the conversion of the last sample read [s]."""
        return self._digitizer.waiting_samples / self._digitizer.sample_rate_hz

    def waiting_sizes(self) -> Iterator[int]:
        """Yield the sizes of the waiting blocks, and delay the rest of the plan by their duration."""
        # Ask only once how many samples wait, because more samples arrive during reading.
        waiting = self._digitizer.waiting_samples
        self._due_s += waiting / self._digitizer.sample_rate_hz
        longest = max(1, round(BLOCK_S * self._digitizer.sample_rate_hz))
        while waiting > 0:
            yield min(longest, waiting)
            waiting -= min(longest, waiting)

    def sizes_until(self, duration_s: float) -> Iterator[int]:
        """Yield sizes until another ``duration_s`` has been converted; the number of unread samples is kept.

        If more time has passed already, the rest of the plan is delayed accordingly.
        """
        rate_hz = self._digitizer.sample_rate_hz
        self._due_s += duration_s
        goal = round(self._due_s * rate_hz)
        piece = max(1, round(min(duration_s, BLOCK_S) * rate_hz))
        sampled = self.samples
        while sampled < goal:
            yield min(piece, goal - self.samples)
            sampled = self._converted
        # A difference of up to half a sample comes from rounding the goal; it must not accumulate.
        self._due_s = max(self._due_s, (sampled - 0.5) / rate_hz)

    @property
    def _converted(self) -> int:
        """Number of samples per channel converted so far, whether read or not."""
        return self.samples + self._digitizer.waiting_samples

    def extend(self, duration_s: float) -> int:
        """Delay the rest of the plan for an additional block; return its size."""
        self._due_s += duration_s
        return round(duration_s * self._digitizer.sample_rate_hz)

    def read(self, samples: int) -> Block:
        """Read, record and return the next block."""
        block = read_block(self._digitizer, samples)
        self._advance()
        self._sink.append(block)
        self.lost_samples += block.first_sample - self.samples
        self.samples = block.first_sample + block.volts.shape[1]
        return block

    def cut(self) -> None:
        """Let the next duration start now, even if the last duration is incomplete and samples are unread."""
        self._due_s = self._converted / self._digitizer.sample_rate_hz

    def enter(self, segment: Segment | None) -> None:
        """Start ``segment`` at the next sample, unless it is open already; end any other segment."""
        if segment == self.segment:
            return
        if self.segment is not None:
            self._sink.end_segment()
        if segment is not None:
            self._sink.begin_segment(segment.label, **segment.numbers)
        self.segment = segment

    def log(self, kind: str, text: str) -> None:
        """Add an event to the recording at the next sample."""
        self._sink.log(kind, text, self.samples)

    def log_limit_trip(self, error: LimitExceeded) -> None:
        """Add an event with the values of an exceeded limit, at the sample that exceeded this limit."""
        if error.trip is not None:
            self._sink.log(EventKind.LIMIT, json.dumps(asdict(error.trip)), error.trip.sample)
