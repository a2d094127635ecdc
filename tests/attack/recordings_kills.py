"""Campaigns that are killed repeatedly and resumed: at a random moment, or at the n-th operation on a file.

Each number is one campaign of short points, with dwells or streamed noise, killed up to `KILLS` times and
then run to its end. One process imports everything and forks itself for each run. With a preloaded library
(`system_calls.c`) exact system calls kill or fail before, inside and after the call.
"""

import ctypes
import errno
import os
import random
import signal
import sqlite3
import subprocess
import tempfile
import threading
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py

from vibench.acquisition import open_recording
from vibench.acquisition.campaign import JournalPointState, read_journal, verify_recordings
from vibench.acquisition.recording import RecordingState

from .command_runner import ROOT, CommandRunner
from .limits import Case, Ending
from .tally import Finding, Shard, Tally

KILLS = 10
"""Largest number of kills of one campaign."""
KINDS = ("moment", "write", "torn write", "sync", "rename", "commit")
CALLS = {"pwrite": 150, "fsync": 60, "rename": 8, "ftruncate": 12, "unlink": 8}
"""System calls, and their approximate number in a run of these campaigns."""
WHEN = ("before", "inside", "after")
FAULTS = {"kill": 0, "EIO": errno.EIO, "ENOSPC": errno.ENOSPC}
CALL_KINDS = tuple(f"{call} {when} {fault}" for call in CALLS for when in WHEN for fault in FAULTS)
LIBRARY = "VIBENCH_SYSTEM_CALLS"
LONGEST_S = 120.0
"""Time after which a campaign of a few points counts as hanging [s]."""
RATE = ("sample_rate_hz = 51200", "sample_rate_hz = 5120")
CAMPAIGNS = {
    "virtual_rig": """
name = "killed"
[[sweeps]]
name = "line"
amplitude_vpp = [0.05]
frequency_hz = { start = 200, stop = 203, step = 1 }
[sweeps.measurement]
ramp_s = 0.08
ramp_step_s = 0.02
excitation = { kind = "dwell", settle_s = 0.3, duration_s = 0.1 }
""",
    "virtual_rig_streaming": """
name = "killed"
[defaults]
ramp_s = 0.1
ramp_step_s = 0.02
[[measurements]]
name = "weak"
excitation = { kind = "streamed_noise", amplitude_vpp = 0.05, band_start_hz = 50, band_stop_hz = 600, \
settle_s = 0.3, duration_s = 0.5, seed = 1 }
[[measurements]]
name = "strong"
excitation = { kind = "streamed_noise", amplitude_vpp = 0.1, band_start_hz = 50, band_stop_hz = 600, \
settle_s = 0.3, duration_s = 0.5, seed = 2 }
""",
}
POINTS = {"virtual_rig": 4, "virtual_rig_streaming": 2}


class KilledCampaigns(CommandRunner):
    """Runs campaigns in forks of one process; use it in a ``with`` block."""

    def __init__(self, library: Path | None = None) -> None:
        super().__init__({} if library is None else {"LD_PRELOAD": str(library), LIBRARY: str(library)})

    def measure(
        self, folder: Path, *options: str, kind: str = "", number: int = 0, moment_s: float = 0.0
    ) -> Ending:
        """Measure the campaign of a folder, or be killed at the n-th operation of a kind or at a moment."""
        paths = ("campaign.toml", "--bench", "bench.toml", "--out", "out", "--check", "waived")
        prepare = (__name__, kind, str(number), str(moment_s))
        return self.run_in(folder, Case(("measure", *paths, *options), prepare=prepare, hangs_s=LONGEST_S))


@dataclass(frozen=True)
class SafeContent:
    """What must survive a kill and the runs after it."""

    seals: dict[str, str]
    """Seals of the recordings that the journal lists as done, by file."""
    committed: dict[str, dict[str, bytes]]
    """Committed counts of unfinished recordings, by file and channel."""


def write_campaign(folder: Path, bench: str) -> None:
    """Write campaign and bench into a folder."""
    text = (ROOT / "hardware_configs" / f"{bench}.toml").read_text(encoding="utf-8")
    (folder / "bench.toml").write_text(text.replace(*RATE), encoding="utf-8")
    (folder / "campaign.toml").write_text(CAMPAIGNS[bench], encoding="utf-8")


