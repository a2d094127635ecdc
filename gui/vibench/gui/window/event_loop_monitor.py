"""Monitor of the event loop: measures for how long the window does not respond."""

import os
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from time import monotonic, thread_time

from PySide6.QtCore import QObject, Qt, QTimer

from vibench.sim.operating_system.this import read_at

EVERY_MS = 20
BOUND_S = 0.1
"""Delay of the event loop that users notice [s]; longer delays are logged."""
SPAN_S = 10.0
"""Period for which the longest delay is reported [s]."""
MOST_NOTED = 20
_DELAYS = "/proc/thread-self/schedstat"
"""File in which Linux states for how long this thread has waited for a processor [ns]."""


@dataclass(frozen=True)
class Wait:
    """A delay of the event loop."""

    own_s: float
    """Delay [s], without the time spent waiting for a processor if the operating system reports this time."""
    busy_s: float
    """Processor time of this thread during the delay [s], which does not depend on other programs."""
    at: datetime
    about: str


class EventLoopMonitor(QObject):
    """Timer that measures its own delays.

    Work in this thread, file access, locks and other Python threads delay the timer. The time spent waiting
    for a processor is subtracted, so that other programs on the computer do not count.
    """

    def __init__(self, about: Callable[[], str], parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._about = about
        self._waits: deque[tuple[float, float, float]] = deque()
        self._noted: deque[Wait] = deque(maxlen=MOST_NOTED)
        self._delays = _Delays()
        self._before = self._clocks()
        self._timer = QTimer(self, interval=EVERY_MS, timerType=Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self._look)
        self._timer.start()

    @property
    def longest_s(self) -> float:
        """Longest delay in the last `SPAN_S`, without the time spent waiting for a processor [s]."""
        self._forget()
        return max((own_s for _, own_s, _ in self._waits), default=0.0)

    @property
    def busiest_s(self) -> float:
        """Largest processor time between two timer events in the last `SPAN_S` [s]."""
        self._forget()
        return max((busy_s for _, _, busy_s in self._waits), default=0.0)

    @property
    def rounds(self) -> int:
        """Number of timer events in the last `SPAN_S`."""
        self._forget()
        return len(self._waits)

    @property
    def long_waits(self) -> tuple[Wait, ...]:
        """Delays of the event loop above `BOUND_S`, the newest last."""
        return tuple(self._noted)

    def begin(self) -> None:
        """Discard all measured delays and start again."""
        self._waits.clear()
        self._noted.clear()
        self._before = self._clocks()

    def stop(self) -> None:
        """Stop the measurement of delays."""
        self._timer.stop()
        self._delays.close()

    @property
    def text(self) -> str:
        """The longest delay and the logged delays, newest first, as text."""
        lines = [f"Longest wait for the window in the last {SPAN_S:.0f} s: {1e3 * self.longest_s:.0f} ms."]
        lines += [
            f"{each.at:%H:%M:%S}  {each.about}: {1e3 * each.own_s:.0f} ms" for each in reversed(self._noted)
        ]
        return "\n".join(lines)

    def _look(self) -> None:
        now = self._clocks()
        elapsed_s, busy_s, delayed_s = (new - old for new, old in zip(now, self._before, strict=True))
        self._before = now
        own_s = max(0.0, elapsed_s - delayed_s - 1e-3 * EVERY_MS)
        self._waits.append((now[0], own_s, busy_s))
        if own_s > BOUND_S:
            self._noted.append(Wait(own_s, busy_s, datetime.now().astimezone(), self._about()))

    def _clocks(self) -> tuple[float, float, float]:
        """Return clock time, and this thread's processor time and time spent waiting for a processor [s]."""
        return monotonic(), thread_time(), self._delays.read_s()

    def _forget(self) -> None:
        now_s = monotonic()
        while self._waits and now_s - self._waits[0][0] > SPAN_S:
            self._waits.popleft()


class _Delays:
    """Reader of the time that this thread waited for a processor; zero if the system reports none."""

    def __init__(self) -> None:
        try:
            self._file = os.open(_DELAYS, os.O_RDONLY)
        except OSError:
            self._file = -1

    def read_s(self) -> float:
        """Return how long this thread has waited for a processor since its start [s]."""
        if self._file < 0:
            return 0.0
        return 1e-9 * int(read_at(self._file, 100, 0).split()[1])

    def close(self) -> None:
        """Close the file in which the operating system reports the waiting time."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1
