"""How many pictures a second are drawn, as told by those of the last second."""

from collections import deque
from time import monotonic

SPAN_S = 1.0


class FrameCount:
    """Counts frames as they are drawn."""

    def __init__(self) -> None:
        self._drawn_s: deque[float] = deque()

    def counted(self) -> float:
        """Count one more, and give the frames of the last second [1/s]."""
        now_s = monotonic()
        self._drawn_s.append(now_s)
        while now_s - self._drawn_s[0] > SPAN_S:
            self._drawn_s.popleft()
        return len(self._drawn_s) / SPAN_S
