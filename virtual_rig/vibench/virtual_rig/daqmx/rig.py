"""The rig behind the simulated driver, and how its time passes: on demand, or with the wall clock."""

import threading
import time
from collections.abc import Callable
from typing import Any, Protocol

from nidaqmx.error_codes import DAQmxErrors

from vibench.acquisition import AcquisitionError

from ..analogue import AnalogueWorld
from .acquisition import Acquisition, Overflow
from .devices import Catalogue
from .errors import DaqmxRefusal
from .generation import Generation

QUESTION_S = 0.1
"""Rig time that a question about progress takes when nothing else lets time pass [s].

A program that polls ("how many samples are there?") would otherwise poll for ever.
"""

FAILED_CALL_S = 0.5
"""Rig time before a call that has failed on demand is tried again, when nothing else lets time pass [s].

A fault that heals after a while would otherwise last for ever for a program that tries again.
"""

TICK_S = 0.01
"""How often a rig on the wall clock is brought up to date [s]: well below the shortest usual read."""
SLICE_S = 0.1
"""Longest stretch of rig time computed without letting another caller in [s]."""

YIELD_S = 1e-4
"""Pause between two slices while behind the clock [s]."""


class Rig:
    """Moves the world and every running task through rig time together.

    ``changed`` guards the tasks and the trigger lines. The world guards itself: others use it too.
    """

    def __init__(self, world: AnalogueWorld, pace: "Pace", catalogue: Catalogue) -> None:
        """Begin at the world's time, with nothing running."""
        self.world = world
        self.catalogue = catalogue
        self.pace = pace
        self.changed = threading.Condition(threading.RLock())
        self._epoch_s = time.time() - world.time_s
        self._acquisitions: list[Acquisition] = []
        self._generations: list[Generation] = []
        self._armed: dict[str, list[Callable[[], None]]] = {}
        self._holders: dict[str, Any] = {}
        """Which task holds which side of which device."""

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
            streams: list[Acquisition | Generation] = [*self._acquisitions, *self._generations]
            for stream in streams:
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

    def run_acquisition(self, acquisition: Acquisition) -> None:
        """Take it along through time."""
        self._acquisitions.append(acquisition)
        self.changed.notify_all()

    def run_generation(self, generation: Generation) -> None:
        """Take it along through time; its first samples start now."""
        generation.prepare(self.now_s)
        self._generations.append(generation)
        self.changed.notify_all()

    def end(self, stream: Acquisition | Generation) -> None:
        """Stop taking it along."""
        stream.close()
        self._acquisitions = [other for other in self._acquisitions if other is not stream]
        self._generations = [other for other in self._generations if other is not stream]
        self.changed.notify_all()

    def reserve(self, resource: str, task: Any) -> None:
        """Give one side of a device to a task (-50103 if another one holds it)."""
        other = self._holders.setdefault(resource, task)
        if other is not task:
            detail = f"Resource: {resource}, held by task {other.name}\nTask Name: {task.name}"
            raise DaqmxRefusal(DAQmxErrors.PAL_RESOURCE_RESERVED, detail)

    def release(self, task: Any) -> None:
        """Take back everything a task holds."""
        self._holders = {resource: other for resource, other in self._holders.items() if other is not task}

    def require_terminal(self, name: str) -> None:
        """Refuse a terminal that no device has (-89120)."""
        known = {known.lower() for device in self.catalogue.devices for known in device.terminals}
        if name.lower() not in known:
            detail = f"Source Terminal: {name}"
            raise DaqmxRefusal(DAQmxErrors.INVALID_ROUTING_SOURCE_TERMINAL_NAME_ROUTING, detail)

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


