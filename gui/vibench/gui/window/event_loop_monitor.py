"""How long the window keeps people waiting: the lateness of its own event loop, measured all the time."""

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
"""A wait of this length is felt: longer ones are noted with their moment."""
SPAN_S = 10.0
"""The longest wait that is shown is that of this many seconds."""
MOST_NOTED = 20
_DELAYS = "/proc/thread-self/schedstat"
"""Linux: for how long this thread could have run, and another one had the processor [ns]."""


@dataclass(frozen=True)
class Wait:
    """One time that the loop was busy with something else."""

    own_s: float
    """Without the time in which other programs had the processor, where the system tells."""
    busy_s: float
    """What this thread worked meanwhile: the same on an idle machine and on a busy one."""
    at: datetime
    about: str
    """What was in sight."""


class EventLoopMonitor(QObject):
    """A timer that notes how late it comes.

    Whatever keeps the thread keeps the timer: work, a file, a lock, another thread of Python.
    What other programs take of the processor is distinguished, so that a busy machine is not
    blamed on the window.
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
        """The longest own wait of the newest seconds."""
        self._forget()
        return max((own_s for _, own_s, _ in self._waits), default=0.0)

    @property
    def busiest_s(self) -> float:
        """The longest stretch of work of the newest seconds [s of processor time]."""
        self._forget()
        return max((busy_s for _, _, busy_s in self._waits), default=0.0)

    @property
    def rounds(self) -> int:
        """How often the loop was looked at in the newest seconds."""
        self._forget()
        return len(self._waits)

    @property
    def noted(self) -> tuple[Wait, ...]:
        """Waits over the bound, the newest last."""
        return tuple(self._noted)

    def begin(self) -> None:
        """Forget what was: from here on it counts."""
        self._waits.clear()
        self._noted.clear()
        self._before = self._clocks()

    def stop(self) -> None:
        """Look no more."""
        self._timer.stop()
        self._delays.close()

    @property
    def text(self) -> str:
        """Return what was noted, the newest first."""
        said = [f"Longest wait for the window in the last {SPAN_S:.0f} s: {1e3 * self.longest_s:.0f} ms."]
        said += [
            f"{each.at:%H:%M:%S}  {each.about}: {1e3 * each.own_s:.0f} ms" for each in reversed(self._noted)
        ]
        return "\n".join(said)

    def _look(self) -> None:
        now = self._clocks()
        passed_s, busy_s, delayed_s = (new - old for new, old in zip(now, self._before, strict=True))
        self._before = now
        own_s = max(0.0, passed_s - delayed_s - 1e-3 * EVERY_MS)
        self._waits.append((now[0], own_s, busy_s))
        if own_s > BOUND_S:
            self._noted.append(Wait(own_s, busy_s, datetime.now().astimezone(), self._about()))

    def _clocks(self) -> tuple[float, float, float]:
        """Time, this thread's work, and for how long it had to wait for a processor [s]."""
        return monotonic(), thread_time(), self._delays.read_s()

    def _forget(self) -> None:
        now_s = monotonic()
        while self._waits and now_s - self._waits[0][0] > SPAN_S:
            self._waits.popleft()


class _Delays:
    """Reads for how long this thread waited for a processor; always zero where nobody tells."""

    def __init__(self) -> None:
        try:
            self._file = os.open(_DELAYS, os.O_RDONLY)
        except OSError:
            self._file = -1

    def read_s(self) -> float:
        """Since the thread began [s]."""
        if self._file < 0:
            return 0.0
        return 1e-9 * int(read_at(self._file, 100, 0).split()[1])

    def close(self) -> None:
        """Let the file go."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1
