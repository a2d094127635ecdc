"""Broken and malicious recordings: changed bytes, structure, and contents.

A file changed by HDF5 keeps its seal, loses it like an old recording, or is sealed again as by a forger: only
the last two pass the check of the seal.
"""

import json
import random
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from vibench.acquisition.recording._seal import write_seal
from vibench.sim.hdf5_files import UnsafeHdf5

from .byte_mutants import mutate_bytes
from .command_attack import attack_commands
from .limits import Case
from .recordings_corpus import good_recordings
from .tally import Shard, Tally

SECRET = "secret.bin"
"""A file beside each mutant whose content no command may show."""
NUMBERS = (
    0,
    -1,
    1,
    2**31,
    2**62,
    -(2**63),
    1e300,
    -1e300,
    1e-300,
    5e-324,
    float("nan"),
    float("inf"),
    0.5,
    10**12,
)
TEXTS = (
    "",
    "-5",
    "nan",
    "0",
    "../../x",
    "ä" * 300,
    "x" * 50_000,
    "[bold]",
    "1e999",
    "2026-13-45",
    "\x01\x7f",
)
MOST_SEALED_BYTES = 10_000_000
"""Largest file that is sealed: sealing 10^12 samples would take too long."""
JSON_VALUES: tuple[Any, ...] = (
    None, True, "", "text", -1, 0, 1e300, -1e-300, 10**400, [], {}, [[]], {"a": {}}, [1, "x", None],
    "[/bold]", 1e12, 0.1, "2026-01-01",
)  # fmt: skip
JSON_TEXTS = (
    "",
    "[]",
    "null",
    "3",
    '{"a": NaN}',
    '{"a": 1e999}',
    "{" * 500,
    "[" * 100_000,
    '{"a": ' * 60 + "1" + "}" * 60,
)


NOT_MADE = (OSError, RuntimeError, ValueError, TypeError, LookupError, ArithmeticError, MemoryError)
"""Exceptions if HDF5 refuses to write a mutant, or its declared size is too large to be read."""


def mutant(chance: random.Random) -> Case:
    """Break a random recording, and choose the command that reads it."""
    good = good_recordings()
    name = chance.choice(tuple(good))
    if chance.random() < 0.3:
        content = mutate_bytes(good[name], chance, tuple(good.values()))
    else:
        content = restructure(name, good[name], chance)
    return reading(name, content, chance)


def reading(name: str, content: bytes, chance: random.Random) -> Case:
    """Return a case in which a command reads a broken recording; a growing recording may be recovered."""
    files = {name: content, SECRET: b"root:x:0:0" * 4000}
    commands: list[tuple[str, ...]] = [
        ("analyse", name, "--json", "--no-simulate"),
        ("analyse", name, "--json", "--no-simulate"),
        ("analyse", ".", "--json", "--no-simulate"),
        ("export", name, "--to", "csv", "--out", "x.csv", "--results"),
        ("export", name, "--to", "mat", "--out", "x.mat"),
        ("catalogue", ".", "--json"),
        ("verify", ".", "--json"),
        ("verify", name),
    ]
    if name.endswith(".part"):
        commands += 3 * [("recover", name)]
    return Case(chance.choice(commands), files)


def restructure(name: str, content: bytes, chance: random.Random) -> bytes:
    """Change a few things by HDF5, and then the seal."""
    with tempfile.TemporaryDirectory(prefix="vibench_mutant_") as folder:
        path = Path(folder, name)
        path.write_bytes(content)
        with h5py.File(path, "r+") as file:
            for _ in range(chance.randint(1, 3)):
                try:
                    chance.choice(CHANGES)(file, chance)
                except NOT_MADE:
                    continue
            if not name.endswith(".part"):
                _change_seal(file, chance)
        return path.read_bytes()


def _change_seal(file: h5py.File, chance: random.Random) -> None:
    what = chance.choice(("keep", "lose", "lose", "renew", "renew"))
    if what == "keep" or "seal" not in file:
        return
    del file["seal"]
    if any(isinstance(each, h5py.Dataset) and each.nbytes > MOST_SEALED_BYTES for each in _objects(file)):
        return
    if what == "renew":
        try:
            write_seal(file, {}, None)
        except (UnsafeHdf5, OSError, RuntimeError, ValueError, TypeError):
            file.pop("seal", None)


