"""`vibench warm`: compile what first uses need, when it suits: in an image, on a node, before a session."""

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from vibench.acquisition import MissingLibrary, need_extra, save_toml
from vibench.acquisition.plan import Campaign, Dwell, Measurement
from vibench.sim import Accuracy, Harmonic, gong2025, lyapunov_exponent, steady_response

from .output import console

DRIVE = Harmonic(frequency_hz=260.0, amplitude_m=5e-6)
"""m1 strikes both stops: flight, contact and whole collisions are entered."""


def warm() -> None:
    """Compile the simulation, and the virtual rig where it is installed, before the first use."""
    with told("responses"):
        steady_response(gong2025(), DRIVE, accuracy=Accuracy.QUICK)
    with told("exponents"):
        lyapunov_exponent(gong2025(), DRIVE, accuracy=Accuracy.QUICK)
    try:
        need_extra("bench")
    except MissingLibrary as error:
        console.print(f"virtual rig: left out, {error}")
        return
    with told("virtual rig, recording, analysis and overlay"):
        measure_and_analyse()


@contextmanager
def told(what: str) -> Iterator[None]:
    """Say how long something took."""
    start = time.perf_counter()
    yield
    console.print(f"{what}: {time.perf_counter() - start:.1f} s")


def measure_and_analyse() -> None:
    """Carry out the shortest campaign on the virtual rig, and analyse it, as the commands do."""
    dwell = Dwell(amplitude_vpp=1.5, frequency_hz=260.0, settle_s=0.1, duration_s=2.0)
    shortest = Measurement(name="dwell", excitation=dwell, ramp_s=0.2, ramp_step_s=0.02)
    with tempfile.TemporaryDirectory() as folder:
        plan, out = Path(folder) / "warm.toml", Path(folder) / "recordings"
        save_toml(Campaign(name="warm", measurements=(shortest,)), plan)
        steps = (
            ["measure", plan, "--out", out],
            ["analyse", out, "--hidden", "--out", Path(folder) / "report"],
        )
        for arguments in steps:
            command = [sys.executable, "-m", str(__package__), *map(str, arguments)]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)  # noqa: S603 - our own package
