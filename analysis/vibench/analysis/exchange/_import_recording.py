"""Import a file as a recording, with a mapping, an origin and a checksum.

The mapping gives the times of the plan's parts; without times, the parts follow one another.
"""

import hashlib
import json
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from itertools import combinations, groupby, pairwise
from math import frexp, inf
from pathlib import Path
from typing import Any

import numpy as np

from vibench.acquisition import Block, Overload, open_recording
from vibench.acquisition.plan import AbstractExcitation, Family, Segment, Step
from vibench.acquisition.recording import (
    GAPS,
    ChannelHeader,
    Origin,
    RecordingHeader,
    RecordingState,
    RecordingWriter,
    collect_provenance,
    create_recording,
)

from ..errors import InvalidRequest, UnusableData
from ..recordings.channels import ALIGNMENT_ERRORS, BASE, DRIVE
from ..recordings.facts import channel_levels, require_moving_channels
from ..signals import Reals, runs_of
from ._alignment import Alignment, Piece, align
from ._excerpt import BLOCK_SAMPLES, TransferObserver, ignore_progress
from ._mapping import KNOWN_ROLES, ChannelMapping, ImportMapping
from ._source import find_channel, open_source
from ._source_channel import Source, SourceChannel

_VIBRATING = {"velocity", "acceleration", "displacement", "force"}
"""Quantities that vary during every test; other quantities, such as temperature, may stay constant."""
_DRIVEN = {DRIVE, "amplifier_voltage", BASE}
_FEWEST, _LONGER = 16, 4
"""Minimum number of equal last samples that count as held; their minimum ratio to any other equal run."""
_WEAK_STEPS = 3.0
"""Largest distance of neighbours from a constant value [converter steps] in a weak signal (not held)."""
_PATTERN, _FEWEST_VALUES = 64, 16
"""Number of last samples that are searched for earlier in the record; minimum number of distinct ones."""
_SEARCHED = 1 << 17
"""Number of samples at the end of a record in which repeated samples are searched for."""
_JUMP = 0.02
"""Minimum jump where samples start to repeat, relative to their range; a periodic motion has no jump."""
_SAME_TURNS = 1e-3
"""Largest difference from whole drive periods at which repeated samples count as a periodic motion."""


def held_values(
    source: Source,
    channel: SourceChannel,
    pieces: tuple[Piece, ...],
    mapped: ChannelMapping,
    excitation: AbstractExcitation,
    rate_hz: float,
) -> Iterator[tuple[int, int, str]]:
    """Yield first sample, end and description of each stretch without new values.

    A working channel is not constant for a whole period of the lowest frequency. Exceptions are weak signals
    of a coarse converter (also until the next hit or burst), exact zeros before a hit, and exact zeros
    between hits or bursts in drive and base.
    """
    quantity, _ = mapped.kind
    if mapped.role not in KNOWN_ROLES and quantity not in _VIBRATING:
        return
    is_noise, is_drive = excitation.family is Family.NOISE, mapped.role in _DRIVEN or quantity == "force"
    runs, step = _runs(source, channel)
    period = max(_FEWEST, int(rate_hz / excitation.band_hz[0]) + 1)
    natural = [b - a for a, b in runs if b - a < period and b < channel.samples]
    at_end = min(period, max(_FEWEST, _LONGER * max(natural, default=0)))
    for start, stop in runs:
        if not (at_end if stop == channel.samples else period) <= stop - start < channel.samples:
            continue
        (value,) = source.read(channel, start, start + 1)
        near = source.read(channel, max(0, start - _FEWEST), start)
        if not is_noise:
            after = source.read(channel, stop, min(stop + _FEWEST, channel.samples))
            near = np.concatenate((near, after))
        is_weak = np.all(np.abs(near - value) <= _WEAK_STEPS * step)
        may_rest = is_noise and value == 0.0 and (start == 0 or is_drive)
        if not is_weak and not may_rest:
            yield start, stop, f"holds {value:.6g}"
    first = max(0, channel.samples - _SEARCHED)
    times = np.concatenate([each.span(first, channel.samples) for each in pieces])
    end = source.read(channel, channel.samples - times.size, channel.samples)
    if repeated := _repeated(end, times / rate_hz, excitation):
        yield channel.samples - repeated, channel.samples, "repeats earlier values"


