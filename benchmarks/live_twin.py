"""Measure cost and lag of the live twin, in a measurement on the virtual rig in real time.

    python benchmarks/live_twin.py                     # a chaotic dwell; its gaps widen by 1 um in the middle
    python benchmarks/live_twin.py --duration 300 --level 2 --widen 0

The lag is the time from the conversion of the newest sample with an estimate of p until a viewer has the
estimate. It includes engine and protocol.
"""

import argparse
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from vibench.acquisition import open_recording
from vibench.acquisition.check.admission import CheckRule
from vibench.acquisition.engine import (
    DRIVING,
    CampaignRequest,
    EngineClient,
    EngineState,
    EngineStatus,
    Supervision,
    TwinSwitch,
    start_engine,
)
from vibench.acquisition.plan import Campaign
from vibench.acquisition.rig import load_rig, with_faults

RIG = Path(__file__).parents[1] / "hardware_configs" / "virtual_rig.toml"
LOOK_S = 0.01


@dataclass
class SeenEstimates:
    """Estimates that a viewer has received."""

    start_s: float = np.inf
    """Latest possible time of the conversion of the first sample, on the monotonic clock [s]."""
    reports: list[tuple[float, int, str]] = field(default_factory=list)
    last: EngineStatus | None = None

    def look(self, status: EngineStatus, rate_hz: float) -> None:
        """Record the time and a new estimate, if any."""
        now_s = time.monotonic()
        if status.samples:
            self.start_s = min(self.start_s, now_s - status.samples / rate_hz)
        told = status.twin
        if told is None or not told.end_sample or status.state not in DRIVING:
            return
        self.last = status
        if not self.reports or self.reports[-1][1] != told.end_sample:
            self.reports.append((now_s, told.end_sample, told.state))

    def lags_s(self, rate_hz: float) -> np.ndarray:
        """Return the lags of all estimates that the twin tracked."""
        return np.array(
            [now - self.start_s - end / rate_hz for now, end, state in self.reports if state == "tracked"]
        )


def campaign(duration_s: float, level_vpp: float) -> Campaign:
    """Return a campaign of one dwell."""
    dwell = {
        "kind": "dwell",
        "amplitude_vpp": level_vpp,
        "frequency_hz": 260,
        "settle_s": 1.0,
        "duration_s": duration_s,
    }
    return Campaign.model_validate(
        {"name": "live", "measurements": [{"name": "dwell", "excitation": dwell, "ramp_s": 0.5}]}
    )


def watch_run(client: EngineClient, rate_hz: float) -> SeenEstimates:
    """Poll the status until the run has ended."""
    seen = SeenEstimates()
    while (status := client.status()).state is not EngineState.READY or not seen.reports:
        seen.look(status, rate_hz)
        time.sleep(LOOK_S)
    return seen


def main() -> None:
    """Measure with a live twin, and print lag and cost."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--duration", type=float, default=60.0)
    parser.add_argument("--level", type=float, default=1.5, help="[Vpp]")
    parser.add_argument("--widen", type=float, default=1.0, help="both gaps, in the middle [um]")
    asked = parser.parse_args()
    rig = load_rig(RIG)
    rig = rig.model_copy(update={"virtual": rig.virtual.model_copy(update={"pace": "wall"})})
    with tempfile.TemporaryDirectory() as folder, start_engine(Supervision.UNATTENDED) as engine:
        if asked.widen:
            script = Path(folder) / "faults.toml"
            fault = f'fault = "widen_gaps"\nby_m = {1e-6 * asked.widen}\n'
            script.write_text(f"[[faults]]\nat_s = {asked.duration / 2}\n{fault}")
            rig = with_faults(rig, script)
        client = engine.client
        client.open(rig)
        while (status := client.status()).state is not EngineState.READY:
            time.sleep(LOOK_S)
        rate_hz = status.bench.sample_rate_hz
        plan = campaign(asked.duration, asked.level)
        request = CampaignRequest(
            campaign=plan, folder=Path(folder), check=CheckRule.WAIVED, twin=TwinSwitch.ON
        )
        client.arm_request(request)
        client.start()
        seen = watch_run(client, rate_hz)
        with open_recording(Path(folder) / "dwell.h5") as recording:
            said = [each for each in recording.events if each.kind == "specimen"]
            lost = len(recording.gaps)
    lags, twin = seen.lags_s(rate_hz), seen.last.twin
    middle, late, most = np.quantile(lags, (0.5, 0.95, 1.0)) if lags.size else (np.nan,) * 3
    print(
        f"lag: median {middle:.3f} s, 95 % below {late:.3f} s, largest {most:.3f} s, of {lags.size} pictures"
    )
    print(f"processor: {100 * twin.busy_share:.0f} % of one core; missed at its start {twin.missed_s:.1f} s")
    print(f"holes in the recording: {lost}")
    for each in said:
        print(f"at {each.sample / rate_hz:.2f} s: {each.text}")


if __name__ == "__main__":
    main()
