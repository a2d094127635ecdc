"""Compare a dwell in retriggered bursts (dead man's switch) with a continuous dwell.

    python benchmarks/dead_man.py

In windows of five periods, the response of m0 is divided by the drive, both at the drive frequency. The
median over the continuous dwell is the reference. A window is disturbed if it differs from the reference by
more than 5 %, and by more than 99 of 100 windows of the continuous dwell do. The table shows the share of
time in which the drive is silent, the share of disturbed windows, and how long a gap has an effect.
"""

import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vibench.acquisition import open_bench, open_recording
from vibench.acquisition.plan import Dwell, Measurement
from vibench.acquisition.rig import load_rig
from vibench.acquisition.run.run import run_measurement

RIG = Path(__file__).parent.parent / "hardware_configs" / "virtual_rig.toml"
LENGTHS_S = (0.5, 1.0, 2.0, 5.0)
CASES = {"no impacts, 180 Hz": (180.0, 0.2), "impacts, 260 Hz": (260.0, 1.5)}
DURATION_S = 30.0
PERIODS = 5
FELT = 0.05
SILENT_V = 5e-3


def measure(dead_man_s: float | None, frequency_hz: float, amplitude_vpp: float) -> tuple[float, NDArray]:
    """Return the share of silence of one dwell, and response over drive in each window."""
    rig = load_rig(RIG)
    guarded = rig.model_copy(
        update={"generator": rig.generator.model_copy(update={"dead_man_s": dead_man_s})}
    )
    excitation = Dwell(
        amplitude_vpp=amplitude_vpp, frequency_hz=frequency_hz, settle_s=2.0, duration_s=DURATION_S
    )
    plan = Measurement(name="dwell", excitation=excitation)
    with tempfile.TemporaryDirectory() as folder, open_bench(guarded) as bench:
        path = run_measurement(bench, plan, Path(folder) / "dwell.h5").path
        with open_recording(path) as recording:
            dwell = next(each for each in recording.segments if each.label == "dwell")
            drive, response = (
                recording.read(role, dwell.first_sample, dwell.last_sample + 1)
                for role in ("drive_voltage", "m0_velocity")
            )
            rate_hz = recording.sample_rate_hz
    length = round(PERIODS * rate_hz / frequency_hz)
    count = drive.size // length
    turn = np.exp(-2j * np.pi * frequency_hz / rate_hz * np.arange(length))
    drives, responses = (each[: count * length].reshape(count, length) @ turn for each in (drive, response))
    # A tenth of a period, which is longer than the sine stays near a zero crossing.
    hop = max(1, round(0.1 * rate_hz / frequency_hz))
    pieces = np.abs(drive[: drive.size // hop * hop].reshape(-1, hop)).max(axis=1)
    return float(np.mean(pieces < SILENT_V)), responses / drives


def main() -> None:
    """Compare the dwells and print a table."""
    print("| dwell | bursts of | silent | disturbed | felt after a gap |")
    print("|---|---|---|---|---|")
    for name, (frequency_hz, amplitude_vpp) in CASES.items():
        _, steady = measure(None, frequency_hz, amplitude_vpp)
        middle = np.median(steady.real) + 1j * np.median(steady.imag)
        usual = float(np.percentile(np.abs(steady - middle), 99))
        bound = max(FELT * abs(middle), usual)
        for length_s in LENGTHS_S:
            silent, ratios = measure(length_s, frequency_hz, amplitude_vpp)
            disturbed = float(np.mean(~(np.abs(ratios - middle) <= bound)))
            felt_s = disturbed * length_s
            print(
                f"| {name} | {length_s:g} s | {silent:.1%} | {disturbed:.1%} | {felt_s:.2f} s |", flush=True
            )


if __name__ == "__main__":
    main()
