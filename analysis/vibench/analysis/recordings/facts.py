"""Facts of a recording: the measurement, its instruments, how it ended, and the level of each channel."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from functools import reduce
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import AwareDatetime, BaseModel, Field, JsonValue, ValidationError

from vibench.acquisition.plan import Measurement
from vibench.acquisition.recording import (
    ChannelHeader,
    Dropout,
    EventKind,
    FeedbackNote,
    Origin,
    Recording,
    RecordingDescription,
    SealCheck,
    SealDepth,
    SealState,
    feedback_note,
)
from vibench.sim import Specimen, SpecimenTable, fault_in_words

from ..errors import NotEnoughData, UnusableData
from ..signals import DEFAULT_BINS, Envelope, Integers, Reals, runs_of
from .channels import (
    ACCELERATION,
    BASE,
    DRIVE,
    LOWEST_INTEGRATED_HZ,
    VELOCITY,
    OnRead,
    ResponseChannel,
    ignore_reading,
    response_role,
    response_roles,
)

_BLOCK_S = 2.0


@dataclass(frozen=True)
class ChannelLevel:
    """Level of one channel over the whole recording."""

    OWN_UNITS: ClassVar = {
        "envelope": "{0.header.unit}",
        "rms": "{0.header.unit}",
        "peak": "{0.header.unit}",
        "full_scale": "{0.header.unit}",
        "flat_tops": "{0.header.unit}",
    }

    header: ChannelHeader
    envelope: Envelope
    rms: float
    """RMS over the whole recording, including ramps and waits [unit of the channel]."""
    peak: float
    """Largest magnitude over the whole recording [unit of the channel]."""
    full_scale: float
    """Full scale of the converter's input [unit of the channel]."""
    share_at_full_scale: float
    """Fraction of the samples at or above 99.9 % of full scale."""
    flat_tops: tuple[float, ...] = ()
    """Values at which upper or lower peaks are clipped; empty without clipping [unit of the channel]."""
    overflows: int = 0
    """Least number of jumps by the whole span, as when integers overflow; 0 if the jumps are others."""

    @property
    def share_of_range(self) -> float:
        """Peak of the channel divided by full scale."""
        return self.peak / self.full_scale

    @property
    def span(self) -> float:
        """Largest minus smallest value of the channel; zero if its signal is constant."""
        return float(np.nanmax(self.envelope.upper) - np.nanmin(self.envelope.lower))


