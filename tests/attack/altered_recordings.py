"""Alterations of recordings of a campaign: no command may take an altered recording as intact.

Each number alters one file, the journal or the folder as an outsider could, and runs every reading command on
it. Altered recordings must be refused or give a warning; unaltered recordings must stay intact.
"""

import io
import os
import random
import shutil
import sqlite3
import sys
import tempfile
from collections.abc import Callable
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path

import h5py
import numpy as np

from vibench.acquisition import load_toml, open_recording, shipped
from vibench.acquisition.campaign import JournalPointState, ReasonCode
from vibench.acquisition.campaign._journal import BenchIdentity, Journal, journal_path
from vibench.acquisition.plan import Campaign, Measurement
from vibench.acquisition.recording import _seal
from vibench.acquisition.rig import Rig

from .recordings_corpus import good_recordings
from .tally import Finding, Shard, Tally

NAMES = ("dwell", "sweep")
ROLES = ("drive_voltage", "base_acceleration", "m0_velocity")
WARNED = ("seal is gone", "seal gone")
READERS = ("verify", "verify folder", "analyse", "analyse folder", "export", "spectra", "pack", "Files page")
"""Readers that must detect changed samples; the catalogue states that it does not check samples."""


def write_journal(folder: Path, names: tuple[str, ...] = NAMES) -> None:
    """Write a journal that lists recordings of a folder as done."""
    plans, seals = [], {}
    for name in names:
        with open_recording(folder / f"{name}.h5") as recording:
            plans.append(Measurement.model_validate(recording.plan))
            seals[name] = recording.seal
    rig = load_toml(shipped("hardware_configs/virtual_rig.toml"), Rig)
    identity = BenchIdentity(rig=rig, instruments={}, knobs={})
    campaign = Campaign(name="night", measurements=tuple(plans))
    with Journal.begin(journal_path(folder, "night"), campaign, identity) as journal:
        for name, seal in seals.items():
            journal.start(name, f"{name}.h5")
            journal.end(name, JournalPointState.DONE, ReasonCode.CARRIED_OUT, "so it was", seal)


# --- alterations: each changes the folder and returns a description ---------------------------


def _change_bytes(path: Path, chance: random.Random) -> str:
    data = bytearray(path.read_bytes())
    with h5py.File(path) as file:
        chunk = file[chance.choice(ROLES)].id.get_chunk_info(0)
    place = chunk.byte_offset + chance.randrange(chunk.size)
    data[place] ^= 1 << chance.randrange(8)
    path.write_bytes(data)
    return f"bit of byte {place}"