def _runs(source: Source, channel: SourceChannel) -> tuple[list[tuple[int, int]], float]:
    """Return the runs of at least `_LONGER` equal values, and the smallest step between unequal values."""
    runs: list[tuple[int, int]] = []
    first, place, before, step = 0, 0, np.nan, np.inf
    for block in source.blocks(channel):
        steps = np.abs(np.diff(block, prepend=before))
        step = min(step, float(np.min(steps, where=steps > 0, initial=np.inf)))
        changes = place + np.flatnonzero(steps != 0)
        place, before = place + block.size, block[-1]
        ends = np.append(changes, place) if place == channel.samples else changes
        starts = np.append(first, ends[:-1])
        is_long = ends - starts >= _LONGER
        runs += zip(starts[is_long].tolist(), ends[is_long].tolist(), strict=True)
        first = int(changes[-1]) if changes.size else first
    return runs, step


def _repeated(values: Reals, times_s: Reals, excitation: AbstractExcitation) -> int:
    """Return the number of last values that repeat earlier values exactly; 0 for a periodic motion."""
    last = values.size - 1
    if last < _PATTERN or np.unique(values[-_PATTERN:]).size < _FEWEST_VALUES:
        return 0
    found = np.arange(_PATTERN - 1, last)
    for back in range(_PATTERN):
        found = found[values[found - back] == values[last - back]]
    if not found.size:
        return 0
    lag = last - int(found[-1])
    differs = np.flatnonzero(values[lag:] != values[:-lag])
    plan = excitation.model_dump(include={"frequency_hz", "frequencies_hz", "repetition_hz"})
    lag_s = times_s[last] - times_s[last - lag]
    turns = np.hstack([each for each in plan.values() if each is not None] or [np.nan]) * lag_s
    if not differs.size or np.any(np.abs(turns - np.rint(turns)) < _SAME_TURNS):
        return 0
    start = lag + int(differs[-1]) + 1
    first = max(lag, start - _PATTERN)
    jump = np.max(np.abs(values[first:start] - values[first - lag : start - lag]))
    return values.size - start if jump > _JUMP * np.ptp(values[start:]) else 0


@dataclass(frozen=True)
class PartSpan:
    """A part of the plan as a range of samples in the file."""

    segment: Segment
    start: int
    stop: int
    """Index one past the last sample of the part."""


def place_parts(mapping: ImportMapping, sample_rate_hz: float, samples: int) -> tuple[PartSpan, ...]:
    """Return the plan's parts as sample ranges; parts beyond the end of the file are cut or left out.

    Raises InvalidRequest when there are too many parts, parts overlap, or no part begins inside the file.
    """
    planned = list(_recorded_steps(mapping.measurement.excitation))
    stretches = _stated_times(mapping, planned) if mapping.parts else _in_turn(mapping.begins_s, planned)
    parts = [
        PartSpan(each.segment, round(start_s * sample_rate_hz), round(min(stop_s * sample_rate_hz, FARTHEST)))
        for each, (start_s, stop_s) in zip(planned, stretches, strict=False)
        if start_s * sample_rate_hz < FARTHEST and round(start_s * sample_rate_hz) < samples
    ]
    if not parts:
        raise InvalidRequest(
            f"no part of the plan begins within the {samples / sample_rate_hz:.3g} s of the file; "
            "correct begins_s or parts in the mapping"
        )
    return tuple(parts)


def _recorded_steps(excitation: AbstractExcitation) -> Iterator[Step]:
    """Yield the parts of the plan; steps that a run records without interruption are joined."""
    joined = 0

    def part(step: Step) -> int:
        nonlocal joined
        joined += step.settle_s > 0
        return joined

    for _, steps in groupby(excitation.steps(), key=lambda step: (step.segment, part(step))):
        first, *rest = steps
        yield replace(first, record_s=first.record_s + sum(each.record_s for each in rest))


def _in_turn(begins_s: float, planned: Sequence[Step]) -> Iterator[tuple[float, float]]:
    now_s = begins_s
    for each in planned:
        start_s = now_s + each.settle_s
        now_s = start_s + each.record_s
        yield start_s, now_s


def _stated_times(mapping: ImportMapping, planned: Sequence[Step]) -> Iterator[tuple[float, float]]:
    parts = mapping.parts
    if len(parts) > len(planned):
        raise InvalidRequest(
            f"{len(parts)} parts are given, but the plan of {mapping.measurement.name} has {len(planned)}; "
            "give one entry for each part that was recorded"
        )
    for before, after in pairwise(parts):
        if after.start_s < before.stop_s:
            raise InvalidRequest(
                f"a part begins at {after.start_s:g} s, before the previous part ends at "
                f"{before.stop_s:g} s; give parts in the order of time, without overlap"
            )
    return ((each.start_s, each.stop_s) for each in parts)


