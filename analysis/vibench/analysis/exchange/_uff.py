"""Samples as Universal File Format, dataset 58 in its binary form, with dataset 164 for the units.

Layout: SDRC universal dataset 58, "Function at Nodal DOF", and its binary variant 58b (Structural
Dynamics Research Laboratory, University of Cincinnati). The increment of time has five decimals there,
which is half a millisecond after 200 s at 51.2 kHz; so the rate also stands, exactly, in ID line 5.
"""

from collections.abc import Iterator
from datetime import datetime
from pathlib import Path

from vibench.acquisition.recording import ChannelHeader

from ._excerpt import Excerpt, Watcher, unwatched
from ._uff_format import (
    DELIMITER,
    DOUBLE_BYTES,
    EVENLY_SPACED,
    MONTHS,
    QUANTITIES,
    REAL_DOUBLE,
    TIME_AXIS,
    TIME_RESPONSE,
    UNKNOWN,
    id_line,
    rate_line,
)

SI_UNITS = (
    f"{DELIMITER}\n   164\n{1:10d}{'SI: metre (newton)':<20.20}{2:10d}\n"
    + "".join(f"{factor:25.16E}" for factor in (1.0, 1.0, 1.0))
    + f"\n{273.15:25.16E}\n{DELIMITER}\n"
).replace("E+", "D+")
"""Dataset 164: units code 1, absolute temperature, factors to SI and the offset of the Celsius scale."""
SCALAR = 0
"""Direction of the response: the recording does not say how a sensor points."""


def write_uff(excerpt: Excerpt, path: Path, watcher: Watcher = unwatched) -> None:
    """Write one dataset for each channel, a block at a time; lost samples are NaN."""
    with path.open("xb") as file:
        file.write(SI_UNITS.encode("ascii"))
        for number, channel in enumerate(excerpt.channels, start=1):
            lines = "\n".join(_header(excerpt, channel, number)) + "\n"
            file.write(lines.encode("ascii", "replace"))
            for values in excerpt.channel_blocks(channel.role):
                file.write(values.astype("<f8").tobytes())
                watcher(values.size)
            file.write(f"{DELIMITER}\n".encode("ascii"))


def _header(excerpt: Excerpt, channel: ChannelHeader, number: int) -> Iterator[str]:
    """Lines before the samples: the delimiter, the type, and records 1 to 11."""
    recording = excerpt.recording
    rate = recording.sample_rate_hz
    kind, *exponents = QUANTITIES.get(channel.quantity, UNKNOWN)
    yield DELIMITER
    # Little-endian IEEE numbers behind eleven lines of text.
    yield f"{58:6d}b{1:6d}{2:6d}{11:12d}{excerpt.samples * DOUBLE_BYTES:12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    yield id_line(channel.role)
    yield id_line(f"{excerpt.name} {recording.recording_id}")
    yield id_line(_date(recording.started_utc))
    yield id_line(str(recording.plan.get("name", "")))
    yield id_line(rate_line(rate, excerpt.start))
    point = f" {'NONE':<10}{number:10d}{SCALAR:4d} {'NONE':<10}{0:10d}{0:4d}"
    yield f"{TIME_RESPONSE:5d}{number:10d}{0:5d}{0:10d}{point}"
    times = f"{excerpt.start / rate:13.5E}{1 / rate:13.5E}{0:13.5E}"
    yield f"{REAL_DOUBLE:10d}{excerpt.samples:10d}{EVENLY_SPACED:10d}{times}"
    yield _axis(TIME_AXIS, (0, 0, 0), "time", "s")
    yield _axis(kind, exponents, channel.role, channel.unit)
    yield _axis(0, (0, 0, 0), "NONE", "NONE")
    yield _axis(0, (0, 0, 0), "NONE", "NONE")


def _axis(kind: int, exponents: "tuple[int, ...] | list[int]", label: str, unit: str) -> str:
    return f"{kind:10d}{''.join(f'{each:5d}' for each in exponents)} {label:<20.20} {unit:<20.20}"


def _date(started_utc: str) -> str:
    moment = datetime.fromisoformat(started_utc)
    return f"{moment.day:02d}-{MONTHS[moment.month - 1]}-{moment:%y} {moment:%H:%M:%S}"
