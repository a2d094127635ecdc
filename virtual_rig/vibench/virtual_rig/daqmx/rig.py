"""The rig behind the simulated driver, and the passing of rig time: on demand or in real time."""

import math
import threading
import time
from collections.abc import Callable
from typing import Any

from nidaqmx.error_codes import DAQmxErrors

from vibench.acquisition import AcquisitionError

from ..world.world import World
from .devices import Catalogue
from .errors import DaqmxRefusal
from .streams import Acquisition, Generation

QUESTION_S = 0.1
"""Rig time that a query of progress adds when nothing else advances time [s].

Without this time, a program that polls the number of samples would never end."""

FAILED_CALL_S = 0.5
"""Rig time added by each repeated failure of a call, with time on demand [s].

Without this time, a temporary fault would never end for a program that retries."""

TICK_S = 0.02
"""Interval of updates in real time while a task runs [s], well below the usual read times."""
SLICE_S = 0.1
"""Longest rig time computed without releasing the lock [s]; also the update interval if no task runs."""

YIELD_S = 1e-4
"""Pause between two slices of rig time while the rig lags behind the clock [s]."""


class Rig:
    """Rig that advances the world and all running tasks together.

    ``changed`` guards tasks and trigger lines. The world has its own lock, because other threads use it.
    """

    def __init__(self, world: World, pace: "Pace", catalogue: Catalogue) -> None:
        self.world = world
        self.catalogue = catalogue
        self.pace = pace
        self.changed = threading.Condition(threading.RLock())
        self._epoch_s = time.time() - world.time_s
        self._acquisitions: list[Acquisition] = []
        self._generations: list[Generation] = []
        self._armed: dict[str, list[Callable[[], None]]] = {}
        self._holders: dict[str, Any] = {}
        """Tasks that have reserved the inputs or the outputs of a device."""

    @property
    def now_s(self) -> float:
        """Current rig time [s]."""
        return self.world.time_s

    @property
    def is_used(self) -> bool:
        """Whether any task runs."""
        return bool(self._acquisitions or self._generations)

    def wall_s(self, rig_s: float) -> float:
        """Return the wall-clock time for a rig time [s since 1970]; the two times agree at switch-on."""
        return self._epoch_s + rig_s

    def advance_to(self, until_s: float) -> None:
        """Advance in slices of rig time: feed the outputs, acquire the inputs, then advance all other parts.

        If the world fails, all running tasks and waiting calls end.
        """
        reached_s = self.now_s
        try:
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
        except AcquisitionError as error:
            lost = DaqmxRefusal(DAQmxErrors.DEV_CANNOT_BE_ACCESSED, str(error))
            for stream in (*self._acquisitions, *self._generations):
                stream.failure = lost
            raise lost from error
        finally:
            self.changed.notify_all()

    def run(self, stream: Acquisition | Generation) -> None:
        """Let a stream advance with rig time from now on."""
        if isinstance(stream, Generation):
            stream.prepare(self.now_s)
            self._generations.append(stream)
        else:
            self._acquisitions.append(stream)
        self.changed.notify_all()

    def end(self, stream: Acquisition | Generation) -> None:
        """Close a stream, so that it no longer advances with rig time."""
        stream.close()
        self._acquisitions = [other for other in self._acquisitions if other is not stream]
        self._generations = [other for other in self._generations if other is not stream]
        self.changed.notify_all()

    def reserve(self, resource: str, task: Any) -> None:
        """Reserve the inputs or outputs of a device for a task (-50103 if another task has reserved them)."""
        other = self._holders.setdefault(resource, task)
        if other is not task:
            detail = f"Resource: {resource}, held by task {other.name}\nTask Name: {task.name}"
            raise DaqmxRefusal(DAQmxErrors.PAL_RESOURCE_RESERVED, detail)

    def release(self, task: Any) -> None:
        """Release all reservations of a task."""
        self._holders = {resource: other for resource, other in self._holders.items() if other is not task}

    def require_terminal(self, name: str) -> None:
        """Refuse an unknown terminal (-89120)."""
        known = {known.lower() for device in self.catalogue.devices for known in device.terminals}
        if name.lower() not in known:
            detail = f"Source Terminal: {name}"
            raise DaqmxRefusal(DAQmxErrors.INVALID_ROUTING_SOURCE_TERMINAL_NAME_ROUTING, detail)

    def arm(self, terminal: str, begin: Callable[[], None]) -> None:
        """Call the function ``begin`` at the next edge on a terminal."""
        self._armed.setdefault(terminal.lower(), []).append(begin)

    def disarm(self, begin: Callable[[], None]) -> None:
        """Cancel a function that waits for an edge."""
        self._armed = {
            terminal: [other for other in waiting if other != begin]
            for terminal, waiting in self._armed.items()
        }

    def edge(self, terminal: str) -> None:
        """Apply a rising edge to a terminal, and call all functions that wait for this edge."""
        for begin in self._armed.pop(terminal.lower(), []):
            begin()
        self.changed.notify_all()