FARTHEST = 2.0**62
"""Sample number beyond the end of any file."""
LEAST_PEAK, MOST_PEAK = 1e-100, 1e30
"""Allowed range of a channel's largest value; values outside it suggest a wrongly stated byte order."""
_LEAST_MARK = 99.0
"""Smallest number that may mark lost samples, such as 99 or -9999."""
NEAR_FULL_SCALE = 0.95
"""Fraction of full scale from which a sample counts as overloaded, as during acquisition."""


@dataclass(frozen=True, eq=False)
class _ChannelImport:
    """One channel to import, with its mapping and its source channel."""

    mapped: ChannelMapping
    source: SourceChannel
    pieces: tuple[Piece, ...]
    late_s: float
    held: tuple[range, ...] = ()
    """Stretches of the time axis without new values, whose samples count as lost [sample intervals]."""

    def read(self, source: Source, start: int, stop: int) -> Reals:
        """Return samples of the common time axis from ``start`` to ``stop``; missing samples are NaN."""
        values = np.full(stop - start, np.nan)
        begin = bisect_right(self.pieces, start, key=lambda piece: piece.end)
        for piece in self.pieces[begin:]:
            if piece.place >= stop:
                break
            first, last = max(start, piece.place), min(stop, piece.end)
            shift = piece.first - piece.place
            values[first - start : last - start] = source.read(self.source, first + shift, last + shift)
        for span in self.held:
            values[max(0, span.start - start) : max(0, span.stop - start)] = np.nan
        return values


def import_recording(
    path: Path, mapping: ImportMapping, out: Path, observer: TransferObserver = ignore_progress
) -> Path:
    """Write the recording ``out`` from a file, in blocks; return its path.

    Channels are aligned by the times in the file. Missing samples, and values that are not finite, count as
    lost samples of all channels. The stored "volts" are the numbers in the file. Integers of up to 31 bits
    stay exact; other numbers are stored in steps of 2^-30 of the power of two above the largest number.

    Parameters
    ----------
    observer
        Receives the number of values written since the last call.

    Raises
    ------
    InvalidRequest
        When mapping and file contradict each other.
    UnusableData
        When the file is damaged.
    RecordingError
        When ``out`` exists or cannot be written. A failed import leaves no file.
    """
    with open_source(path) as source:
        found = [find_channel(source, each.source, path) for each in mapping.channels]
        _require_own_sources(mapping, found)
        aligned = align(found, mapping, path)
        samples, rate = aligned.places, aligned.rate_hz
        wanted = tuple(map(_ChannelImport, mapping.channels, found, aligned.pieces, aligned.late_s))
        wanted, samples, held = _without_held(source, wanted, mapping, rate, samples)
        parts = place_parts(mapping, rate, samples)
        planned = len(mapping.parts) or len(list(_recorded_steps(mapping.measurement.excitation)))
        if (whole := sum(each.stop <= samples for each in parts)) < planned:
            text = f"only {whole} of {planned} planned parts are complete in the file"
            aligned = replace(aligned, remarks=(*aligned.remarks, text))
        header = RecordingHeader(
            channels=tuple(_header(path.name, source, each) for each in wanted),
            sample_rate_hz=rate,
            expected_samples=samples,
            origin=_origin(wanted, mapping, path),
            plan_json=mapping.measurement.model_dump_json(),
            bench_json=json.dumps(_bench(path, mapping, wanted, aligned, held)),
            confirmations=mapping.confirmations,
            provenance=replace(
                collect_provenance(),
                started_utc=mapping.started_utc.astimezone(UTC).isoformat(timespec="microseconds"),
            ),
        )
        writer = create_recording(out, header)
        try:
            _write(writer, source, wanted, parts, samples, observer)
            _require_samples(writer, path)
        except BaseException:
            # Delete the incomplete recording: the imported file still exists.
            writer.finish(RecordingState.FAILED, "the import was not completed")
            out.unlink(missing_ok=True)
            raise
        made = writer.finish(RecordingState.COMPLETE, f"imported from {path.name}")
        try:
            with open_recording(made) as recording:
                for each in channel_levels(recording):
                    require_moving_channels((each,) * (each.overflows > 0), each.header.role)
        except UnusableData:
            made.unlink()
            raise
        return made


