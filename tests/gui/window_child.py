"""A real window with a long measurement in real time, to be killed or frozen by a test."""

import sys
from pathlib import Path

from PySide6.QtCore import QTimer

from vibench.acquisition.engine import CampaignRequest, EngineClient, EngineState, Supervision
from vibench.acquisition.plan import Campaign
from vibench.acquisition.rig import load_rig
from vibench.gui.page.app_context import AppContext, Settings
from vibench.gui.window.window import PAGES, Window, application

DWELL = {"kind": "dwell", "amplitude_vpp": 1.5, "frequency_hz": 260, "settle_s": 0.2, "duration_s": 600}
PLAN = {
    "name": "trial",
    "measurements": [{"name": "run", "ramp_s": 0.3, "ramp_step_s": 0.03, "excitation": DWELL}],
}


def main(folder: Path, config: Path, attendance: Supervision, patience_s: float) -> None:
    """Open the window and measure until killed."""
    rig = load_rig(config)
    rig = rig.model_copy(update={"virtual": rig.virtual.model_copy(update={"pace": "wall"})})
    app = application(["vibench"])
    window = Window(AppContext(Settings(folder / "window.ini")), PAGES)
    window.show()
    bridge = window.context.bridge
    bridge.open(rig, None)
    done: list[str] = []

    def go_on() -> None:
        """Take the next step when the engine has reached the required state."""
        run = None if bridge.status is None else bridge.status.run
        match done, bridge.state:
            case [], EngineState.READY:
                done.append("armed")
                bridge.arm(
                    CampaignRequest(
                        campaign=Campaign.model_validate(PLAN),
                        folder=folder / "recordings",
                        attendance=attendance,
                        longest_patience_s=patience_s,
                    )
                )
            case ["armed"], EngineState.ARMED:
                done.append("started")
                bridge.order(EngineClient.start)
            case ["armed", "started"], EngineState.RUNNING if run is not None and run.segment == "dwell":
                done.append("told")
                print("running", flush=True)  # noqa: T201 - output for the test

    timer = QTimer()
    timer.timeout.connect(go_on)
    timer.start(20)
    app.exec()


if __name__ == "__main__":  # the window's own workers import this file
    main(Path(sys.argv[1]), Path(sys.argv[2]), Supervision(sys.argv[3]), float(sys.argv[4]))
