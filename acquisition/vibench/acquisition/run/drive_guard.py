"""Watches a run and silences its drive when the run reads no more blocks."""

from collections.abc import Callable
from time import monotonic

from ..host.closed_on_leaving import ClosedOnLeaving
from ..stopping.driving import DRIVES_ON
from ..stopping.memory_reserve import MEMORY_RESERVE
from ..stopping.stop import Cause, StopLevel, StopRequest, StopSwitch
from ..stopping.watchdog import Watchdog
from .acquisition_loop import BLOCK_S
from .drive import Drive

STANDSTILL_BLOCKS = 50
"""Blocks without reading after which a drive is silenced: half of what a converter's buffer holds."""
STOPPED_BLOCKS = 15
"""The same after a stop was requested."""
_LONGEST_ROUND_S = 0.1
"""Longest interval between two checks that counts [s]: in a longer one the whole process was suspended."""


class DriveGuard(ClosedOnLeaving):
    """Reserves what silencing needs before the drive begins: a thread, memory, and the request to end.

    The run calls it when its drive begins and after every block. From then on a stop of this process counts
    the drive as on, until its output was read back as off.
    """

    def __init__(
        self, drive: Drive, switch: StopSwitch, is_heard: Callable[[], bool] = lambda: False
    ) -> None:
        """``is_heard``: whether the drive was still measured after its output was switched off.

        Raises AcquisitionError when the system gives no memory for the reserve, or no thread.
        """
        MEMORY_RESERVE.hold()
        self._drive = drive
        self._switch = switch
        self._is_heard = is_heard
        reason = (
            f"the run read no samples for {STANDSTILL_BLOCKS * BLOCK_S:g} s; its output was switched off. "
            "Look for what holds up this computer or its disk, then start again"
        )
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
        """Silence the drive with `Drive.silence`; where memory is exhausted, release the reserve first."""
        self._is_leaving = True
        try:
            self._drive.silence()
        except MemoryError:
            MEMORY_RESERVE.release()
            self._drive.silence()
        self._has_begun = False
        self._confirm()

    def close(self) -> None:
        """Stop watching. Legal at any time; a drive that is not confirmed as off still counts as on."""
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
