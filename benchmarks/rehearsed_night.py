"""A night rehearsed: eight hours of rig time, unattended, with a script of twenty faults.

    python benchmarks/rehearsed_night.py [HOURS]

A campaign of dwells and sweeps runs in this process as `vibench measure` runs it, on the virtual rig at
12.8 kS/s, with the faults of hardware_configs/faults/night.toml (their times scaled to the length of the
night), three attempts a point, and going on after failures. Printed are memory and open files at every
tenth of the night, how every point came out, and how much faster than the wall clock it went.
"""

import os
import resource
import sys
import tempfile
import time
from collections import Counter
from contextlib import closing
from pathlib import Path

from acquisition.campaign.happening import Happening
from acquisition.campaign.item import AfterFailure, CampaignItem
from acquisition.campaign.run_campaign import ignore_happening
from acquisition.engine.engine import Engine
from acquisition.engine.orders import Orders
from acquisition.engine.state import Attendance
from acquisition.plan.campaign import Campaign
from acquisition.rig.configuration import Rig, load_rig
from acquisition.virtual.fault_script import load_fault_script

ROOT = Path(__file__).resolve().parent.parent
HOUR_S = 3600.0
NIGHT_S = 8 * HOUR_S
RATE_HZ = 12_800.0
POINT_S = 120.0
TENTHS = 10


def campaign(duration_s: float) -> Campaign:
    """Dwells at rising frequencies, up and down, at two levels."""
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
    """Give the virtual rig at the rate of the night, with its faults at their share of the time."""
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
            "virtual": rig.virtual.model_copy(update={"faults": path}),
        }
    )


def main() -> None:
    """Live through the night and tell."""
    duration_s = HOUR_S * float(sys.argv[1]) if len(sys.argv) > 1 else NIGHT_S
    with tempfile.TemporaryDirectory() as temporary, closing(Engine(Attendance.UNATTENDED)) as engine:
        folder = Path(temporary)
        plan = campaign(duration_s)
        engine.open(rig_of(folder, duration_s))
        names = plan.recording_names()
        print(f"{len(names)} points, {plan.duration_s / HOUR_S:.2f} h of rig time planned", flush=True)
        began_s = time.monotonic()
        done: list[CampaignItem] = []

        def ended(item: CampaignItem) -> None:
            done.append(item)
            if len(done) % max(1, len(names) // TENTHS) == 0:
                told = f"{len(done):4} points  {resident_mb():6.0f} MB  {open_files():4} files open"
                print(f"{told}  {time.monotonic() - began_s:6.0f} s", flush=True)

        def happened(happening: Happening) -> None:
            print(f"      {happening}"[:160], flush=True)

        orders = Orders(campaign=plan, folder=folder / "night", after_failure=AfterFailure.GO_ON)
        engine.measure(orders, ended, happened if "--say" in sys.argv else ignore_happening)
        wall_s = time.monotonic() - began_s
        print(f"points: {dict(Counter(item.result.value for item in done))} of {len(names)}")
        print(f"unaccounted for: {sorted(set(names) - {item.name for item in done})}")
        for item in done:
            if item.result.value != "recorded":
                print(f"  {item.name}: {item.reason[:200]}")
        print(f"{wall_s:.0f} s of wall time; {plan.duration_s / wall_s:.0f} times real time")


def resident_mb() -> float:
    """Memory that the process holds now [MB]."""
    for line in Path("/proc/self/status").read_text(encoding="utf-8").splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def open_files() -> int:
    """Descriptors that the process holds now."""
    return len(os.listdir("/proc/self/fd"))  # noqa: PTH208 - numbers, not paths


if __name__ == "__main__":
    main()