def state_of(out: Path) -> SafeContent:
    """Return what exists after a kill."""
    journal = out / "killed.campaign.sqlite"
    points = read_journal(journal) if journal.exists() and _has_begun(journal) else ()
    seals = {each.file: each.seal for each in points if each.state is JournalPointState.DONE}
    committed = {}
    for part in out.glob("*.h5.part"):
        with h5py.File(part, "r", locking=False) as file:
            samples = int(file["n_valid"][0])
            roles = file.attrs["roles"].decode().split()
            committed[part.name.removesuffix(".part")] = {
                role: file[role][:samples].tobytes() for role in roles
            }
    return SafeContent(seals, committed)


def _has_begun(journal: Path) -> bool:
    connection = sqlite3.connect(journal)
    try:
        return (
            connection.execute("SELECT 1 FROM sqlite_master WHERE name = 'campaign'").fetchone() is not None
        )
    finally:
        connection.close()


def loss(kept: SafeContent, out: Path) -> list[str]:
    """Return what has been lost after a later run."""
    now = state_of(out)
    said = [
        f"{file} was done, and is not, or not with its seal"
        for file, seal in kept.seals.items()
        if now.seals.get(file) != seal or not (out / file).exists()
    ]
    for name, channels in kept.committed.items():
        where = out / name if (out / name).exists() else out / f"{name}.part"
        if not where.exists():
            said.append(f"{name} had committed samples, and is gone")
            continue
        with h5py.File(where, "r", locking=False) as file:
            said += [
                f"{name}: committed samples of {role} are gone or others"
                for role, counts in channels.items()
                if file[role][: len(counts) // 4].tobytes() != counts
            ]
    return said


def at_the_end(out: Path, points: int) -> list[str]:
    """Return the faults of a completed campaign."""
    journal = read_journal(out / "killed.campaign.sqlite")
    said = [f"{each.name} is {each.state}" for each in journal if each.state is not JournalPointState.DONE]
    said += [
        f"{each.path}: {each.verdict}, {each.sentence}" for each in verify_recordings(out) if each.is_bad
    ]
    said += [f"{path.name} is left" for path in (*out.glob("*.part"), *out.glob("*.tmp"))]
    made: Counter[str] = Counter()
    for path in out.glob("*.h5"):
        with open_recording(path) as recording:
            if recording.check_seal("whole").state.value != "intact":
                said.append(f"{path.name} has no right seal")
            made[str(recording.plan["name"])] += recording.state is RecordingState.COMPLETE
    said += [f"{name} has {count} complete recordings" for name, count in made.items() if count != 1]
    if len(made) != points:
        said.append(f"{len(made)} of {points} points were made")
    return said


def attack_one(
    runs: KilledCampaigns,
    chance: random.Random,
    tally: Tally,
    kills: int = KILLS,
    kinds: tuple[str, ...] = KINDS,
) -> list[str]:
    """Kill one campaign up to ``kills`` times, let it end, and return losses and faults."""
    bench = chance.choice(tuple(CAMPAIGNS))
    with tempfile.TemporaryDirectory(prefix="vibench_kills_") as name:
        folder = Path(name)
        write_campaign(folder, bench)
        out, said = folder / "out", []
        for attempt in range(kills):
            kept = state_of(out) if out.exists() else SafeContent({}, {})
            kind = chance.choice(kinds)
            most = CALLS[kind.split()[0]] if kind in CALL_KINDS else MOST_OPERATIONS[kind]
            ended = runs.measure(
                folder,
                *(("--resume",) if out.exists() else ()),
                kind=kind,
                number=1 + int(most * chance.random() ** 2),
                moment_s=chance.uniform(0.0, LATEST_S),
            )
            said += [f"kill {attempt} ({kind}): {each}" for each in loss(kept, out)] if out.exists() else []
            if ended.clock_s > LONGEST_S:
                return [*said, f"run {attempt} ({kind}) hangs"]
            if kind in CALL_KINDS and ended.code == 1 and "Traceback" not in ended.err:
                tally.count(kind, ended.clock_s)
                continue
            if ended.code != -signal.SIGKILL:
                tally.count(f"not reached, exit {ended.code}")
                said += [f"run {attempt} ended with {ended.code}: {ended.err[-600:]}"] if ended.code else []
                break
            tally.count(kind, ended.clock_s)
        kept = state_of(out) if out.exists() else SafeContent({}, {})
        ended = runs.measure(folder, *(("--resume",) if out.exists() else ()))
        if ended.code != 0:
            return [*said, f"the last run ended with {ended.code}: {ended.err[-600:]}"]
        return [*said, *loss(kept, out), *at_the_end(out, POINTS[bench])]


def attack(shard: Shard) -> Tally:
    """Kill campaigns; each number is one campaign, and kills are counted."""
    tally = shard.tally("kills")
    with KilledCampaigns() as runs:
        for number, chance in shard.chances(tally):
            if said := attack_one(runs, chance, tally):
                tally.findings.append(Finding("kills", shard.seed, number, tuple(said[:5]), ""))
    return tally


def build_library(folder: Path) -> Path:
    """Compile the library whose system calls fail."""
    library = folder / "system_calls.so"
    source = Path(__file__).with_name("system_calls.c")
    subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source, "-ldl", "-lpthread"], check=True)
    return library