def _truncate(path: Path, chance: random.Random) -> str:
    size = path.stat().st_size
    kept = chance.choice((0, 1, 512, size // 2, size - 1, size - 4096))
    os.truncate(path, max(0, kept))
    return f"{kept} bytes kept"


def _swap_channels(file: h5py.File, chance: random.Random) -> str:
    one, other = chance.sample(ROLES, 2)
    held, counts = file[one][()], file[other][()]
    file[one][...], file[other][...] = counts, held
    return f"{one} and {other} swapped"


def _rename_channels(file: h5py.File, chance: random.Random) -> str:
    one, other = chance.sample(ROLES, 2)
    file.move(one, "held")
    file.move(other, one)
    file.move("held", other)
    return f"{one} and {other} renamed"


def change_samples(file: h5py.File, chance: random.Random) -> str:
    role, count = chance.choice(ROLES), len(file["time"])
    first = chance.randrange(count)
    last = min(count, first + chance.choice((1, 100, count)))
    factor = chance.choice((-1, 0, 2))
    file[role][first:last] = factor * file[role][first:last] + (factor == 0)
    return f"{role} {first} to {last} times {factor}"


def _change_attribute(file: h5py.File, chance: random.Random) -> str:
    role = chance.choice(ROLES)
    where, name, value = chance.choice(
        (
            (role, "units", b"mm s-1"),
            (role, "delay_s", 1e-4),
            (role, "range_v", 0.1),
            (role, "serial", b"another"),
            (role, "calibration_date", b"2020-01-01"),
            (role, "scale_factor", 2 * float(file[role].attrs["scale_factor"])),
            (role, "physical_per_volt", 0.5 * float(file[role].attrs["physical_per_volt"])),
            ("/", "sample_rate_hz", 1.01 * float(file.attrs["sample_rate_hz"])),
            ("/", "origin", b"measured"),
            ("/", "reason", b"nothing to see"),
            ("/", "started_utc", b"2025-01-01T00:00:00.000000+00:00"),
        )
    )
    file[where].attrs[name] = np.bytes_(value) if isinstance(value, bytes) else value
    return f"{where} {name}"


def _change_text(file: h5py.File, chance: random.Random) -> str:
    name = chance.choice(sorted(file["configuration"]))
    text = bytes(file[f"configuration/{name}"][()])
    place = chance.choice([at for at, each in enumerate(text) if chr(each).isdigit()] or [0])
    digit = chance.choice([each for each in b"123456789" if each != text[place]])
    del file[f"configuration/{name}"]
    file[f"configuration/{name}"] = np.bytes_(text[:place] + bytes([digit]) + text[place + 1 :])
    return f"{name} at {place}"


def _change_segment(file: h5py.File, chance: random.Random) -> str:
    column = chance.choice(("first_sample", "last_sample"))
    file[f"segments/{column}"][0] += chance.choice((-1, 1, 100))
    return column


INSIDE: tuple[Callable[[h5py.File, random.Random], str], ...] = (
    _swap_channels, _rename_channels, change_samples, change_samples, _change_attribute, _change_attribute,
    _change_text, _change_segment,
)  # fmt: skip


def _inside(path: Path, chance: random.Random) -> str:
    """Change a file by HDF5; the seal is kept, removed, or made again as by a forger."""
    seal = chance.choice(("kept", "kept", "removed", "renewed"))
    with h5py.File(path, "r+") as file:
        said = chance.choice(INSIDE)(file, chance)
        if seal != "kept":
            del file["seal"]
        if seal == "renewed":
            for role in ROLES:
                file[role].attrs.pop("sha256", None)
            _seal.write_seal(file, {}, None)
    return f"{said}, seal {seal}"


def _exchange(path: Path, chance: random.Random) -> str:
    """Replace a recording by another: a copy, a link of either kind, or both exchanged."""
    other = path.with_name(f"{next(each for each in NAMES if each != path.stem)}.h5")
    how = chance.choice(("copied", "hard link", "link", "exchanged"))
    if how == "exchanged":
        path.rename(path.with_name("held"))
        other.rename(path)
        path.with_name("held").rename(other)
        return how
    path.unlink()
    if how == "copied":
        shutil.copy(other, path)
    elif how == "hard link":
        path.hardlink_to(other)
    else:
        path.symlink_to(other.name)
    return how


def _change_journal(path: Path, chance: random.Random) -> str:
    seals = chance.choice(("another", "changed"))
    connection = sqlite3.connect(path.with_name("night.campaign.sqlite"))
    tables = {
        table: [row[1] for row in connection.execute(f"PRAGMA table_info({table})")]
        for (table,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
    }
    noting = [name for name, columns in tables.items() if {"seal", "file"} <= set(columns)]
    new = "0" * 64
    if seals == "another":
        (new,) = connection.execute(f"SELECT seal FROM {noting[0]} WHERE file != ?", (path.name,)).fetchone()
    changed = chance.choice((noting, noting[:1], noting[1:]))
    for table in changed:
        connection.execute(f"UPDATE {table} SET seal = ? WHERE file = ?", (new, path.name))
    connection.commit()
    connection.close()
    return f"journal, {seals} seal in {' and '.join(changed)}"


ALTERATIONS: tuple[Callable[[Path, random.Random], str], ...] = (
    _change_bytes, _truncate, _inside, _inside, _inside, _inside, _exchange, _change_journal,
)  # fmt: skip


# --- the commands -----------------------------------------------------------------------------


def run_reader(folder: Path, *arguments: str) -> tuple[int, str]:
    from vibench.cli.__main__ import main

    out, argv = io.StringIO(), sys.argv
    sys.argv = ["vibench", *arguments]
    try:
        with chdir(folder), redirect_stdout(out), redirect_stderr(out):
            main()
    except SystemExit as ended:
        return int(ended.code or 0), out.getvalue()
    except Exception as error:  # unexpected exceptions are what the attack looks for
        return -1, f"Traceback: {type(error).__name__}: {error}"
    finally:
        sys.argv = argv
    return 0, out.getvalue()


def fooled_readers(folder: Path, name: str) -> list[str]:
    """Return the commands that take an altered recording as intact, or end with an exception."""
    from vibench.gui.pages.files.recording_table import facts_text, whole_check

    out = folder.parent / "out"
    shutil.rmtree(out, ignore_errors=True)
    commands = {
        "verify": ("verify", name),
        "verify folder": ("verify", "."),
        "analyse": ("analyse", name, "--no-simulate", "--json"),
        "analyse folder": ("analyse", ".", "--no-simulate", "--json"),
        "export": ("export", name, "--to", "csv", "--out", str(out / "csv")),
        "spectra": ("export", name, "--to", "uff", "--spectra", "--out", str(out / "uff")),
        "pack": ("pack", ".", "--license", "https://creativecommons.org/", "--out", str(out / "a.zip")),
    }
    found = []
    for word, arguments in commands.items():
        code, text = run_reader(folder, *arguments)
        may_warn = word in {"analyse", "analyse folder", "export", "spectra"}
        is_warned = may_warn and any(each in text for each in WARNED)
        if code == -1 or not (code == 1 or is_warned):
            found.append(f"{word}: {code} {text[:300]}")
    code, text = run_reader(folder, "catalogue", ".")
    if code == -1 or not any(line.startswith(name) and "good" not in line for line in text.splitlines()):
        found.append(f"catalogue: {code} {text[:300]}")
    try:
        check = whole_check(folder / name)
        with open_recording(folder / name) as recording:
            shown = facts_text(recording, check)
    except OSError as error:
        shown = f"✖ {error}"
    if "✖" not in shown and not any(each in shown for each in WARNED):
        found.append(f"Files page: {shown[:300]}")
    return found


def attack(shard: Shard) -> Tally:
    """Alter recordings of a campaign."""
    tally = shard.tally("altered")
    with tempfile.TemporaryDirectory(prefix="vibench_altered_") as text:
        usual = Path(text, "usual")
        usual.mkdir()
        for name in NAMES:
            (usual / f"{name}.h5").write_bytes(good_recordings()[f"{name}.h5"])
        write_journal(usual)
        unharmed = fooled_readers(shutil.copytree(usual, Path(text, "unharmed")), "dwell.h5")
        if [each.split(":")[0] for each in unharmed] != list(READERS):
            raise RuntimeError(f"unharmed recordings are refused: {unharmed}")
        for number, chance in shard.chances(tally):
            folder = shutil.copytree(usual, Path(text, str(number), "recordings"))
            path = folder / f"{chance.choice(NAMES)}.h5"
            alteration = chance.choice(ALTERATIONS)
            how = f"{path.name}: {alteration(path, chance)}"
            tally.count(alteration.__name__.strip("_"))
            if found := fooled_readers(folder, path.name):
                tally.findings.append(Finding("altered", shard.seed, number, (how, *found), ""))
            shutil.rmtree(folder.parent)
    return tally