class Pace(Protocol):
    """A rule for the passing of rig time. Every method is called with ``rig.changed`` held."""

    @property
    def overflow(self) -> Overflow:
        """What a full buffer does."""

    def open(self, rig: "Rig") -> None:
        """Begin: rig time passes from here on."""

    def close(self) -> None:
        """End: rig time stands still. Called without the lock."""

    def ask(self, rig: "Rig", until_s: float, is_there: Callable[[], bool], timeout_s: float) -> bool:
        """Wait until ``is_there()``, which is expected at rig time ``until_s``; say whether it came to be.

        ``timeout_s`` is wall time; negative waits for ever. An infinite ``until_s`` depends on somebody else.
        """

    def answer_progress(self, rig: "Rig") -> None:
        """Let a question about progress be answered with something newer than the last time."""

    def stumble(self, rig: "Rig") -> None:
        """Let time pass before a call that has failed on demand is tried again."""


def _wait(rig: "Rig", is_there: Callable[[], bool], timeout_s: float) -> bool:
    return rig.changed.wait_for(is_there, None if timeout_s < 0 else timeout_s)


class OnDemandPace:
    """FREE: samples exist when asked for. Nothing waits, nothing is lost, two runs are equal bit for bit."""

    overflow = Overflow.GROW

    def open(self, rig: "Rig") -> None:
        """Nothing to begin: time passes on request."""

    def close(self) -> None:
        """Nothing to end."""

    def ask(self, rig: "Rig", until_s: float, is_there: Callable[[], bool], timeout_s: float) -> bool:
        """Let time pass at once; wait only for what other calls must bring about, such as a trigger."""
        if is_there():
            return True
        if until_s < float("inf"):
            rig.advance_to(until_s)
            return is_there()
        return _wait(rig, is_there, timeout_s)

    def answer_progress(self, rig: "Rig") -> None:
        """Let ``QUESTION_S`` of rig time pass."""
        rig.advance_to(rig.now_s + QUESTION_S)

    def stumble(self, rig: "Rig") -> None:
        """Let ``FAILED_CALL_S`` of rig time pass."""
        rig.advance_to(rig.now_s + FAILED_CALL_S)


class WallPace:
    """WALL: rig time follows a clock, ``speed`` times as fast; late readers lose samples, early ones wait.

    A world that cannot be computed that fast makes its samples come late, never wrong.
    """

    overflow = Overflow.LOSE

    def __init__(self, speed: float = 1.0, clock: Callable[[], float] = time.monotonic) -> None:
        """Follow ``clock`` [s], any clock that never runs backwards."""
        if not 0 < speed < float("inf"):
            message = f"the speed of a rig on the wall clock is {speed}; it must be above 0 and finite"
            raise ValueError(message)
        self.speed = speed
        self._clock = clock
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        self._began_s = (0.0, 0.0)

    def open(self, rig: "Rig") -> None:
        """Start the clock, and the thread that keeps the rig up to it."""
        self._began_s = (self._clock(), rig.now_s)
        self._closing.clear()
        self._thread = threading.Thread(target=self._keep_up, args=(rig,), name="rig clock", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop the clock."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join()

    def ask(self, rig: "Rig", until_s: float, is_there: Callable[[], bool], timeout_s: float) -> bool:  # noqa: ARG002 - this clock needs no hint
        """Wait for the clock."""
        self._step(rig)
        return is_there() or _wait(rig, is_there, timeout_s)

    def answer_progress(self, rig: "Rig") -> None:
        """Bring the rig up to the clock."""
        self._step(rig)

    def stumble(self, rig: "Rig") -> None:
        """Bring the rig up to the clock."""
        self._step(rig)

    def _keep_up(self, rig: "Rig") -> None:
        pause_s = TICK_S
        while not self._closing.wait(pause_s):
            with rig.changed:
                try:
                    behind_s = self._step(rig)
                except AcquisitionError:
                    return  # the world stands still; the next call reports it
            pause_s = YIELD_S if behind_s > 0 else TICK_S

    def _step(self, rig: "Rig") -> float:
        """Compute one slice at most, so that nobody waits long for the rig; say how much is left."""
        began_s, rig_began_s = self._began_s
        target_s = rig_began_s + self.speed * (self._clock() - began_s)
        rig.advance_to(min(target_s, rig.now_s + SLICE_S))
        return target_s - rig.now_s