def _objects(file: h5py.File) -> list[h5py.HLObject]:
    found: list[h5py.HLObject] = [file]
    file.visititems(lambda _, item: found.append(item) if not item.name.startswith("/seal") else None)
    return found


def _change_attribute(file: h5py.File, chance: random.Random) -> None:
    item = chance.choice([each for each in _objects(file) if len(each.attrs)])
    name = chance.choice(sorted(item.attrs))
    _put(item, name, chance)


def _put(item: h5py.HLObject, name: str, chance: random.Random) -> None:
    number, text = chance.choice(NUMBERS), chance.choice(TEXTS)
    values: list[Callable[[], Any]] = [
        lambda: number,
        lambda: float(number),
        lambda: text,
        lambda: np.bytes_(text.encode()),
        lambda: complex(1, 2),
        lambda: np.array([1.0, 2.0, 3.0]),
        lambda: np.zeros(chance.choice((0, 1, 5000))),
        lambda: np.array([(1, 2.0)], dtype=[("a", "i4"), ("b", "f8")]),
        lambda: h5py.Empty("f8"),
        lambda: np.bool_(True),
        lambda: np.uint64(2**64 - 1),
        lambda: np.float16(1.5),
    ]
    value = chance.choice(values)()
    del item.attrs[name]
    if chance.random() < 0.9:
        item.attrs[name] = value


def _change_known_attribute(file: h5py.File, chance: random.Random) -> None:
    """Change one of the most important attributes."""
    names = (
        "sample_rate_hz",
        "samples",
        "started_utc",
        "roles",
        "state",
        "origin",
        "expected_samples",
        "format_version",
    )
    _put(file, chance.choice(names), chance)


def _change_channel(file: h5py.File, chance: random.Random) -> None:
    role = chance.choice(("drive_voltage", "base_acceleration", "m0_velocity"))
    names = (
        "scale_factor",
        "physical_per_volt",
        "delay_s",
        "range_v",
        "calibration_date",
        "volts_per_count",
        "units",
    )
    _put(file[role], chance.choice(names), chance)


def _scale_channel(file: h5py.File, chance: random.Random) -> None:
    """Scale a channel by an absurd factor in all its attributes."""
    attributes = file[chance.choice(("drive_voltage", "base_acceleration", "m0_velocity"))].attrs
    factor = chance.choice((1e-300, 1e300, -1.0, 1e20, 1e-20))
    for name in ("physical_per_volt", "scale_factor", "add_offset"):
        attributes[name] = attributes[name] * factor


def _change_rate(file: h5py.File, chance: random.Random) -> None:
    file.attrs["sample_rate_hz"] = chance.choice((1e-6, 1e-3, 1.0, 100.0, 1e9, 1e12))


def _replace_dataset(file: h5py.File, chance: random.Random) -> None:
    names = [each.name for each in _objects(file) if isinstance(each, h5py.Dataset)]
    name = chance.choice(names)
    length = file[name].shape[0] if file[name].shape else 1
    kinds: list[Callable[[], Any]] = [
        lambda: np.zeros(length, "f8"),
        lambda: np.zeros(length, "i4"),
        lambda: np.full(length, np.nan),
        lambda: np.zeros((length, 2), "i4"),
        lambda: np.zeros(length + 1, "i4"),
        lambda: np.zeros(max(0, length - 1), "i8"),
        lambda: np.array([b"text"] * min(length, 500)),
        lambda: np.zeros(length, "c16"),
        lambda: np.zeros(length, [("a", "i4")]),
        lambda: np.int64(2**62),
        lambda: np.bytes_(chance.choice(JSON_TEXTS).encode() or b"x"),
    ]
    value = chance.choice(kinds)()
    attributes = dict(file[name].attrs)
    del file[name]
    if chance.random() < 0.1:
        return
    made = file.create_dataset(name, data=value)
    _restore_attributes(made, attributes)


def _restore_attributes(made: h5py.Dataset, attributes: dict[str, Any]) -> None:
    """Give a new dataset the attributes of the old one, except those that refer to other datasets."""
    for name, value in attributes.items():
        if name not in {"DIMENSION_LIST", "REFERENCE_LIST", "CLASS", "NAME"}:
            made.attrs[name] = value


