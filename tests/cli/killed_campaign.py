"""A campaign of short points in a real process that is killed repeatedly, and its expected result."""

import random
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np

from vibench.acquisition import open_recording
from vibench.acquisition.campaign import JournalPointState, read_journal
from vibench.acquisition.campaign._journal import journal_path
from vibench.acquisition.recording import RecordingState

from .conftest import ENVIRONMENT, ROOT

LOOK_S = 0.02
CAMPAIGN = "points"
"""Name of every campaign here."""


def slow_rig(folder: Path) -> Path:
    """Write a virtual rig with a low sample rate, so that short points are quick."""
    text = (ROOT / "hardware_configs" / "virtual_rig.toml").read_text(encoding="utf-8")
    path = folder / "slow_rig.toml"
    path.write_text(text.replace("sample_rate_hz = 51200", "sample_rate_hz = 5120"), encoding="utf-8")
    return path


def short_points(folder: Path, count: int) -> Path:
    """Write a campaign of ``count`` dwells that are too weak for contact."""
    path = folder / "points.toml"
    path.write_text(
        f"""
name = "points"
[[sweeps]]
name = "line"
amplitude_vpp = [0.05]
frequency_hz = {{ start = 200, stop = {200 + count - 1}, step = 1 }}
[sweeps.measurement]
ramp_s = 0.08
ramp_step_s = 0.02
excitation = {{ kind = "dwell", settle_s = 0.3, duration_s = 0.1 }}
""",
        encoding="utf-8",
    )
    return path


def branches(folder: Path) -> Path:
    """Write a campaign through frequencies with two motions each; 190 Hz is also measured without lead-in."""
    path = folder / "branches.toml"
    path.write_text(
        """
name = "points"
[defaults]
ramp_s = 0.2
ramp_step_s = 0.02
[defaults.dwell]
settle_s = 0.5
duration_s = 0.3
[[measurements]]
name = "alone-190hz"
excitation = { kind = "dwell", amplitude_vpp = 0.5, frequency_hz = 190 }
[[sweeps]]
name = "line"
amplitude_vpp = [0.5]
direction = ["up", "down"]
frequency_hz = { start = 150, stop = 200, step = 10 }
continue_from_previous = "frequency_hz"
lead_s = 0.3
measurement = { excitation = { kind = "dwell" } }
""",
        encoding="utf-8",
    )
    return path


def command(plan: Path, bench: Path, out: Path, *options: str) -> list[str]:
    """Return the command of ``vibench measure`` in a new process, without a bench check."""
    paths = [str(plan), "--bench", str(bench), "--out", str(out), "--check", "waived"]
    return [sys.executable, "-m", "vibench.cli", "measure", *paths, *options]


def kill_at(arguments: list[str], out: Path, points: int, chance: random.Random) -> int:
    """Start a campaign, and kill it at a random moment after ``points`` more are done.

    Return how many points were done then.
    """
    before = logged_points(out)
    with subprocess.Popen(arguments, env=ENVIRONMENT, stdout=subprocess.DEVNULL) as process:
        while logged_points(out) < before + points and process.poll() is None:
            with suppress(subprocess.TimeoutExpired):
                process.wait(LOOK_S)
        with suppress(subprocess.TimeoutExpired):
            process.wait(chance.uniform(0.0, 0.15))
        process.kill()
        process.wait()
        assert process.returncode == -signal.SIGKILL
    return done_points(out)


def logged_points(out: Path) -> int:
    """Return the number of points that the log lists as done; reading it is fast enough for polling."""
    log = out / f"{CAMPAIGN}.log.jsonl"
    return log.read_bytes().count(b'"point_done"') if log.exists() else 0


def done_points(out: Path) -> int:
    """Return the number of points that the journal lists as done."""
    points = read_journal(journal_path(out, CAMPAIGN))
    return sum(point.state is JournalPointState.DONE for point in points)


def amplitudes(out: Path) -> dict[str, float]:
    """Return the velocity of m0 at every point [m/s]; each point must have exactly one complete recording."""
    found: dict[str, float] = {}
    for path in sorted((*out.glob("*.h5"), *out.glob("*.h5.part"))):
        with open_recording(path) as recording:
            if recording.state is not RecordingState.COMPLETE:
                continue
            name = str(recording.plan["name"])
            assert name not in found, f"{name} was made twice"
            assert recording.check_seal("whole").state.value == "intact"
            (dwell,) = (each for each in recording.segments if each.label == "dwell")
            values = recording.read("m0_velocity", dwell.first_sample, dwell.last_sample + 1)
            found[name] = float(np.sqrt(2) * np.std(values))
    return found
