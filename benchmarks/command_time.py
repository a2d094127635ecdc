"""Test sweeps on a generator that is slow to accept settings: excess cycles, refusals and early ends.

    python benchmarks/command_time.py
    python benchmarks/command_time.py --settle 0 0.1 --step 0.1 0.5
    python benchmarks/command_time.py --bench virtual_rig_keysight

The virtual rig runs in real time (pace "wall"), where commands take time while samples are converted. For
each `generator.settle_s` and `step_s`, the table shows by how many drive cycles the recorded sweep exceeds
its plan. If the run refused or ended the sweep, it shows the message. Every run includes a bench check and a
ramp. The last column is for generators that can sweep by themselves.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from scipy.signal import hilbert

from vibench.acquisition import AcquisitionError, open_bench, open_recording
from vibench.acquisition.plan import Measurement, SineSweep
from vibench.acquisition.rig import Rig, generator_driver, load_rig
from vibench.acquisition.run.run import run_measurement

SETTLES_S = (0.0, 0.02, 0.05, 0.1, 0.2)
STEPS_S = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
LONGEST_SENTENCE = 60
MARGIN_S = 0.15


def bench(name: str, settle_s: float) -> Rig:
    """Return a virtual rig in real time, with a generator that needs a pause after each command."""
    rig = load_rig(name)
    return rig.model_copy(
        update={
            "generator": rig.generator.model_copy(update={"settle_s": settle_s}),
            "virtual": rig.virtual.model_copy(update={"pace": "wall"}),
        }
    )


def sweep(step_s: float | None) -> Measurement:
    """Return a sweep from 150 to 310 Hz in 6 s, in steps or by the generator itself."""
    moved = {"swept_by": "generator"} if step_s is None else {"step_s": step_s}
    excitation = SineSweep(
        amplitude_vpp=0.2, start_hz=150.0, stop_hz=310.0, duration_s=6.0, settle_s=0.5, **moved
    )
    return Measurement(name="sweep", excitation=excitation, ramp_s=0.4, ramp_step_s=0.1)


def excess_cycles(path: Path, excitation: SineSweep) -> float:
    """Return by how many cycles the recorded drive exceeds the plan."""
    with open_recording(path) as recording:
        found = next(each for each in recording.segments if each.label == "sweep")
        # Read more on both sides, where the sine continues, because the transform is inaccurate at its ends.
        margin = round(MARGIN_S * recording.sample_rate_hz)
        drive = recording.read("drive_voltage", found.first_sample - margin, found.last_sample + 1 + margin)
    phase = np.unwrap(np.angle(hilbert(drive - np.mean(drive))))
    played = float(phase[-1 - margin] - phase[margin]) / (2 * np.pi)
    return played - excitation.cycles(excitation.duration_s)


def report(name: str, settle_s: float, step_s: float | None) -> str:
    """Return the result of one sweep: excess cycles, or the error message."""
    plan = sweep(step_s)
    with tempfile.TemporaryDirectory() as folder:
        try:
            with open_bench(bench(name, settle_s)) as opened:
                path = run_measurement(opened, plan, Path(folder) / "sweep.h5").path
        except AcquisitionError as error:
            return str(error)[:LONGEST_SENTENCE]
        with open_recording(path) as recording:
            noted = any(event.kind == "late" for event in recording.events)
        return f"{excess_cycles(path, plan.excitation):+.2f}{' noted' if noted else ''}"


def main() -> None:
    """Run all combinations and print a table."""
    asked = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    asked.add_argument("--settle", type=float, nargs="+", default=SETTLES_S)
    asked.add_argument("--step", type=float, nargs="+", default=STEPS_S)
    asked.add_argument("--bench", default="virtual_rig", help="a bench that comes with vibench, or a file")
    given = asked.parse_args()
    generator = load_rig(given.bench).generator
    sweeps_itself = generator_driver(generator).describe(generator).longest_sweep_s > 0
    steps = [*given.step, None] if sweeps_itself else given.step
    titles = ["its own" if step_s is None else f"{step_s:g} s" for step_s in steps]
    print("| settle_s \\ step_s | " + " | ".join(titles) + " |")
    print("|" + "---|" * (len(steps) + 1))
    for settle_s in given.settle:
        cells = [report(given.bench, settle_s, step_s) for step_s in steps]
        print(f"| {settle_s:g} s | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