def _wait(rig: "Rig", is_there: Callable[[], bool], deadline_s: float) -> bool:
    left_s = None if math.isinf(deadline_s) else max(0.0, deadline_s - time.monotonic())
    return rig.changed.wait_for(is_there, left_s)


# Two rules by which rig time passes. Both have the same methods, called while ``rig.changed`` is locked.


class OnDemandPace:
    """Pace FREE: samples exist when requested. Nothing waits or is lost; runs are repeatable bit for bit."""

    loses_samples = False

    def open(self, rig: "Rig") -> None:
        """Do nothing, because time advances only on request."""

    def close(self) -> None:
        """Do nothing, because there is no clock to stop."""

    def ask(self, rig: "Rig", until_s: float, is_there: Callable[[], bool], deadline_s: float) -> bool:
        """Advance time at once; wait only for events from other calls, such as a trigger.

        ``until_s`` is the rig time at which ``is_there()`` is expected (infinite if other calls decide);
        ``deadline_s`` is a time of the monotonic clock. Return whether ``is_there()`` became true.
        """
        if is_there():
            return True
        if until_s < math.inf:
            rig.advance_to(until_s)
            return is_there()
        return _wait(rig, is_there, deadline_s)

    def pass_time(self, rig: "Rig", duration_s: float) -> None:
        """Advance by ``duration_s``, so that a polling program does not wait forever."""
        rig.advance_to(rig.now_s + duration_s)


class WallPace:
    """Pace WALL: rig time follows a clock at ``speed``; late readers lose samples, early readers wait.

    If the world is computed too slowly, samples come late but stay correct.
    """

    loses_samples = True

    def __init__(self, speed: float = 1.0, clock: Callable[[], float] = time.monotonic) -> None:
        """Follow ``clock`` [s], which may be any monotonic clock."""
        if not 0 < speed < float("inf"):
            message = f"the speed of the rig is {speed} times real time; it must be above 0 and finite"
            raise ValueError(message)
        self.speed = speed
        self._clock = clock
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        self._began_s = (0.0, 0.0)

    def open(self, rig: "Rig") -> None:
        """Start the clock, and the thread that advances the rig."""
        self._began_s = (self._clock(), rig.now_s)
        self._closing.clear()
        self._thread = threading.Thread(target=self._keep_up, args=(rig,), name="rig clock", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop the clock and the thread that advances the rig."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join()

    def ask(self, rig: "Rig", until_s: float, is_there: Callable[[], bool], deadline_s: float) -> bool:  # noqa: ARG002 - this clock needs no hint
        """Wait until ``is_there()`` is true or the deadline passes; return whether it became true."""
        self._step(rig)
        return is_there() or _wait(rig, is_there, deadline_s)

    def pass_time(self, rig: "Rig", duration_s: float) -> None:  # noqa: ARG002 - time passes by itself
        """Advance the rig to the present time of the clock."""
        self._step(rig)

    def _keep_up(self, rig: "Rig") -> None:
        pause_s = TICK_S
        while not self._closing.wait(pause_s):
            with rig.changed:
                try:
                    behind_s = self._step(rig)
                except AcquisitionError:
                    return  # the world failed; the next call reports this
                is_used = rig.is_used
            pause_s = YIELD_S if behind_s > 0 else TICK_S if is_used else SLICE_S

    def _step(self, rig: "Rig") -> float:
        """Compute at most one slice, so that the lock is released soon; return how far the rig lags [s]."""
        began_s, rig_began_s = self._began_s
        target_s = rig_began_s + self.speed * (self._clock() - began_s)
        rig.advance_to(min(target_s, rig.now_s + SLICE_S))
        return target_s - rig.now_s


Pace = OnDemandPace | WallPace
