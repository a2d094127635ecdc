"""Facts of a recording: the measurement, its instruments, and how it ended."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Annotated, Any, ClassVar

from pydantic import AwareDatetime, BaseModel, Field, JsonValue, ValidationError

from vibench.acquisition.plan import Measurement
from vibench.acquisition.recording import (
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

from ..errors import UnusableData
from .channel_levels import ChannelLevel, channel_levels
from .channels import OnRead, ignore_reading
from .response import (
    ACCELERATION,
    LOWEST_INTEGRATED_HZ,
    VELOCITY,
    ResponseChannel,
    response_role,
    response_roles,
)

MOST_BYTES = 1e9
"""Required memory [bytes] up to which a recording is not checked against the size of its file."""
BYTES_A_SAMPLE = 80
"""Memory per sample of a stretch analysed at once: three channels and intermediate results [bytes]."""
LARGEST_PACKING = 16.0
"""Largest compression ratio; converter noise is packed 1.2 to 3 times, a noise-free sine 6 times."""


def require_measured_size(recording: Recording) -> None:
    """Refuse a small file that declares more samples than fit into memory; raises UnusableData.

    All other recordings need memory in proportion to the size of their files.
    """
    if recording.samples * BYTES_A_SAMPLE > MOST_BYTES and recording.packing > LARGEST_PACKING:
        raise UnusableData(
            f"{recording.path.name} declares {recording.samples} samples, compressed {recording.packing:.0f} "
            "times, which data of a converter do not allow. Nothing was read; if the data were computed, "
            "read them with h5py, or export some seconds (--from, --until)"
        )


def require_checked(recording: Recording) -> None:
    """Check a recording against its seal if not yet done in this process; raises like `require_intact`."""
    if not recording.is_checked:
        require_intact(recording)


def require_intact(recording: Recording) -> SealCheck:
    """Check every sample, attribute and table against the seal; return the result.

    Recordings without a seal (old or unfinished) pass. Raises UnusableData when the contents were changed.
    """
    found = recording.check_seal(SealDepth.WHOLE)
    if found.state is SealState.DAMAGED:
        raise UnusableData(
            f"{recording.path.name} is damaged ({found.sentence}), so its data cannot be trusted; "
            "restore it from a copy, or measure again"
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
            f"from {LOWEST_INTEGRATED_HZ:g} Hz on; measure a velocity or displacement"
        )
    _require_bench(recording)
    rate = recording.sample_rate_hz
    overload_s: dict[str, float] = {}
    dropouts = _dropouts(recording, response)
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


def _dropouts(recording: Recording, response: str) -> tuple[Dropout, ...]:
    if response not in response_roles(recording):
        return ()
    return ResponseChannel(recording, response).dropouts(0, recording.samples)


def plan_of(recording: Recording) -> Measurement:
    """Return the plan of a recording; raises UnusableData when this version cannot read it."""
    try:
        return Measurement.model_validate(recording.plan)
    except ValidationError as error:
        first = error.errors()[0]
        if first["loc"] == ("excitation",) and first["type"] == "value_error":  # its package is missing
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