def attack_calls(shard: Shard) -> Tally:
    """Let exact system calls kill or fail; each number is one campaign, and faults are counted."""
    tally = shard.tally("calls")
    with (
        tempfile.TemporaryDirectory(prefix="vibench_calls_") as folder,
        KilledCampaigns(build_library(Path(folder))) as runs,
    ):
        for number, chance in shard.chances(tally):
            if said := attack_one(runs, chance, tally, kinds=CALL_KINDS):
                tally.findings.append(Finding("calls", shard.seed, number, tuple(said[:5]), ""))
    return tally


MOST_OPERATIONS = {"moment": 0, "write": 150, "torn write": 150, "sync": 60, "rename": 8, "commit": 10}
"""Approximate numbers of operations in a run of these campaigns; small numbers are tried more often."""
LATEST_S = 4.0
"""Approximate duration of such a run [s]."""


def prepare(kind: str, number: str, moment_s: str) -> None:
    """Arrange in the process of a campaign how it ends."""
    _prepare_to_die(kind, int(number), float(moment_s))
    if kind in CALL_KINDS:
        call, when, fault = kind.split()
        arguments = (list(CALLS).index(call), int(number), WHEN.index(when), FAULTS[fault])
        ctypes.CDLL(os.environ[LIBRARY]).arm(*arguments, os.path.realpath("out").encode())


def _prepare_to_die(kind: str, number: int, moment_s: float) -> None:
    """Arrange the end of this process: odd numbers end it before the operation, even numbers after it."""
    match kind:
        case "moment":
            threading.Timer(moment_s, _die).start()
        case "write":
            os.pwrite = _deadly(os.pwrite, number)
        case "torn write":
            os.pwrite = _tear(os.pwrite, number)
        case "sync":
            os.fdatasync = os.fsync = _deadly(os.fsync, number)
        case "rename":
            os.replace = os.rename = _deadly(os.replace, number)
        case "commit":
            sqlite3.connect = _deadly_connect(sqlite3.connect, number)


def _die() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def _deadly(operation: Callable[..., Any], number: int) -> Callable[..., Any]:
    left = [number]

    def operate(*given: Any, **named: Any) -> Any:
        left[0] -= 1
        if left[0] == 0 and number % 2:
            _die()
        answer = operation(*given, **named)
        if left[0] == 0:
            _die()
        return answer

    return operate


def _tear(write: Callable[..., int], number: int) -> Callable[..., int]:
    left = [number]

    def operate(descriptor: int, data: Any, offset: int) -> int:
        left[0] -= 1
        if left[0] == 0:
            write(descriptor, bytes(data)[: len(data) // 2], offset)
            _die()
        return write(descriptor, data, offset)

    return operate


def _deadly_connect(connect: Callable[..., Any], number: int) -> Callable[..., Any]:
    class Connection(sqlite3.Connection):
        left = number

        def execute(self, statement: str, *given: Any) -> Any:
            is_commit = statement.strip().upper() == "COMMIT"
            Connection.left -= is_commit
            if is_commit and Connection.left == 0 and number % 2:
                _die()
            answer = super().execute(statement, *given)
            if is_commit and Connection.left == 0:
                _die()
            return answer

    return lambda *given, **named: connect(*given, **{**named, "factory": Connection})
