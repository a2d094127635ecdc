"""The rig behind the simulated driver: one world, one time for all running tasks, and the trigger lines."""

import threading
import time
from collections.abc import Callable
from typing import Protocol

from nidaqmx.error_codes import DAQmxErrors

from vibench.acquisition import AcquisitionError

from ..analogue import AnalogueWorld
from ._errors import DaqmxRefusal
from ._pace import SLICE_S, Pace


class Stream(Protocol):
    """A running acquisition or generation."""

    failure: DaqmxRefusal | None

    def advance_to(self, now_s: float) -> None:
        """Do what is due at that rig time."""

    def close(self) -> None:
        """End."""


class Source(Stream, Protocol):
    """A running generation: it must hand its samples over before the world plays them."""

    def prepare(self, until_s: float) -> None:
        """Hand over what is played up to that rig time."""


class Rig:
    """Moves the world and every running task through rig time together.

    ``changed`` guards the tasks and the trigger lines. The world guards itself: others use it too.
    """

    def __init__(self, world: AnalogueWorld, pace: Pace) -> None:
        """Begin at the world's time, with nothing running."""
        self.world = world
        self.pace = pace
        self.changed = threading.Condition(threading.RLock())
        self._epoch_s = time.time() - world.time_s
        self._acquisitions: list[Stream] = []
        self._generations: list[Source] = []
        self._armed: dict[str, list[Callable[[], None]]] = {}

    @property
    def now_s(self) -> float:
        """Rig time reached so far [s]."""
        return self.world.time_s

    def wall_s(self, rig_s: float) -> float:
        """Wall-clock time of a moment of rig time [s since 1970]; they met when the rig was switched on."""
        return self._epoch_s + rig_s

    def advance_to(self, until_s: float) -> None:
        """Let rig time pass; a world that cannot go on ends all that runs, and what waits for it."""
        try:
            self._advance_to(until_s)
        except AcquisitionError as error:
            lost = DaqmxRefusal(DAQmxErrors.DEV_CANNOT_BE_ACCESSED, str(error))
            for stream in (*self._acquisitions, *self._generations):
                stream.failure = lost
            self.changed.notify_all()
            raise lost from error

    def _advance_to(self, until_s: float) -> None:
        """Go in slices: outputs are fed first, then inputs convert, then the rest passes."""
        reached_s = self.now_s
        for acquisition in self._acquisitions:
            acquisition.advance_to(reached_s)
        while reached_s < until_s:
            reached_s = min(until_s, reached_s + SLICE_S)
            for generation in self._generations:
                generation.prepare(reached_s)
            for acquisition in self._acquisitions:
                acquisition.advance_to(reached_s)
            if self.now_s < reached_s:
                self.world.advance(reached_s - self.now_s)
            for generation in self._generations:
                generation.advance_to(reached_s)
        self.changed.notify_all()

    def run_acquisition(self, acquisition: Stream) -> None:
        """Take it along through time."""
        self._acquisitions.append(acquisition)
        self.changed.notify_all()

    def run_generation(self, generation: Source) -> None:
        """Take it along through time; its first samples start now."""
        generation.prepare(self.now_s)
        self._generations.append(generation)
        self.changed.notify_all()

    def end(self, stream: Stream) -> None:
        """Stop taking it along."""
        stream.close()
        self._acquisitions = [other for other in self._acquisitions if other is not stream]
        self._generations = [other for other in self._generations if other is not stream]
        self.changed.notify_all()

    def arm(self, terminal: str, begin: Callable[[], None]) -> None:
        """Call ``begin`` at the next edge on that terminal."""
        self._armed.setdefault(terminal.lower(), []).append(begin)

    def disarm(self, begin: Callable[[], None]) -> None:
        """Forget what waits for an edge."""
        self._armed = {
            terminal: [other for other in waiting if other != begin]
            for terminal, waiting in self._armed.items()
        }

    def edge(self, terminal: str) -> None:
        """Raise a terminal: everything that waits for it begins at this very instant."""
        for begin in self._armed.pop(terminal.lower(), []):
            begin()
        self.changed.notify_all()