def _require_own_sources(mapping: ImportMapping, found: Sequence[SourceChannel]) -> None:
    """Refuse one source for a channel of m0 and for the drive, the base or another quantity of m0."""
    known = [
        (each.role, one)
        for each, one in zip(mapping.channels, found, strict=True)
        if each.role in KNOWN_ROLES
    ]
    for (role, one), (other, same) in combinations(known, 2):
        if one is same and (role.startswith("m0_") or other.startswith("m0_")):
            raise InvalidRequest(
                f"{role} and {other} are both read from {one.title}; correct the source of one of them"
            )


def _without_held(
    source: Source, wanted: tuple[_ChannelImport, ...], mapping: ImportMapping, rate_hz: float, samples: int
) -> tuple[tuple[_ChannelImport, ...], int, list[str]]:
    """Mark held values within the plan's parts; return the channels, the number of samples, and remarks.

    If values are held up to the end, the record ends where they begin. Other held values count as lost.
    """
    parts = [range(each.start, min(each.stop, samples)) for each in place_parts(mapping, rate_hz, samples)]
    excitation, remarks, end, kept = mapping.measurement.excitation, [], samples, []
    for each in wanted:
        held: list[range] = []
        found = held_values(source, each.source, each.pieces, each.mapped, excitation, rate_hz)
        for start, stop, what in found:
            spans = [span for piece in each.pieces if (span := piece.span(start, stop))]
            if any(max(part[0], span[0]) < min(part[-1], span[-1]) for part in parts for span in spans):
                end = min(end, spans[0][0]) if stop == each.source.samples else end
                held += spans
                times = f"from {spans[0][0] / rate_hz:.6g} to {(spans[-1][-1] + 1) / rate_hz:.6g} s"
                remarks.append(f"{each.mapped.role} {what} {times}")
        kept.append(replace(each, held=tuple(held)))
    return tuple(kept), end, remarks


def _require_samples(writer: RecordingWriter, path: Path) -> None:
    if not writer.samples:
        raise UnusableData(f"{path.name} has no sample with numbers in all channels; choose other channels")


def _origin(wanted: tuple[_ChannelImport, ...], mapping: ImportMapping, path: Path) -> Origin:
    """Return the origin of the recording; it is simulated if at least one channel is simulated."""
    origins = {each.source.origin for each in wanted if each.source.origin is not None}
    if mapping.origin is not None and origins - {mapping.origin}:
        raise InvalidRequest(
            f"the mapping has origin = {mapping.origin.value!r}, but {path.name} states "
            f"{' and '.join(sorted(origins))}; leave origin out of the mapping, or import another file"
        )
    return Origin.SIMULATED if Origin.SIMULATED in {*origins, mapping.origin} else Origin.REAL


def _header(name: str, source: Source, each: _ChannelImport) -> ChannelHeader:
    mapped, found = each.mapped, each.source
    quantity, unit = mapped.kind
    try:
        factor = mapped.factor(found.unit)
    except ValueError as error:
        raise InvalidRequest(f"{name}: {error}") from error
    if found.stated_scale and mapped.scale is None:
        raise InvalidRequest(
            f"{name} states {found.stated_scale} for {found.name}, but not whether the numbers are already "
            "scaled; give scale in the mapping"
        )
    if found.quantity not in {"", quantity} and mapped.role != DRIVE and not mapped.file_unit:
        raise InvalidRequest(
            f"{name} gives {found.quantity} as the quantity of {found.name}, which does not fit "
            f"{mapped.role}; choose another channel or role, or give file_unit if the file is wrong"
        )
    if found.are_counts and not (found.unit or mapped.file_unit) and mapped.scale is None:
        what, one = ("counts", "count") if found.full_scale is None else ("fractions of full scale", "1")
        raise InvalidRequest(
            f"{name} has {what} without a unit for {found.name}; give {unit} per {one} as scale in the "
            "mapping"
        )
    full_scale = mapped.full_scale or found.full_scale
    return ChannelHeader(
        role=mapped.role,
        physical_channel=found.name,
        quantity=quantity,
        unit=unit,
        physical_per_volt=factor,
        physical_offset=mapped.offset,
        range_v=_power_of_two_above(_peak(source, found, name), name) if full_scale is None else full_scale,
        volts_per_count=found.step,
        coupling=mapped.coupling,
        sensitivity=mapped.sensitivity,
        sensitivity_unit=mapped.sensitivity_unit,
        serial=mapped.serial,
        calibration_date="" if mapped.calibration_date is None else mapped.calibration_date.isoformat(),
        delay_s=mapped.delay_s - each.late_s,
        long_name=mapped.long_name or found.label,
    )


