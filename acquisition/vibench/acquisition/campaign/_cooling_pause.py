"""Silence between two recordings: specimen and amplifier cool."""

from ..bench import RunBench
from ..run import BLOCK_S
from ..stopping import StopSwitch
from ._event import Event, Happening, Listener


class Rest:
    """Rests before a recording when another one was made before it in this session.

    A stop ends it at once; a hold keeps it up until it is taken back. Nothing is written into the journal:
    the next point stays queued, so that a campaign that is killed here goes on as from between two points.
    """

    def __init__(self, rest_s: float, switch: StopSwitch, say: Listener) -> None:
        self._rest_s = rest_s
        self._switch = switch
        self._say = say
        self._is_due = False

    def owe(self) -> None:
        """Have the next recording wait: something has been played."""
        self._is_due = True

    def take(self, bench: RunBench, name: str) -> None:
        """Rest before the recording of a point, if it is due; the generator is off between recordings."""
        if not self._is_due or not self._rest_s:
            return
        self._is_due = False
        text = f"resting for {self._rest_s:g} s before {name}"
        self._say(Happening(Event.RESTING, text, {"point": name, "rest_s": self._rest_s}))
        left_s = self._rest_s
        while (left_s > 0 or self._switch.is_holding) and self._switch.request is None:
            piece_s = min(left_s, BLOCK_S) if left_s > 0 else BLOCK_S
            bench.idle(piece_s)
            left_s -= piece_s
