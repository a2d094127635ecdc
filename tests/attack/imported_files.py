"""Broken files of other programs, listed and imported: every suffix that `vibench import` reads."""

import random
import tempfile
import wave
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import h5py
import numpy as np
from scipy.io import savemat

from .byte_mutants import mutate_bytes
from .command_attack import attack_commands
from .limits import Case, Ending
from .tally import Shard, Tally
from .text_mutants import mutate_fields

RATE_HZ = 1000
SAMPLES = 1500
MAPPING = """
started_utc = 2026-03-01T12:00:00Z
{rate}
[measurement]
name = "dwell"
excitation = {{ kind = "dwell", amplitude_vpp = 1, frequency_hz = 20, duration_s = 1, settle_s = 0 }}
[[channels]]
source = "{first}"
role = "drive_voltage"
scale = 1
[[channels]]
source = "{second}"
role = "m0_velocity"
scale = 1
"""
TEXT = frozenset({".csv", ".txt", ".unv"})
NAMES = {
    ".h5": ("/a", "/b"), ".nc": ("/a", "/b"), ".mat": ("a", "b"), ".tdms": ("Group/a", "Group/b"),
    ".csv": ("2", "3"),
}  # fmt: skip
UNITS = (("voltage", "V"), ("velocity", "m/s"))
"""Quantity and unit of the two channels."""
SAYS_ITS_RATE = frozenset({".wav", ".tdms", ".csv"})


def _signals() -> np.ndarray:
    return np.random.default_rng(4).uniform(-0.9, 0.9, (2, SAMPLES))


def _hdf5(path: Path) -> None:
    first, second = _signals()
    with h5py.File(path, "w") as file:
        file.create_dataset("a", data=first, chunks=(500,), compression="gzip")
        file["b"] = (second * 2**20).astype("i4")
        file["b"].attrs["scale_factor"] = 2.0**-20
        file["b"].attrs["units"] = "m/s"
        file["table"] = _signals().T


def _mat(path: Path) -> None:
    first, second = _signals()
    savemat(path, {"a": first, "b": second, "s": {"x": first[:9], "name": "text"}}, do_compression=False)


def _wav(path: Path) -> None:
    counts = (_signals().T * 2**15).astype("<i2")
    with wave.open(str(path), "wb") as file:
        file.setparams((2, 2, RATE_HZ, 0, "NONE", ""))
        file.writeframes(counts.tobytes())


def _tdms(path: Path) -> None:
    import nptdms

    with nptdms.TdmsWriter(path) as writer:
        for piece in np.split(_signals(), 3, axis=1):
            writer.write_segment(
                [
                    nptdms.ChannelObject(
                        "Group", name, row, {"wf_increment": 1 / RATE_HZ, "unit_string": unit}
                    )
                    for name, row, (_, unit) in zip("ab", piece, UNITS, strict=True)
                ]
            )


def _csv(path: Path) -> None:
    rows = (f"{k / RATE_HZ},{a:.6f},{b:.6f}\n" for k, (a, b) in enumerate(_signals().T))
    path.write_text("time [s],drive [V],laser [m/s]\n" + "".join(rows))


def _txt(path: Path) -> None:
    rows = (f"{a:.6f};{b:.6f}\n".replace(".", ",") for a, b in _signals().T)
    path.write_text("Messung 1\n\nSpannung (V);Laser (m/s)\n" + "".join(rows))


def _dataset_58(number: int, kind: str, body: bytes) -> bytes:
    quantity, unit = UNITS[number - 1]
    head = "\n".join(
        (
            "    -1", kind, f"channel {number}", "NONE", "01-MAR-26 12:00:00", "NONE", "NONE",
            f"{1:5d}{number:10d}{0:5d}{0:10d} {'NONE':<10}{number:10d}{3:4d} {'NONE':<10}{0:10d}{0:4d}",
            f"{4:10d}{SAMPLES:10d}{1:10d}{0:13.5E}{1 / RATE_HZ:13.5E}{0:13.5E}",
            f"{17:10d}{0:5d}{0:5d}{0:5d} {'time':<20} {'s':<20}",
            f"{11:10d}{1:5d}{0:5d}{0:5d} {quantity:<20} {unit:<20}",
            f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} {'NONE':<20}",
            f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} {'NONE':<20}", "",
        )
    )  # fmt: skip
    return head.encode() + body + b"    -1\n"


def _uff(path: Path) -> None:
    kind = f"{58:6d}b{1:6d}{2:6d}{11:12d}{8 * SAMPLES:12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    path.write_bytes(
        b"".join(_dataset_58(n, kind, row.astype("<f8").tobytes()) for n, row in enumerate(_signals(), 1))
    )


def _unv(path: Path) -> None:
    def text(row: np.ndarray) -> bytes:
        cells = [f"{value:20.11E}" for value in row]
        return ("\n".join("".join(cells[at : at + 4]) for at in range(0, len(cells), 4)) + "\n").encode()

    path.write_bytes(b"".join(_dataset_58(n, f"{58:6d}", text(row)) for n, row in enumerate(_signals(), 1)))


WRITERS = {
    ".h5": _hdf5, ".nc": _hdf5, ".mat": _mat, ".wav": _wav, ".tdms": _tdms,
    ".csv": _csv, ".txt": _txt, ".uff": _uff, ".unv": _unv,
}  # fmt: skip
"""Writers of a valid file of each suffix."""


@cache
def good_files() -> Mapping[str, bytes]:
    """Return a valid file of each suffix."""
    with tempfile.TemporaryDirectory() as name:
        made = {}
        for suffix, write in WRITERS.items():
            write(path := Path(name, f"a{suffix}"))
            made[suffix] = path.read_bytes()
        return made


def mapping(suffix: str) -> bytes:
    """Return the channel mapping of a valid file."""
    first, second = NAMES.get(suffix, ("1", "2"))
    rate = "" if suffix in SAYS_ITS_RATE else f"sample_rate_hz = {RATE_HZ}.0"
    return MAPPING.format(first=first, second=second, rate=rate).encode()


def reading(suffix: str, content: bytes, *options: str) -> Case:
    """Return a case in which `vibench import` reads a file of this suffix and content."""
    name = f"broken{suffix}"
    return Case(("import", name, *options), {name: content, "map.toml": mapping(suffix)})


MAKING = ("--mapping", "map.toml", "--out", "new.h5", "--json")


def mutant(chance: random.Random) -> Case:
    """Break a file of a random suffix."""
    suffix = chance.choice(tuple(WRITERS))
    content = good_files()[suffix]
    if suffix in TEXT and chance.random() < 0.8:
        broken = mutate_fields(content.decode(), chance)
    else:
        broken = mutate_bytes(content, chance, tuple(good_files().values()))
    return reading(suffix, broken, *(MAKING if chance.random() < 0.75 else ("--json",)))


def faults(case: Case, ending: Ending) -> tuple[str, ...]:
    """Return the faults of an import: leftovers after a failure, or a wrong result."""
    wanted = {"new.h5"} if ending.code == 0 and "--out" in case.arguments else set()
    unwanted = set(ending.made) ^ wanted
    return (*ending.faults, *(f"{name} left or missing" for name in sorted(unwanted)))


def attack(shard: Shard) -> Tally:
    """Import broken files."""
    return attack_commands("imports", mutant, shard, faults)
