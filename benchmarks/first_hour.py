"""Print the transcript of a new user's first hour: installation, measurement, analysis and figure.

python benchmarks/first_hour.py [--demo] > transcript.txt

The script creates a new environment, installs vibench from this checkout, and runs all commands in an empty
folder, including typical mistakes. It prints the transcript, with elapsed time and processor time of each
command.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

CAMPAIGN = """name = "levels"

[[measurements]]
name = "noise"
[measurements.excitation]
kind = "white_noise"
amplitude_vpp = 0.05
band_start_hz = 20
band_stop_hz = 800
realisations = 4

[[measurements]]
name = "dwell"
excitation = { kind = "dwell", amplitude_vpp = 1.5, frequency_hz = 260, settle_s = 3, duration_s = 10 }
"""
SCRIPT = """from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from vibench.acquisition import open_recording
from vibench.analysis import analyse

noise = analyse(Path("mine/noise.h5")).response
for mode in noise.resonances:
    print(f"{mode.frequency_hz:.3f} ± {2 * mode.sd_frequency_hz:.3f} Hz")
curve = noise.frequency_response

with open_recording(Path("mine/dwell.h5")) as recording:
    part = next(each for each in recording.segments if each.label == "dwell")
    velocity = recording.read("m0_velocity", part.start, part.stop)
    rate_hz = recording.sample_rate_hz
print(f"{velocity.size} samples of m0, {1e3 * np.abs(velocity).max():.1f} mm/s at most")

figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3), layout="constrained")
left.semilogy(curve.frequency_hz, curve.magnitude)
left.set(xlabel="frequency [Hz]", ylabel="transmissibility of m0 [-]")
right.plot(np.arange(400) / rate_hz * 1e3, velocity[:400] * 1e3)
right.set(xlabel="time [ms]", ylabel="velocity of m0 [mm/s]")
figure.savefig("mine.png")
"""
FILES = {
    "levels.toml": CAMPAIGN,
    "mistaken.toml": CAMPAIGN.replace("frequency_hz", "frequncy_hz"),
    "mine.py": SCRIPT,
}
OURS = ("VIBENCH", "PYTHON")
TYPED = (
    "vibench examples",
    "vibench measure quikc --out mine",
    "vibench measure mistaken.toml --out mine",
    "vibench measure levels.toml --out mine --estimate",
    "vibench measure levels.toml --out mine",
    "vibench measure levels.toml --out mine",
    "vibench catalogue mine",
    "vibench analyse mine --out report",
    "vibench predict --amplitude 5um --frequency 260",
    "vibench predict --amplitude 5e-6 --frequency 250:270:5",
    "vibench analyse min/dwell.h5",
    "python mine.py",
)


def main() -> None:
    """Install, then run all commands; a failed command does not end the script, as mistakes are intended."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--demo", action="store_true", help="begin with the demonstration, as README does")
    typed_here = ("vibench demo", *TYPED) if parser.parse_args().demo else TYPED
    with tempfile.TemporaryDirectory() as name:
        folder, home = Path(name) / "hour", Path(name) / "home"
        for each in (folder, home):
            each.mkdir()
        for file, text in FILES.items():
            (folder / file).write_text(text, encoding="utf-8")
        began_s, programs = time.monotonic(), Path(name) / "venv" / ("Scripts" if os.name == "nt" else "bin")
        environment = {
            **{key: value for key, value in os.environ.items() if not key.startswith(("VIBENCH", "PYTHON"))},
            "PATH": os.pathsep.join((str(programs), os.environ["PATH"])),
            "HOME": str(home),
            "COLUMNS": "110",
            "MPLBACKEND": "agg",
        }
        shell(
            "python -m venv venv", [sys.executable, "-m", "venv", str(programs.parent)], folder, environment
        )
        pip = [str(programs / "python"), "-m", "pip", "install", "-q", f"{ROOT}[gui]"]
        shell("pip install 'vibench[gui]'", pip, folder, environment)
        for command in typed_here:
            shell(command, [str(programs / command.split()[0]), *command.split()[1:]], folder, environment)
        print(f"From nothing to this: {(time.monotonic() - began_s) / 60:.1f} minutes.")


def shell(shown: str, words: list[str], folder: Path, environment: dict[str, str]) -> None:
    """Run a command, and print it with its output and its time."""
    print(f"$ {shown}", flush=True)
    began_s, used_s = time.monotonic(), processors_s()
    done = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    print((done.stdout + done.stderr).replace(str(folder), "~"), end="")
    failed = f", exit code {done.returncode}" if done.returncode else ""
    took = f"{time.monotonic() - began_s:.0f} s, {processors_s() - used_s:.0f} s CPU"
    print(f"[{took}{failed}]\n", flush=True)


def processors_s() -> float:
    """Return the processor time of all commands so far [s]."""
    times = os.times()
    return times.children_user + times.children_system


if __name__ == "__main__":
    main()
