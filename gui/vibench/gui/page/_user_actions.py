"""What keys, menus and buttons ask for: each action once, wherever it comes from."""

from pathlib import Path

from PySide6.QtCore import QObject

from vibench.acquisition import StopLevel
from vibench.acquisition.campaign import ExistingRecordings
from vibench.acquisition.engine import EngineClient, EngineState
from vibench.acquisition.plan import Campaign, Measurement

from ..widgets import Notice, NoticeKind
from ._app_context import AppContext

OPERATOR_STOP = "stopped by the operator, in the window"
ABORT_KEY = "aborted by the key, in the window"
LONGEST_NAME = 60


class UserActions(QObject):
    """Carries out what a person wants, or says why not."""

    def __init__(self, context: AppContext, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._context = context

    def check(self) -> None:
        """Check the bench."""
        folder = self._context.folder
        folder.mkdir(parents=True, exist_ok=True)
        self._context.bridge.order(EngineClient.check, folder)

    def arm_test(self) -> None:
        """Arm the test of the Test page, under a name that is free."""
        measurement = self._context.selection.measurement
        if measurement is None:
            self._warn("The test is not complete.", "Correct what is marked on the Test page (Ctrl+2).")
            return
        folder = self._context.folder
        named = measurement.model_copy(update={"name": free_name(folder, measurement)})
        self._context.bridge.arm(Campaign(name=named.name, measurements=(named,)), folder)

    def arm_campaign(self, existing: ExistingRecordings = ExistingRecordings.REFUSE) -> None:
        """Arm the campaign of the Queue page, in a folder of its name."""
        campaign = self._context.selection.campaign
        if campaign is None:
            self._warn("There is no campaign.", "Open or make one on the Queue page.")
            return
        self._context.bridge.arm(campaign, self._context.folder / campaign.name, existing)

    def disarm(self) -> None:
        """Take back what is armed."""
        self._context.bridge.order(EngineClient.disarm)

    def start(self) -> None:
        """Start what is armed."""
        if self._context.bridge.state is not EngineState.ARMED:
            self._warn("Nothing is armed.", "Arm the test first (Ctrl+Return).")
            return
        self._context.bridge.order(EngineClient.start)

    def stop(self) -> None:
        """Ramp down as planned; asked again while ramping down: as fast as the shaker bears."""
        is_ramping = self._context.bridge.state is EngineState.RAMPING_DOWN
        self._context.bridge.stop(StopLevel.ABORT if is_ramping else StopLevel.RAMP, OPERATOR_STOP)

    def abort(self) -> None:
        """Ramp down as fast as the shaker bears."""
        self._context.bridge.stop(StopLevel.ABORT, ABORT_KEY)

    def hold_or_resume(self) -> None:
        """Stay where the run is, drive included; or go on."""
        if self._context.bridge.state is EngineState.HELD:
            self._context.bridge.order(EngineClient.resume)
        else:
            self._context.bridge.stop(StopLevel.HOLD, "held by the operator, in the window")

    def _warn(self, what: str, next_step: str) -> None:
        self._context.say(Notice(NoticeKind.WARNING, what, next_step=next_step))


def free_name(folder: Path, measurement: Measurement) -> str:
    """Give a test a number, so that nothing of that name lies in the folder: ``dwell_003``."""
    stem = measurement.name[:LONGEST_NAME]
    number = 1
    while any(folder.glob(f"{stem}_{number:03}*")):
        number += 1
    return f"{stem}_{number:03}"