def _peak(source: Source, channel: SourceChannel, name: str) -> float:
    """Return the largest magnitude; raises UnusableData if it seems to mark lost samples, such as -9999."""

    def largest(below: float) -> float:
        blocks = map(np.abs, source.blocks(channel))
        return max((float(each[each < below].max(initial=0.0)) for each in blocks), default=0.0)

    peak = largest(inf)
    if peak >= _LEAST_MARK and peak == round(peak) and 0 < 100 * largest(peak) < peak:
        count = sum(int(np.count_nonzero(np.abs(each) == peak)) for each in source.blocks(channel))
        if count > 1:
            raise UnusableData(
                f"{name} has {count} samples of exactly {peak:g} or -{peak:g} in {channel.name}, over 100 "
                "times its other values, as if to mark lost samples; set such samples to nan"
            )
    return peak


def _power_of_two_above(peak: float, name: str) -> float:
    """Return the smallest power of two that is at least ``peak``; ``name`` appears in the error.

    Raises UnusableData when a recording cannot store the peak.
    """
    if not LEAST_PEAK < peak < MOST_PEAK:
        if peak == 0:
            return 1.0
        raise UnusableData(
            f"{name} has a channel whose largest number is {peak:g}, but a recording stores only peaks from "
            f"{LEAST_PEAK:g} to {MOST_PEAK:g}; convert the channel to another unit, or repair the file"
        )
    mantissa, exponent = frexp(peak)
    return 2.0 ** (exponent - 1 if mantissa == 0.5 else exponent)


def _bench(
    path: Path,
    mapping: ImportMapping,
    wanted: Sequence[_ChannelImport],
    aligned: Alignment,
    held: Sequence[str],
) -> dict[str, Any]:
    """Return the known facts about the bench and about the imported file."""
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    bench: dict[str, Any] = {
        "name": f"imported from {path.name}",
        "imported": {
            "file": path.name,
            "bytes": path.stat().st_size,
            "sha256": digest,
            "imported_utc": datetime.now(UTC).isoformat(timespec="seconds"),
            "mapping": mapping.model_dump(mode="json"),
            "channels": [asdict(each.source) for each in wanted],
            "time": list(aligned.remarks),
            ALIGNMENT_ERRORS: {
                each.mapped.role: error for each, error in zip(wanted, aligned.errors_s, strict=True)
            },
            "time_contradicted": aligned.is_contradicted,
            "held": list(held),
        },
    }
    if mapping.specimen is not None:
        bench["specimen"] = mapping.specimen.model_dump(mode="json", exclude_none=True)
    if mapping.calibration_valid_days is not None:
        bench["calibration_valid_days"] = mapping.calibration_valid_days
    return bench


def _write(
    writer: RecordingWriter,
    source: Source,
    wanted: Sequence[_ChannelImport],
    parts: Sequence[PartSpan],
    samples: int,
    observer: TransferObserver,
) -> None:
    starts = {each.start: each.segment for each in parts}
    stops = {each.stop for each in parts}
    edges = {*range(0, samples, BLOCK_SAMPLES), *starts, *(stop for stop in stops if stop < samples), samples}
    ordered, gaps = sorted(edges), 0
    for start, stop in pairwise(ordered):
        if start in stops:
            writer.end_segment()
        if start in starts:
            writer.begin_segment(starts[start].label, **starts[start].numbers)
        values = np.stack([each.read(source, start, stop) for each in wanted])
        for block in _blocks(values, start, wanted):
            gaps += block.first_sample > writer.samples
            if gaps > GAPS.capacity:
                raise InvalidRequest(
                    f"samples are missing in more than {GAPS.capacity} places of the file, and a recording "
                    "cannot store more gaps; import a shorter file, or a file without lost samples"
                )
            writer.append(block)
        observer(values.size)
    if samples in stops:
        writer.end_segment()


def _blocks(values: Reals, first: int, wanted: Sequence[_ChannelImport]) -> Iterator[Block]:
    """Yield blocks without missing values, with marks on samples near full scale."""
    for start, stop in runs_of(np.all(np.isfinite(values), axis=0)).tolist():
        kept = np.ascontiguousarray(values[:, start:stop])
        yield Block(first + start, kept, tuple(_overloads(kept, first + start, wanted)))


def _overloads(values: Reals, first: int, wanted: Sequence[_ChannelImport]) -> Iterator[Overload]:
    for row, each in zip(values, wanted, strict=True):
        full_scale = each.mapped.full_scale or each.source.full_scale
        if full_scale is not None:
            for start, stop in runs_of(np.abs(row) >= NEAR_FULL_SCALE * full_scale).tolist():
                yield Overload(each.mapped.role, first + start, first + stop - 1)