def _declare(file: h5py.File, chance: random.Random) -> None:
    """Declare 10^12 samples."""
    role = chance.choice(("drive_voltage", "base_acceleration", "m0_velocity", "time"))
    attributes, count = dict(file[role].attrs), chance.choice((10**12, 10**9, 2**62))
    del file[role]
    made = file.create_dataset(role, shape=(count,), dtype="i4", chunks=(51_200,), compression="gzip")
    if chance.random() < 0.5:
        made[:51_200] = 7
    _restore_attributes(made, attributes)
    file.attrs["samples"] = count


def _add_external_link(file: h5py.File, chance: random.Random) -> None:
    role = chance.choice(("drive_voltage", "m0_velocity", "events", "configuration"))
    length = file["m0_velocity"].shape[0]
    kept = dict(file[role].attrs)
    del file[role]
    match chance.randrange(4):
        case 0:
            made = file.create_dataset(role, shape=(length,), dtype="i4", external=[(SECRET, 0, 4 * length)])
        case 1:
            layout = h5py.VirtualLayout(shape=(length,), dtype="i4")
            layout[:] = h5py.VirtualSource(SECRET, "x", shape=(length,))
            made = file.create_virtual_dataset(role, layout)
        case 2:
            file[role] = h5py.ExternalLink(SECRET, "/x")
            return
        case _:
            file[role] = h5py.SoftLink("/" + role)
            return
    _restore_attributes(made, kept)


def _add_circular_link(file: h5py.File, _: random.Random) -> None:
    file["configuration/again"] = file["/"]


def _change_rows(file: h5py.File, chance: random.Random) -> None:
    table = file[chance.choice(("events", "segments", "gaps", "overloads"))]
    column = table[chance.choice([name for name in table if name not in {"row", "n_rows"}])]
    if not len(column):
        return
    row = chance.randrange(len(column))
    if column.dtype.kind == "S":
        column[row] = chance.choice((*TEXTS, *JSON_TEXTS)).encode()[: column.dtype.itemsize]
    else:
        with np.errstate(invalid="ignore"):
            column[row] = np.array(chance.choice(NUMBERS)).astype(column.dtype)


def _change_json(file: h5py.File, chance: random.Random) -> None:
    """Change a value deep inside a JSON text, or the whole text."""
    group = file["configuration"]
    name = chance.choice(sorted(group))
    said = json.loads(bytes(group[name][()]).decode())
    _change_value(said, chance)
    text = json.dumps(said) if chance.random() < 0.85 else chance.choice(JSON_TEXTS) or " "
    del group[name]
    raw = text.encode()
    group.create_dataset(name, data=np.array(raw, dtype=h5py.string_dtype("utf-8", len(raw))))


def _change_value(said: Any, chance: random.Random) -> None:
    while True:
        keys = list(said) if isinstance(said, dict) else list(range(len(said)))
        if not keys:
            return
        key = chance.choice(keys)
        if isinstance(said[key], (dict, list)) and said[key] and chance.random() < 0.8:
            said = said[key]
            continue
        if chance.random() < 0.1:
            del said[key]
        else:
            said[key] = chance.choice(JSON_VALUES)
        return


def _change_result(file: h5py.File, chance: random.Random) -> None:
    results = file["results"]
    group = results[chance.choice(sorted(results))]
    name = chance.choice(sorted(group))
    attributes = dict(group[name].attrs)
    del group[name]
    made = group.create_dataset(
        name, data=chance.choice((np.zeros(3), np.array(b"{}"), np.zeros((2, 2), "i8"), 3.0))
    )
    _restore_attributes(made, attributes)
    if chance.random() < 0.7:
        for mark in [key for key in group.attrs if key.startswith("seal_")]:
            del group.attrs[mark]


CHANGES: tuple[Callable[[h5py.File, random.Random], None], ...] = (
    _change_attribute, _change_known_attribute, _change_known_attribute, _change_channel, _change_channel,
    _scale_channel, _change_rate, _replace_dataset, _replace_dataset, _declare, _add_external_link,
    _add_circular_link,
    _change_rows, _change_rows, _change_json, _change_json, _change_json, _change_result,
)  # fmt: skip


def attack(shard: Shard) -> Tally:
    """Let commands read broken recordings."""
    return attack_commands("recordings", mutant, shard)
