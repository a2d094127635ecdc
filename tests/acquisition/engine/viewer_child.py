"""A viewer that a test kills or freezes: it starts an engine, runs a campaign, and watches it for ever."""

import sys
from pathlib import Path
from threading import Event

from vibench.acquisition.engine import EngineState, start_engine
from vibench.acquisition.plan import Campaign
from vibench.acquisition.rig import Rig

PLAN = {
    "name": "trial",
    "measurements": [
        {
            "name": "run",
            "ramp_s": 0.3,
            "ramp_step_s": 0.03,
            "excitation": {
                "kind": "dwell", "amplitude_vpp": 1.5, "frequency_hz": 260, "settle_s": 0.2, "duration_s": 600
            },
        }
    ],
}  # fmt: skip

PAUSE = Event()

rig = Rig.model_validate_json(Path(sys.argv[1]).read_text())
with start_engine() as engine:
    client = engine.client
    client.open(rig)
    while client.status().state is EngineState.OPENING:
        PAUSE.wait(0.01)
    client.arm(Campaign.model_validate(PLAN), Path(sys.argv[2]))
    client.start()
    is_told = False
    while True:
        PAUSE.wait(0.01)
        run = client.status().run
        if run is not None and run.segment == "dwell" and not is_told:
            print("running", flush=True)  # noqa: T201 - its word to the test
            is_told = True
