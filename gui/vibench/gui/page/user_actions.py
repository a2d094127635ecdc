"""Commands given by keys, menus and buttons; each command is implemented once."""

from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject

from vibench.acquisition import StopLevel
from vibench.acquisition.campaign import ExistingRecordings
from vibench.acquisition.engine import CampaignRequest, EngineClient, EngineState, Supervision
from vibench.acquisition.plan import Campaign, Measurement

from ..widgets.notice import RUN
from .app_context import AppContext

OPERATOR_STOP = "stopped by the operator, in the window"
ABORT_KEY = "aborted by the key, in the window"
LONGEST_NAME = 60


class UserActions(QObject):
    """Commands of the user; a command that is not possible at present shows a message with the reason."""

    def __init__(self, context: AppContext, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._context = context

    def check(self, *, new_reference: bool = False) -> None:
        """Check the bench; ``new_reference`` makes the result the reference of later checks."""
        if not self._may("check the bench", EngineState.READY):
            return
        self._context.bridge.order(EngineClient.check, self._context.folder, new_reference=new_reference)

    def complete_test(self) -> Measurement | None:
        """Return the test of the Test page; if the test is not complete, show a message and return None."""
        measurement = self._context.selection.measurement
        if measurement is None:
            next_step = "Correct the marked fields on the Test page (Ctrl+2)."
            self._context.warn("The test is not complete.", next_step=next_step)
        return measurement

    def arm_test(self) -> None:
        """Arm the test of the Test page, under a name that is not used in the folder."""
        measurement = self.complete_test()
        if measurement is None:
            return
        folder = self._context.folder
        named = measurement.model_copy(update={"name": free_name(folder, measurement)})
        self._arm(Campaign(name=named.name, measurements=(named,)), folder)

    def arm_campaign(self, existing: ExistingRecordings, attendance: Supervision) -> None:
        """Arm the campaign of the Queue page; recordings go into a folder named after the campaign."""
        campaign = self._context.selection.campaign
        if campaign is None:
            self._context.warn("There is no campaign.", next_step="Open a campaign on the Queue page.")
            return
        folder = self._context.folder / campaign.name
        self._arm(campaign, folder, existing=existing, attendance=attendance)

    def _arm(self, campaign: Campaign, folder: Path, **options: Any) -> None:
        if self._may("arm", EngineState.READY, EngineState.ARMED):
            patience_s = self._context.patience_s
            self._context.bridge.arm(
                CampaignRequest(campaign=campaign, folder=folder, longest_patience_s=patience_s, **options)
            )

    def disarm(self) -> None:
        """Disarm the armed plan."""
        self._context.bridge.order(EngineClient.disarm)

    def start(self) -> None:
        """Start the armed plan."""
        if not self._may("start", EngineState.ARMED):
            return
        if self._context.is_armed_read():
            self._context.bridge.order(EngineClient.start)
        else:
            self._context.warn(
                "Cannot start: the description of the test was not scrolled to its end.",
                next_step="Read the description on the Run page (Ctrl+3); PgDn scrolls.",
            )
            self._context.page_requested.emit(RUN)

    def stop(self) -> None:
        """Ramp down as planned; a second call during the ramp uses the shaker's fastest ramp."""
        is_ramping = self._context.bridge.state is EngineState.RAMPING_DOWN
        self._context.bridge.stop(StopLevel.ABORT if is_ramping else StopLevel.RAMP, OPERATOR_STOP)

    def abort(self) -> None:
        """Ramp down with the shaker's fastest ramp."""
        self._context.bridge.stop(StopLevel.ABORT, ABORT_KEY)

    def hold_or_resume(self) -> None:
        """Hold the run with the drive on, or resume the held run."""
        if self._context.bridge.state is EngineState.HELD:
            self._context.bridge.order(EngineClient.resume)
        else:
            self._context.bridge.stop(StopLevel.HOLD, "held by the operator, in the window")

    def _may(self, verb: str, *states: EngineState) -> bool:
        """Return whether a command is possible in the engine's state; if not, warn the user."""
        bridge = self._context.bridge
        if bridge.is_ordering:
            self._context.warn(
                f"Cannot {verb} yet: {_BUSY}.", next_step="Try again when the command has ended."
            )
        elif bridge.state not in states:
            self._context.warn(f"Cannot {verb}: {_STANDS[bridge.state]}.", next_step=_NEXT[bridge.state])
        else:
            return True
        return False


_BUSY = "the previous command is still running"
_STANDS = {
    EngineState.CLOSED: "no bench is open",
    EngineState.OPENING: "the bench is being opened",
    EngineState.READY: "nothing is armed",
    EngineState.CHECKING: "the bench is being checked",
    EngineState.ARMED: "a plan is armed",
    EngineState.RUNNING: "a measurement is running",
    EngineState.HELD: "a measurement is held with the drive on",
    EngineState.RAMPING_DOWN: "the drive is ramping down",
    EngineState.FAULT: "the bench has a fault and is closed",
}
_NEXT = {
    EngineState.CLOSED: "Open a bench on the Rig page (Ctrl+1).",
    EngineState.OPENING: "Wait for READY.",
    EngineState.READY: "Arm the test first (Ctrl+Return).",
    EngineState.CHECKING: "Wait for READY.",
    EngineState.ARMED: "Start the plan (F5), or disarm it (Cancel on the Run page).",
    EngineState.RUNNING: "Wait for the end of the measurement, or stop it (STOP, Esc).",
    EngineState.HELD: "Press 'Go on' (Run page), or stop the measurement (STOP, Esc).",
    EngineState.RAMPING_DOWN: "Wait for READY.",
    EngineState.FAULT: "See Details for the cause, then open the bench again on the Rig page (Ctrl+1).",
}


def free_name(folder: Path, measurement: Measurement) -> str:
    """Return a file name for a test that is not used in the folder, such as ``dwell_003``."""
    stem = measurement.name[:LONGEST_NAME]
    number = 1
    while any(folder.glob(f"{stem}_{number:03}*")):
        number += 1
    return f"{stem}_{number:03}"
