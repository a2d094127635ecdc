"""Test an unattended night: eight hours of rig time with a script of twenty faults.

    python benchmarks/rehearsed_night.py [HOURS]

A campaign of dwells along branches runs in this process, as `vibench measure` would run it. The virtual rig
has four channels at 6.4 kS/s and 12.8 thousand steps a second. The faults are those of
hardware_configs/faults/night.toml, with times scaled to the length of the night. Each point has three
attempts, the campaign continues after failures, and it is resumed after a full disk. The script prints memory
and open files at every tenth of the night, the result of every point, and the speed relative to real time.
`--say` also prints all events.
"""

import os
import sys
import tempfile
import time
from collections import Counter
from contextlib import closing
from pathlib import Path

from sustained_recording import resident_mb

from vibench.acquisition import RecordingError
from vibench.acquisition.campaign import (
    AfterFailure,
    CampaignEvent,
    ExistingRecordings,
    PointOutcome,
    PointResult,
)
from vibench.acquisition.engine import CampaignRequest, Engine, Supervision
from vibench.acquisition.plan import Campaign
from vibench.acquisition.rig import Rig, load_rig
from vibench.virtual_rig import load_fault_script

ROOT = Path(__file__).resolve().parent.parent
HOUR_S = 3600.0
NIGHT_S = 8 * HOUR_S
RATE_HZ = 6400.0
GRID_RATE_HZ = 12_800.0
POINT_S = 120.0
TENTHS = 10
MORNINGS = 3


def campaign(duration_s: float) -> Campaign:
    """Return a campaign of dwells along branches, up and down in frequency, at two levels."""
    points = max(8, round(duration_s / POINT_S))
    steps = points // 4
    frequencies = {"start": 200.0, "stop": 200.0 + 100.0, "step": 100.0 / (steps - 1)}
    dwell = {"kind": "dwell", "settle_s": 5.0, "duration_s": POINT_S - 8.0}
    sweep = {
        "name": "night",
        "amplitude_vpp": [0.5, 1.5],
        "direction": ["up", "down"],
        "frequency_hz": frequencies,
        "continue_from_previous": "frequency_hz",
        "lead_s": 0.2,
        "measurement": {"excitation": dwell, "ramp_s": 0.5},
    }
    return Campaign.model_validate({"name": "night", "sweeps": [sweep], "retry": {"attempts": 3}})


def rig_of(folder: Path, duration_s: float) -> Rig:
    """Return the virtual rig with the sample rate and the scaled faults of the night."""
    script = load_fault_script(ROOT / "hardware_configs" / "faults" / "night.toml")
    lines = []
    for fault in script.faults:
        told = fault.model_dump(mode="json", exclude_none=True)
        told["at_s"] = fault.at_s * duration_s / NIGHT_S
        lines += ["[[faults]]", *(f"{key} = {value!r}".replace("'", '"') for key, value in told.items())]
    path = folder / "faults.toml"
    path.write_text("\n".join(lines), encoding="utf-8")
    rig = load_rig(ROOT / "hardware_configs" / "virtual_rig.toml")
    assert rig.virtual is not None
    return rig.model_copy(
        update={
            "daq": rig.daq.model_copy(update={"sample_rate_hz": RATE_HZ}),
            "virtual": rig.virtual.model_copy(update={"faults": str(path), "grid_rate_hz": GRID_RATE_HZ}),
        }
    )


class Account:
    """Results of all points, with memory and open files of the process."""

    def __init__(self, plan: Campaign) -> None:
        self._plan = plan
        self._names = plan.recording_names()
        self._began_s = time.monotonic()
        self._last: dict[str, PointResult] = {}

    def note_result(self, point_result: PointResult) -> None:
        """Record the result of a point; a resumed campaign reports the earlier points again."""
        is_new = self._last.get(point_result.name) is None
        self._last[point_result.name] = point_result
        if is_new and len(self._last) % max(1, len(self._names) // TENTHS) == 0:
            held = f"{resident_mb():6.0f} MB  {open_files():4} files open"
            print(f"{len(self._last):4} points  {held}  {self.wall_s:6.0f} s", flush=True)

    def note_event(self, event: CampaignEvent) -> None:
        """Print an event if `--say` was given."""
        if "--say" in sys.argv:
            print(f"{self.wall_s:7.1f} s {event.kind}: {event.text}"[:200], flush=True)

    @property
    def wall_s(self) -> float:
        """Elapsed time since the campaign began [s]."""
        return time.monotonic() - self._began_s

    def print_summary(self) -> None:
        """Print the summary of the night."""
        wall_s, used = self.wall_s, os.times()
        print(
            f"points: {dict(Counter(each.reason_code.value for each in self._last.values()))} "
            f"of {len(self._names)}"
        )
        print(f"unaccounted for: {sorted(set(self._names) - set(self._last))}")
        for point_result in self._last.values():
            if point_result.outcome not in (PointOutcome.RECORDED, PointOutcome.KEPT):
                print(f"  {point_result.name}: {point_result.reason[:200]}")
        cpu_s = used.user + used.system
        times = self._plan.duration_s / wall_s
        print(f"{wall_s:.0f} s of wall time ({times:.0f} times real time), {cpu_s:.0f} s of processor time")


def main() -> None:
    """Run the campaign and print the results."""
    duration_s = HOUR_S * float(sys.argv[1]) if len(sys.argv) > 1 else NIGHT_S
    with tempfile.TemporaryDirectory() as temporary, closing(Engine(Supervision.UNATTENDED)) as engine:
        folder = Path(temporary)
        plan = campaign(duration_s)
        rig = rig_of(folder, duration_s)
        engine.open(rig)
        points, load = len(plan.recording_names()), os.getloadavg()[0]
        print(f"{points} points, {plan.duration_s / HOUR_S:.2f} h of rig time planned; load {load:.1f}")
        account = Account(plan)
        orders = CampaignRequest(campaign=plan, folder=folder / "night", after_failure=AfterFailure.GO_ON)
        for _ in range(MORNINGS):
            try:
                engine.measure(orders, account.note_result, account.note_event)
                break
            except RecordingError as error:
                # Resume, as a user would after making room on the disk.
                print(f"ended: {str(error)[:150]}; resumed", flush=True)
                orders = orders.model_copy(update={"existing": ExistingRecordings.RESUME})
        account.print_summary()
        print(f"faults played: {len(engine.played_faults)}; load {os.getloadavg()[0]:.1f}")


def open_files() -> int:
    """Return the present number of open file descriptors."""
    return len(os.listdir("/proc/self/fd"))  # noqa: PTH208 - numbers, not paths


if __name__ == "__main__":
    main()
