"""Silences a drive whose run stands still, whatever holds the run up."""

from collections.abc import Callable
from time import monotonic

from ..host import ClosedOnLeaving
from ..stopping import DRIVES_ON, MEMORY_RESERVE, Cause, StopLevel, StopRequest, StopSwitch, Watchdog
from ._acquisition_loop import BLOCK_S
from ._drive import Drive

STANDSTILL_BLOCKS = 50
"""A run is silenced that has read nothing for so many blocks: half of what a converter's buffer holds."""
STOPPED_BLOCKS = 15
"""The same once somebody has asked for a stop."""
_LONGEST_ROUND_S = 0.1
"""A round that took longer was not the run's fault: the whole process stood still or waited."""


class DriveGuard(ClosedOnLeaving):
    """Has all that silencing needs before the drive begins: a thread, memory, and the request to end.

    A run tells it when its drive begins, and of every block. From then on the drive counts as on, for whoever
    stops this process, until its output was read back as off.
    """

    def __init__(
        self, drive: Drive, switch: StopSwitch, is_heard: Callable[[], bool] = lambda: False
    ) -> None:
        """``is_heard``: whether the drive was still measured after its output was told to be off.

        Raises AcquisitionError when there is no memory to be held back, or no thread.
        """
        MEMORY_RESERVE.hold()
        self._drive = drive
        self._switch = switch
        self._is_heard = is_heard
        reason = f"the run has stood still for {STANDSTILL_BLOCKS * BLOCK_S:g} s"
        self._standstill = StopRequest(Cause.FAULT, StopLevel.OFF, reason)
        self._blocks = self._seen = 0
        self._still_s, self._round_s = 0.0, monotonic()
        self._has_begun = self._is_cut = self._is_leaving = False
        self._watchdog = Watchdog(self._look, "drive guard")

    def begin(self) -> None:
        """Note that the drive begins."""
        DRIVES_ON.begin(self)
        self._still_s, self._has_begun = 0.0, True

    def advance(self) -> None:
        """Note that the run has read a block."""
        self._blocks += 1
        DRIVES_ON.note_advance()

    def silence(self) -> None:
        """Silence the drive as `Drive.silence` does; where memory is short, with what was held back."""
        self._is_leaving = True
        try:
            self._drive.silence()
        except MemoryError:
            MEMORY_RESERVE.release()
            self._drive.silence()
        self._has_begun = False
        self._confirm()

    def close(self) -> None:
        """End the watch. Legal at any time; a drive whose silence nobody has confirmed stays known as on."""
        self._watchdog.close()

    def _look(self) -> None:
        now_s = monotonic()
        self._still_s += min(now_s - self._round_s, _LONGEST_ROUND_S)
        self._round_s = now_s
        if self._blocks != self._seen:
            self._seen, self._still_s, self._is_cut = self._blocks, 0.0, False
        is_stopping = self._is_leaving or self._switch.request is not None
        blocks = STOPPED_BLOCKS if is_stopping else STANDSTILL_BLOCKS
        if self._has_begun and self._still_s > blocks * BLOCK_S:
            self._silence_standstill()

    def _silence_standstill(self) -> None:
        if self._is_cut:
            return
        if not self._is_leaving:
            self._switch.ask(self._standstill)
        self._drive.cut()
        self._is_cut = True
        self._confirm()

    def _confirm(self) -> None:
        if not self._is_heard():
            DRIVES_ON.confirm_silence(self)
