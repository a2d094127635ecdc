"""Read TDMS files of National Instruments with npTDMS."""

import logging
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from itertools import chain, combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InvalidRequest, UnusableData
from ..signals import Reals
from ._source_channel import Source, SourceChannel, exact_step, scale_among, unit_among
from ._times import restarts, stated_start, stated_times

SIGNATURE = b"TDSm"
"""First bytes of every segment (NI, TDMS File Format Internal Structure)."""
LONGEST_NS = 1000 * 86400 * 10**9
"""Time stamps are taken modulo a thousand days [ns], which a double resolves to 15 ns."""
SCALES = {"Linear", "Polynomial", "RTD", "Table", "Thermocouple", "Thermistor", "Strain", "Add", "Subtract"}
"""Types of scales that npTDMS applies, with the parameters in the file."""
_SCALE_TYPE = re.compile(r"NI_Scale\[\d+\]_Scale_Type")
START_ERROR_S = 1e-6
"""Resolution [s] of start times, which are stored in microseconds."""


@contextmanager
def open_tdms(path: Path) -> Iterator[Source]:
    """Open a TDMS file; channels are named ``"group/channel"`` and scaled as the file states.

    Raises InvalidRequest when npTDMS is not installed, and UnusableData when the file is not TDMS.
    """
    try:
        import nptdms.log  # noqa: PLC0415 - an optional extra
        from nptdms import TdmsFile  # noqa: PLC0415 - as above
        from nptdms.reader import TdmsReader  # noqa: PLC0415 - as above
    except ImportError as error:
        raise InvalidRequest(
            f"reading {path.name} needs npTDMS, which is not installed: pip install 'vibench[exchange]'"
        ) from error
    # Open the file here, because npTDMS does not close damaged files.
    with path.open("rb") as raw:
        if raw.read(len(SIGNATURE)) != SIGNATURE:  # npTDMS would find no channels and raise no error
            raise UnusableData(f"{path.name} is not a TDMS file; copy it again, with its .tdms suffix")
        raw.seek(0)
        # Keep npTDMS from writing warnings to standard error; errors are still raised.
        nptdms.log.log_manager.set_level(logging.CRITICAL)
        file = TdmsFile.open(raw)
        statements: dict[str, dict[int, tuple[tuple[str, Any], ...]]] = {}
        counts: dict[str, dict[int, int]] = {}

        class _StatementsReader(TdmsReader):  # type: ignore[misc] # npTDMS has no types
            """Keep each segment's properties and sample counts; npTDMS keeps only the last and the total."""

            _segment = 0

            def _update_object_metadata(self, segment: Any) -> None:
                self._before = {path: each.num_values for path, each in self.object_metadata.items()}
                super()._update_object_metadata(segment)
                self._segment += 1
                for name, each in self.object_metadata.items():
                    if added := each.num_values - self._before.get(name, 0):
                        counts.setdefault(name, {})[self._segment] = added

            def _update_object_properties(self, properties: Any) -> None:
                super()._update_object_properties(properties)
                for name in properties or ():
                    # Near the end of a second, npTDMS converts a time to a text that is wrong by a second.
                    statements.setdefault(name, {})[self._before.get(name, 0)] = tuple(
                        (each, value.as_datetime64() if hasattr(value, "as_datetime64") else value)
                        for each, value in self.object_metadata[name].properties.items()
                    )

        raw.seek(0)
        _StatementsReader(raw).read_metadata()
        found = [
            each
            for group in file.groups()
            for each in group.channels()
            if len(each) > 1 and each.dtype.kind in "iufM"
        ]
        segments = dict(_unlike_segments({each.path: counts[each.path] for each in found}))
        yield Source({_channel(file, each, statements, segments): partial(_read, each) for each in found})


def _unlike_segments(counts: Mapping[str, Mapping[int, int]]) -> Iterator[tuple[str, str]]:
    """Yield path and segments of each channel that is as long as another one but has other segments.

    Channels that share all segments, follow one another, or take turns are left out.
    """
    layouts = {tuple(each.items()): each for each in counts.values()}
    for one, other in combinations(layouts.values(), 2):
        turns = pairwise(zip(one, other, strict=False))
        is_in_turn = all(max(now) < min(then) for now, then in turns) and [*one.values()] == [*other.values()]
        is_apart = max(one) < min(other) or max(other) < min(one)
        is_clear = one.keys().isdisjoint(other) and (is_apart or is_in_turn)
        if not is_clear and sum(one.values()) == sum(other.values()):
            for path, each in counts.items():
                if each in (one, other):
                    yield path, ", ".join(f"{segment}: {count}" for segment, count in each.items())


def _read(channel: Any, start: int, stop: int) -> Reals:
    values = channel[start:stop]
    if values.dtype.kind == "M":
        return np.asarray(values.astype("M8[ns]").astype(np.int64) % LONGEST_NS * 1e-9)
    return np.asarray(values, dtype=np.float64)


def _channel(
    file: Any, channel: Any, statements: Mapping[str, Mapping[int, Any]], segments: Mapping[str, str]
) -> SourceChannel:
    def facts(path: str) -> list[tuple[str, Any]]:
        return [fact for each in statements.get(path, {}).values() for fact in each]

    own, group = facts(channel.path), file[channel.group_name].path
    everywhere = chain.from_iterable(map(facts, statements))
    times = stated_times((*channel.properties.items(), *own, *facts(group), *facts("/")), everywhere)
    if changed := sorted(n for n, v in own if n.startswith("NI_Scale") and v != channel.properties[n]):
        raise ValueError(f"{changed[0]} of {channel.name} changes within the file")
    starts_s = {
        first: start_s
        for first, each in (statements[channel.path] if own else {}).items()
        if (start_s := stated_start(each)[0]) is not None and first < len(channel)
    }
    runs, jumps = restarts(starts_s, times["sample_rate_hz"], len(channel))
    times["time_trouble"] = times["time_trouble"] or jumps
    if channel.path in segments and len(runs) == 1:
        times["shifts"] += (("samples of segments", segments[channel.path]),)
    times["start_error_s"] += START_ERROR_S
    times["start_s"] = next(iter(starts_s.values()), times["start_s"])
    step = exact_step(channel.dtype)
    unknown = [f"{n} = {v}" for n, v in own if _SCALE_TYPE.fullmatch(n) and v not in SCALES]
    return SourceChannel(
        name=f"{channel.group_name}/{channel.name}",
        samples=len(channel),
        label=channel.name,
        step=step,
        unit="s" if channel.dtype.kind == "M" else unit_among(own),
        stated_scale=", ".join(unknown) or scale_among(own, are_counts=step is not None),
        runs=runs,
        **times,
    )