def channel_levels(recording: Recording, on_read: OnRead = ignore_reading) -> tuple[ChannelLevel, ...]:
    """Return the level of each channel from all samples; raises NotEnoughData when there are none."""
    if recording.samples == 0:
        why = f": {recording.reason}" if recording.reason else ""
        raise NotEnoughData(
            f"{recording.path.name} contains no samples ({recording.state.value}{why}); "
            "there is nothing to analyse"
        )
    length = max(1, -(-recording.samples // DEFAULT_BINS))
    block = length * max(1, round(_BLOCK_S * recording.sample_rate_hz / length))
    offset = np.array([[each.physical_offset] for each in recording.channels])
    full_scale = np.array([[abs(each.physical_per_volt) * each.range_v] for each in recording.channels])
    parts = []
    counts = np.zeros((len(recording.channels), _COUNTED), dtype=np.int64)
    lasting = np.zeros((len(recording.channels), 2), dtype=np.int64)
    jump = np.zeros(len(recording.channels))
    for each in recording.blocks(recording.roles, block):
        parts.append(_extremes(each.values, length))
        jump = np.fmax(jump, np.fmax.reduce(np.abs(np.diff(each.values)), axis=1, initial=0.0))
        for row, shares in enumerate((each.values - offset) / full_scale):
            bins = np.rint((np.clip(shares[np.isfinite(shares)], -1, 1) + 1) * ((_COUNTED - 1) / 2))
            counts[row] += np.bincount(bins.astype(np.int64), minlength=_COUNTED)
            lasting[row] = np.maximum(lasting[row], _lasting(bins))
        on_read(each.first_sample + each.values.shape[1], recording.samples)
    lower, upper, power = (np.concatenate(each, axis=1) for each in zip(*parts, strict=True))
    if np.isnan(lower).all():
        raise NotEnoughData(f"all samples of {recording.path.name} were lost; there is nothing to analyse")
    bins, span = lower.shape[1], np.nanmax(upper, axis=1) - np.nanmin(lower, axis=1)
    time_s = np.minimum((np.arange(bins) + 0.5) * length, recording.samples) / recording.sample_rate_hz
    return tuple(
        ChannelLevel(
            header=header,
            envelope=Envelope(time_s, lower[row], upper[row]),
            rms=float(np.sqrt(np.nansum(power[row]) / counts[row].sum())),
            peak=float(np.nanmax(np.maximum(np.abs(lower[row]), np.abs(upper[row])))),
            full_scale=float(full_scale[row, 0]),
            share_at_full_scale=float(1 - counts[row, _CLIPPED:-_CLIPPED].sum() / counts[row].sum()),
            flat_tops=tuple(
                value
                for side, highest in zip((1, -1), lasting[row], strict=True)
                if (top := _flat_top(counts[row, ::side], highest, header, full_scale[row, 0])) is not None
                and not _rests_at(
                    value := float(
                        offset[row, 0] + side * (2 * top / (_COUNTED - 1) - 1) * full_scale[row, 0]
                    ),
                    lower[row],
                    upper[row],
                )
            ),
            overflows=_overflows(recording, header.role, np.nanmin(lower[row]), span[row], block)
            if header.role != DRIVE and jump[row] > _HALF * span[row]
            else 0,
        )
        for row, header in enumerate(recording.channels)
    )


_COUNTED = 2**16 + 1
"""Number of bins over the input range, used to find flat tops."""
_CLIPPED = 33
"""Bins at each end of the range, from 99.9 % of full scale; converters clip just below full scale."""
_TOPS = (0.1, 0.03, 0.01)
"""Heights of the top parts of a peak that are examined for clipping, relative to the peak's height."""
_FLAT = 0.88
"""Minimum fraction of a clipped top's samples in its upper half; smooth peaks: 0.71, straight peaks: 0.84."""
_FLAT_VALUE = 0.4
"""In the upper half of a clipped peak, at least this fraction of the samples has the clipped value."""
_FEWEST_AT_TOP, _FEWEST_VALUES = 40, 12
_FEWEST_STEPS = 40
"""Minimum height of a peak [converter steps]: a sine of 16 steps has 0.42 of its samples at two values."""
_GAP, _GAP_IN_TOP = 0.01, 0.15
"""Largest range without values in a smooth peak, relative to the peak's height and to the top's height."""
_AS_FREQUENT = 0.4
"""Largest number of samples at one value below a clipped peak, relative to the number of clipped samples."""


def _lasting(bins: Reals) -> tuple[int, int]:
    """Return the highest bin that three successive samples reach, in the signal and in its mirror image."""
    if bins.size < 3:
        return 0, 0
    three = bins[:-2], bins[1:-1], bins[2:]
    return int(reduce(np.minimum, three).max()), int(_COUNTED - 1 - reduce(np.maximum, three).min())


def _flat_top(counts: Integers, lasting: int, header: ChannelHeader, full_scale: float) -> int | None:
    """Return the value at which the upper peaks are clipped; None without clipping, or if this is unclear.

    If the sample clock is locked to the drive, every period has the same few values. The histogram of a
    smooth peak may then look clipped, but has an empty range above ``lasting``, the highest bin that three
    successive samples reach.
    """
    filled = np.flatnonzero(counts)
    if filled.size < 2:
        return None
    total = np.cumsum(counts)
    top, middle = int(filled[-1]), int(np.searchsorted(total, total[-1] / 2))
    height, at_top = top - middle, int(counts[top - 1 :].sum())

    def count_above(value: float) -> int:
        return int(total[-1] - total[max(0, int(value))])

    if height < _LEAST_HEIGHT * (top - filled[0]) or at_top == total[-1]:
        return None
    step = 0.0 if header.volts_per_count is None else header.volts_per_count * abs(header.physical_per_volt)
    resolution = max(1.0, step / full_scale * _COUNTED / 2)
    gap = max(0, int(np.diff(filled[filled >= lasting]).max(initial=0)) - resolution)
    if height > _FEWEST_STEPS * resolution and at_top >= max(
        _FEWEST_AT_TOP, _FLAT_VALUE * count_above(top - height / 2)
    ):
        other = int(counts[middle + 1 : top - 1].max(initial=0))
        if gap <= _GAP * height or 0 < other <= _AS_FREQUENT * at_top:
            return top
    for share in _TOPS:
        whole = count_above(top - share * height)
        values = int(np.count_nonzero(counts[int(top - share * height) :]))
        is_resolved = share * height > _FEWEST_VALUES * resolution and gap <= _GAP_IN_TOP * share * height
        is_counted = whole >= _FEWEST_AT_TOP and values >= _FEWEST_VALUES
        if is_resolved and is_counted and count_above(top - share * height / 2) > _FLAT * whole:
            return top
    return None


_HALF, _FEWEST_OVERFLOWS = 0.5, 3
_SMOOTH = 0.6
"""Power of second differences / power of first differences: at most this if smooth, at least 1.8 in noise."""
_LEAST_MOTION = 2e-3
"""Smallest step near overflows, relative to the span; a square wave has smaller steps."""
_AS_ROUGH, _ROUGHEST = 4.0, 0.15
"""Power of second differences at overflows, at most, relative to the whole signal; largest rms of the latter,
relative to the span."""
_INNER, _OUTER = 0.1, 3
"""Least fraction of the samples in the inner half of the span (a square wave has none), and least number of
samples in the outer half for each overflow (a spike has one or two)."""


def _overflows(recording: Recording, role: str, low: float, span: float, block: int) -> int:
    """Return the number of jumps by over half the span if a signal is smooth without them; otherwise 0.

    Integer overflows are jumps by the span, up as often as down. If a noisy signal fills its span, it is
    enough that it is as smooth at the jumps as elsewhere. Samples of a fast sine are smooth only in the order
    of the drive's phase.
    """
    sums = np.zeros((2, 8))
    for each in recording.blocks((DRIVE, role) if DRIVE in recording.roles else (role, role), block):
        values = (each.values[1] - low) / span
        is_inner = np.abs(values - 0.5) < _HALF / 2
        for row, order in enumerate((slice(None), np.argsort(_turns(each.values[0]), kind="stable"))):
            steps = np.nan_to_num(np.diff(values[order]))
            jumps = np.sign(steps) * (np.abs(steps) > _HALF)
            steps -= jumps
            at = np.flatnonzero(jumps[1:-1])
            near = steps[at + np.arange(3)[:, np.newaxis]]
            powers = near**2 / 3, np.diff(near, axis=0) ** 2 / 2, steps**2, np.diff(steps) ** 2
            places = np.count_nonzero(is_inner), np.count_nonzero(~is_inner)
            sums[row] += (at.size, np.count_nonzero(jumps[at + 1] > 0), *map(np.sum, powers), *places)
    count, up, near, bends_near, motion, bends, inner, outer = sums.T
    is_smooth = bends_near < _SMOOTH * near
    is_smooth &= (bends < _SMOOTH * motion) & (near > _LEAST_MOTION**2 * count)
    is_even = (count >= _FEWEST_OVERFLOWS) & (np.minimum(up, count - up) >= count / 4)
    is_alike = bends_near * (inner + outer) < _AS_ROUGH * bends * count
    is_filled = (inner > _INNER * (inner + outer)) & (outer >= _OUTER * count)
    is_quiet = bends < _ROUGHEST**2 * (inner + outer)
    return int(np.max(count * (is_even & (is_smooth | (is_alike & is_filled & is_quiet)))))


def _turns(drive: Reals) -> Reals:
    """Return the phase of a sine at its samples [turns], from 0 to 1; 0 if there are too few samples."""
    half = drive.size // 2
    if half == 0:
        return np.zeros(drive.size)
    halves = np.nan_to_num(drive[: 2 * half]).reshape(2, half)
    first, second = np.fft.rfft((halves - np.mean(halves)) * np.hanning(half))
    line = int(np.argmax(np.abs(first)))
    advance = float(np.angle(second[line] * np.conj(first[line]))) / (2 * np.pi)
    return np.arange(drive.size, dtype=np.float64) * (round(line - advance) + advance) / half % 1


def _rests_at(value: float, lower: Reals, upper: Reals) -> bool:
    """Return whether an envelope stays near a value for long, like the envelope of a free body before a hit.

    If a signal has only one value, it counts as rest only at zero: a saturated amplifier is also constant.
    """
    is_near = np.maximum(abs(lower - value), abs(upper - value)) < _REST[0] * np.nanmax(
        upper - np.nanmin(lower)
    )
    is_constant = (lower == upper) & (upper != 0)
    if not np.any(is_constant & ~is_near):
        is_near &= ~is_constant
    longest = np.diff(runs_of(is_near), axis=1).max(initial=0)
    return bool(longest >= _REST[1] * lower.size)


_REST = 0.05, 0.02
"""Largest motion at rest, relative to the signal's span; shortest rest, relative to the recording length."""
_LEAST_HEIGHT = 0.1
"""Smallest height of a peak above the median, relative to the span; below, the signal is at rest."""


def _extremes(values: Reals, length: int) -> tuple[Reals, Reals, Reals]:
    """Return the minimum, maximum and sum of squares of each bin, shape (channels, bins)."""
    starts = np.arange(0, values.shape[1], length)
    low, high = np.fmin.reduceat(values, starts, axis=1), np.fmax.reduceat(values, starts, axis=1)
    return low, high, np.add.reduceat(np.where(np.isnan(values), 0.0, values) ** 2, starts, axis=1)


_CLIPPED_SHARE = 0.2
"""Largest fraction of samples at full scale in a usable channel; a sine just up to full scale has 3 %."""


def require_moving_channels(
    levels: Sequence[ChannelLevel], response: str, others: Collection[str] = (DRIVE, BASE)
) -> None:
    """Refuse unusable channels; ``response`` is the analysed channel.

    Raises UnusableData with one sentence that names every unusable channel and says what to check.
    """
    used = (*others, response)
    faults = [each for level in levels if level.header.role in used for each in _faults(level)]
    if faults:
        raise UnusableData("; ".join(faults))


def _faults(level: ChannelLevel) -> Iterator[str]:
    role = level.header.role
    if level.span == 0:
        yield (
            f"all samples of {role} have the same value, so its sensor or its cable gave no signal; "
            "check both and measure again"
        )
    elif level.overflows:
        yield (
            f"{role} jumps at least {level.overflows} times by its whole span, and is smooth without these "
            "jumps, as if integers had overflowed; export it as floating-point numbers or as wider integers"
        )
    elif level.share_at_full_scale > _CLIPPED_SHARE:
        yield (
            f"{role} was at its full scale of {level.full_scale:.3g} {level.header.unit} for "
            f"{100 * level.share_at_full_scale:.0f} % of the time, so its waveform is clipped; "
            "choose a larger range or a smaller drive and measure again"
        )


def require_usable(recording: Recording, response: str, *others: str) -> None:
    """Refuse unusable channels of a recording, from all its samples, like `require_moving_channels`."""
    require_moving_channels(channel_levels(recording), response, others)


MOST_BYTES = 1e9
"""Required memory [bytes] up to which a recording is not checked against the size of its file."""
BYTES_A_SAMPLE = 80
"""Memory per sample of a stretch analysed at once: three channels and intermediate results [bytes]."""
LARGEST_PACKING = 16.0
"""Largest compression ratio; converter noise is packed 1.2 to 3 times, a noise-free sine 6 times."""


def require_measured_size(recording: Recording) -> None:
    """Refuse a small file that declares more samples than memory can hold; raises UnusableData.

    All other recordings need memory in proportion to the size of their files.
    """
    if recording.samples * BYTES_A_SAMPLE > MOST_BYTES and recording.packing > LARGEST_PACKING:
        raise UnusableData(
            f"{recording.path.name} declares {recording.samples} samples, compressed {recording.packing:.0f} "
            "times, which is impossible for data of a converter. Nothing was read; if the data were "
            "computed, read them with h5py, or export some seconds (--from, --until)"
        )


def require_checked(recording: Recording) -> None:
    """Check a recording against its seal, once per process; raises like `require_intact`."""
    if not recording.is_checked:
        require_intact(recording)


def require_intact(recording: Recording) -> SealCheck:
    """Check every sample, attribute and table against the seal; return the result.

    Recordings without a seal (old or unfinished) pass. Raises UnusableData when the contents were changed.
    """
    found = recording.check_seal(SealDepth.WHOLE)
    if found.state is SealState.DAMAGED:
        raise UnusableData(
            f"{recording.path.name} is damaged ({found.sentence}), so its data cannot be trusted; restore "
            "the file from a copy, or measure again"
        )
    return found


@dataclass(frozen=True, eq=False, kw_only=True)
class RecordingFacts(RecordingDescription):
    """Facts of a recording, without the result of an analysis."""

    DOCUMENT: ClassVar = (
        "name path state reason origin started_utc bench_check recording_id duration_s sample_rate_hz "
        "requested_sample_rate_hz excitation=measurement.excitation overload_s dropouts dropout_s "
        "lost_samples feedback=feedback_noted"
    )

    name: str
    duration_s: float
    planned_s: float | None
    measurement: Measurement
    channels: tuple[ChannelLevel, ...]
    overload_s: Mapping[str, float]
    """Time near full scale [s], keyed by role; channels that never came near full scale are left out."""
    dropouts: int
    """Number of vibrometer drop-outs, which every analysis bridges."""
    dropout_s: float
    lost_samples: int
    planned_stretches: int
    whole_stretches: int
    late: tuple[str, ...]
    """One sentence for each moment at which the drive was late relative to its plan."""
    check: str
    """Result of the bench check before the run; empty if there was none."""
    seal: SealCheck
    response: str = VELOCITY
    """Channel whose motion is analysed."""
    feedback: tuple[FeedbackNote, ...] = ()
    """Events that feedback control noted during the run; empty without feedback."""
    feedback_s: tuple[float, ...] = ()
    """Time of each note since the start of the recording [s]."""

    @property
    def mass(self) -> str:
        """Mass whose motion is analysed, such as ``"m0"``."""
        return self.response.partition("_")[0]

    @property
    def feedback_noted(self) -> list[dict[str, Any]]:
        """Kind, time and values of each note."""
        return [
            {"kind": each.kind, "time_s": time_s, **each.numbers}
            for time_s, each in zip(self.feedback_s, self.feedback, strict=True)
        ]

    @property
    def is_simulated(self) -> bool:
        """Whether the instruments were simulated."""
        return self.origin is Origin.SIMULATED

    def level(self, role: str) -> ChannelLevel:
        """Return the level of one channel."""
        return next(each for each in self.channels if each.header.role == role)


def recording_facts(
    recording: Recording, on_read: OnRead = ignore_reading, response: str | None = None
) -> RecordingFacts:
    """Return the facts of a recording; ``on_read`` receives the number of samples read so far.

    ``response`` is the channel whose motion is analysed; by default the channel that measures m0.

    Raises UnusableData when the recording was changed after it was sealed, or this version cannot read its
    plan or bench; NotEnoughData when it has no samples.
    """
    require_measured_size(recording)
    seal = require_intact(recording)
    measurement = plan_of(recording)
    response = response or response_role(recording) or VELOCITY
    low_hz = measurement.excitation.band_hz[0]
    if response.endswith(ACCELERATION) and low_hz < LOWEST_INTEGRATED_HZ:
        raise UnusableData(
            f"{recording.path.name}: the plan starts at {low_hz:g} Hz, but {response} can be integrated only "
            f"at {LOWEST_INTEGRATED_HZ:g} Hz or more; measure a velocity or displacement"
        )
    _require_bench(recording)
    rate = recording.sample_rate_hz
    overload_s: dict[str, float] = {}
    dropouts: tuple[Dropout, ...] = ()
    if response in response_roles(recording):
        dropouts = ResponseChannel(recording, response).dropouts(0, recording.samples)
    for each in recording.overloads:
        if each.channel == response and any(
            one.first <= each.first_sample and each.last_sample < one.stop for one in dropouts
        ):
            continue
        seconds = (each.last_sample - each.first_sample + 1) / rate
        overload_s[each.channel] = overload_s.get(each.channel, 0.0) + seconds
    steps = {id(step.segment): step.segment for step in measurement.excitation.steps()}
    labels = {segment.label for segment in steps.values()}
    played = [each for each in recording.segments if each.label in labels]
    noted = [(each.sample / rate, note) for each in recording.events if (note := feedback_note(each))]
    return RecordingFacts(
        **{each.name: getattr(recording, each.name) for each in fields(RecordingDescription)},
        name=recording.path.name.removesuffix(".part").removesuffix(".h5"),
        duration_s=recording.duration_s,
        planned_s=None if recording.expected_samples is None else recording.expected_samples / rate,
        measurement=measurement,
        channels=channel_levels(recording, on_read),
        overload_s=overload_s,
        dropouts=len(dropouts),
        dropout_s=sum(each.stop - each.first for each in dropouts) / rate,
        lost_samples=sum(each.last_sample - each.first_sample + 1 for each in recording.gaps),
        planned_stretches=len(steps),
        whole_stretches=sum(each.is_complete for each in played),
        late=tuple(each.text for each in recording.events if each.kind == EventKind.LATE),
        check=recording.check_text,
        seal=seal,
        response=response,
        feedback=tuple(note for _, note in noted),
        feedback_s=tuple(time_s for time_s, _ in noted),
    )


def plan_of(recording: Recording) -> Measurement:
    """Return the plan of a recording; raises UnusableData when this version cannot read it."""
    try:
        return Measurement.model_validate(recording.plan)
    except ValidationError as error:
        first = error.errors()[0]
        if first["loc"] == ("excitation",) and first["type"] == "value_error":  # a package is missing
            raise UnusableData(f"{recording.path.name}: {fault_in_words(first)}") from error
        place = ".".join(str(part) for part in first["loc"])
        raise UnusableData(
            f"this version of vibench cannot read the plan in {recording.path.name} "
            f"({place or 'plan'}: {first['msg']}); read the samples with h5py, or update vibench"
        ) from error


def specimen_of(bench: Mapping[str, Any]) -> Specimen:
    """Return the specimen of the bench configuration; defaults and errors as in `described_specimen`."""
    return described_specimen(bench).specimen()


def known_specimen(bench: Mapping[str, Any]) -> Specimen | None:
    """Return the specimen of the bench configuration; None if the configuration describes none."""
    return specimen_of(bench) if bench.get("specimen") else None


def described_specimen(bench: Mapping[str, Any]) -> SpecimenTable:
    """Return the specimen table of the bench configuration; by default the paper's specimen.

    Raises UnusableData for an invalid specimen.
    """
    table = bench.get("specimen", {})
    known = {key: table[key] for key in table if key in SpecimenTable.model_fields or key == "model"}
    try:
        return SpecimenTable.model_validate(known)
    except ValidationError as error:
        first = error.errors()[0]
        raise UnusableData(
            f"the specimen described in the recording is not valid ({'.'.join(map(str, first['loc']))}: "
            f"{first['msg']}); the samples can be read with h5py"
        ) from error


def specimen_difference(simulated: Specimen, recorded: Specimen | None, name: str) -> str:
    """Return a sentence on how a simulated specimen differs from the recorded one; empty if they are equal.

    Parameters
    ----------
    name
        Name of the recording.
    """
    if recorded is None:
        return f"{name} describes no specimen, so the simulated specimen could not be compared with it."
    pairs = zip(_properties(simulated), _properties(recorded), strict=True)
    changed = "; ".join(f"{ours} instead of {theirs}" for ours, theirs in pairs if ours != theirs)
    return f"The simulated specimen is not the one described in {name}: {changed}." if changed else ""


def _properties(specimen: Specimen) -> tuple[str, ...]:
    """Return the properties of a specimen in words; the order of the properties is always the same."""
    law = ", ".join(f"{name} {value_words(value)}" for name, value in asdict(specimen.contact).items())
    return (
        f"masses {value_words(specimen.masses)} kg",
        f"stiffnesses {value_words(specimen.stiffnesses)} N/m",
        f"dampings {value_words(specimen.dampings)} N s/m",
        f"gaps {value_words(specimen.gaps_m)} m",
        f"contact {law}",
    )


def value_words(value: object) -> str:
    """Return a value of a specimen as text."""
    match value:
        case tuple():
            return f"[{', '.join(value_words(each) for each in value)}]"
        case float():
            return f"{value:g}"
        case _:
            return str(value)


class _Finding(BaseModel):
    name: str
    value: JsonValue
    verdict: str
    expected: JsonValue


class _BenchCheck(BaseModel):
    checked: AwareDatetime
    verdict: str
    findings: tuple[_Finding, ...]


class _Bench(BaseModel):
    """The entries of a bench configuration that an analysis reads, for all versions."""

    name: str = ""
    calibration_valid_days: Annotated[int, Field(ge=0, le=1_000_000)] = 0
    specimen: dict[str, JsonValue] | None = None
    amplifier: dict[str, JsonValue] | None = None
    shaker: dict[str, JsonValue] | None = None
    vibrometer: dict[str, JsonValue] | None = None
    accelerometer: dict[str, JsonValue] | None = None
    sensors: dict[str, dict[str, JsonValue]] | None = None


class _Provenance(BaseModel):
    packages: dict[str, str] = Field(default_factory=dict)


def _require_bench(recording: Recording) -> None:
    """Raise UnusableData for an unreadable bench, bench check or provenance."""
    try:
        _Bench.model_validate(recording.bench)
        _Provenance.model_validate(recording.provenance)
        if recording.bench_check:
            _BenchCheck.model_validate(recording.bench_check)
        described_specimen(recording.bench)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise UnusableData(
            f"the bench description in {recording.path.name} cannot be read ({place}: {first['msg']}); "
            "read the samples with h5py, or update vibench"
        ) from error
