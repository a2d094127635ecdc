"""National Instruments' TDMS as a source, read by npTDMS."""

import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InvalidRequest, UnusableData
from ..signals.arrays import Reals
from ._alignment import stated_rate_hz
from ._source_channel import SourceChannel

SIGNATURE = b"TDSm"
"""First bytes of every segment (NI, TDMS File Format Internal Structure)."""
INTERVAL, UNIT = "wf_increment", "unit_string"
START, OFFSET = "wf_start_time", "wf_start_offset"
"""Properties that NI's software writes; the offset is that of the first sample from the start time [s]."""
START_ERROR_S = 1e-6
"""Start times are kept in microseconds."""


@dataclass(frozen=True, eq=False)
class TdmsSource:
    """Channels named ``"group/channel"``, scaled as the file says."""

    found: Mapping[SourceChannel, Any]

    @property
    def channels(self) -> tuple[SourceChannel, ...]:
        """In the order of the file."""
        return tuple(self.found)

    def read(self, channel: SourceChannel, start: int, stop: int) -> Reals:
        """Read a stretch."""
        return np.asarray(self.found[channel][start:stop], dtype=np.float64)


@contextmanager
def open_tdms(path: Path) -> Iterator[TdmsSource]:
    """Open a file.

    Raises InvalidRequest when npTDMS is not installed, and UnusableData when it is not TDMS.
    """
    try:
        import nptdms.log  # noqa: PLC0415 - an optional extra
        from nptdms import TdmsFile  # noqa: PLC0415 - as above
    except ImportError as error:
        raise InvalidRequest(
            f"{path.name} needs npTDMS to be read, which is not installed: pip install 'vibench[exchange]'"
        ) from error
    # Ours to open: npTDMS does not close what it finds damaged.
    with path.open("rb") as raw:
        if raw.read(len(SIGNATURE)) != SIGNATURE:  # npTDMS would find nothing, and say nothing
            raise UnusableData(f"{path.name} is no TDMS file; copy it again, with its .tdms suffix")
        raw.seek(0)
        # It writes what it doubts to standard error, at any length; what matters, it raises.
        nptdms.log.log_manager.set_level(logging.CRITICAL)
        file = TdmsFile.open(raw)
        found = [
            each
            for group in file.groups()
            for each in group.channels()
            if len(each) > 1 and each.dtype.kind in "iuf"
        ]
        starts = [np.datetime64(each.properties[START], "us") for each in found if START in each.properties]
        origin = min(starts, default=np.datetime64(0, "us"))
        yield TdmsSource({_channel(file, each, origin): each for each in found})


def _channel(file: Any, channel: Any, origin: np.datetime64) -> SourceChannel:
    own = channel.properties
    interval_s = float(own.get(INTERVAL, 0.0))
    facts = [
        ("dt", interval_s),
        *own.items(),
        *file[channel.group_name].properties.items(),
        *file.properties.items(),
    ]
    rate_hz, trouble = stated_rate_hz(facts)
    is_placed = START in own or OFFSET in own
    start = np.datetime64(own[START], "us") if START in own else origin
    return SourceChannel(
        name=f"{channel.group_name}/{channel.name}",
        samples=len(channel),
        label=channel.name,
        sample_rate_hz=rate_hz,
        unit=str(own.get(UNIT, "")),
        start_s=(start - origin) / np.timedelta64(1, "s") + float(own.get(OFFSET, 0.0))
        if is_placed
        else None,
        start_error_s=START_ERROR_S if START in own else 0.0,
        time_trouble=trouble,
    )
