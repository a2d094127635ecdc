"""Notes of a feedback controller in a recording, one model for each kind.

A note is stored as an event: the event has the note's kind, and the event's text is a JSON object of all
other values. Because an event's text is limited in length, notes of version 1 omit their version.
"""

import json
from enum import StrEnum
from math import inf, isfinite
from typing import Annotated, Any, Final, Literal, TypeAlias, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from ..errors import RecordingError
from ._tables import Event, SegmentLabel

VERSION: Final = 1


class Steadiness(StrEnum):
    """Kind of a settled motion."""

    PERIODIC = "periodic"
    APERIODIC = "aperiodic"
    """Statistically stationary motion without a short period: quasi-periodic or chaotic."""
    UNSETTLED = "unsettled"


class Hold(StrEnum):
    """Whether the controlled amplitude of the base (or of m0) was within the tolerance."""

    WITHIN = "within tolerance"
    OUTSIDE = "outside tolerance"
    OPEN = "not controlled"


class JumpSide(StrEnum):
    """Side of a jump: the branch of the response before or after the jump."""

    BEFORE = "before"
    AFTER = "after"


class JumpSearchEnd(StrEnum):
    """How a search for a jump ended."""

    LOCALISED = "localised"
    STEEP = "steep, but no jump"
    BRANCH_LOST = "its branch was not found again"
    OUT_OF_TIME = "the time for the search was over"
    ELSEWHERE = "the motion jumped elsewhere each time"


class LockResult(StrEnum):
    """How a search for a resonance ended."""

    LOCKED = "locked"
    LOST = "not met"
    AT_THE_EDGE = "outside the range"
    ABSENT = "no motion of that period"
    BETWEEN_MOTIONS = "a jump of the phase, as between two motions"

    @classmethod
    def _missing_(cls, value: object) -> "LockResult | None":
        """Return the enum member for a value written by an older version."""
        return cls.LOST if value == "not met within the tries" else None


SixFigures = Annotated[float, AfterValidator(lambda value: float(f"{value:.6g}"))]
"""Number stored to six significant digits, because an event's text is limited in length."""
Way = Literal["up", "down"]


class AbstractNote(BaseModel):
    """Values of one result of a feedback controller, in the order in which they are written."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True, defer_build=True)

    version: Literal[1] = VERSION

    @property
    def numbers(self) -> dict[str, Any]:
        """Return the values that differ from their defaults, as JSON types."""
        return self.model_dump(mode="json", by_alias=True, exclude_defaults=True)

    @property
    def text(self) -> str:
        """Return the text of the event that stores this note."""
        return json.dumps(self.numbers)


class SettledNote(AbstractNote):
    """Settled motion at a frequency, as recorded in a note."""

    kind: Literal["settled"] = "settled"
    frequency_hz: float
    """Commanded drive frequency [Hz]."""
    motion: Steadiness
    period: int
    """Period of the motion in drive periods; 0 if the motion is not periodic."""
    waited_s: float
    scatter: SixFigures
    noise: SixFigures
    setting_vpp: SixFigures
    base_m_per_s2: SixFigures
    base_u: SixFigures
    level: Hold


class SegmentNote(AbstractNote):
    """Base level and motion over a recorded segment."""

    kind: Literal["achieved"] = "achieved"
    segment: Literal[SegmentLabel.STEP, SegmentLabel.SEARCH, SegmentLabel.RESONANCE]
    frequency_hz: float
    drive_hz: float
    """Drive frequency in the converter's time [Hz]."""
    base_m_per_s2: SixFigures
    base_u: SixFigures
    level: Hold
    response_ii: SixFigures
    motion: Steadiness
    period: int


class DwellNote(AbstractNote):
    """Number of level checks in a dwell, and number of levels outside tolerance."""

    kind: Literal["achieved"] = "achieved"
    segment: Literal[SegmentLabel.DWELL]
    looks: int
    looks_outside: int


class SweepNote(AbstractNote):
    """Number of steps in a sweep, and number of steps with a level outside tolerance."""

    kind: Literal["achieved"] = "achieved"
    segment: Literal[SegmentLabel.SWEEP]
    steps: int
    steps_outside: int
    average_s: float


class LevelNote(AbstractNote):
    """Base level at one check during a dwell."""

    kind: Literal["level"] = "level"
    at_s: SixFigures
    base_m_per_s2: SixFigures
    base_u: SixFigures
    setting_vpp: SixFigures
    level: Hold


class ExcursionNote(AbstractNote):
    """Part of a sweep in which the base level was outside its tolerance."""

    kind: Literal["level"] = "level"
    from_hz: SixFigures
    to_hz: SixFigures
    worst: SixFigures
    """Largest relative deviation of the level, with sign."""
    level: Hold


class JumpNote(AbstractNote):
    """Result of a search for a jump between two settled frequencies."""

    kind: Literal["jump"] = "jump"
    direction: Way
    pass_number: int = Field(alias="pass")
    frequency_hz: SixFigures
    before_hz: float
    after_hz: float
    response_before: SixFigures
    response_after: SixFigures
    how: JumpSearchEnd
    arrived: JumpSide
    """Branch of motions on which the pass continued."""


class ResonanceNote(AbstractNote):
    """Resonance of a mode at one level of the base."""

    kind: Literal["resonance"] = "resonance"
    level: int
    """Number of the level in the order in which levels are played, from 0."""
    asked_m_per_s2: float
    frequency_hz: SixFigures | None
    """Frequency of the phase resonance; None where no resonance was found."""
    frequency_u_hz: SixFigures | None
    at_hz: SixFigures
    """Drive frequency in the recorded segment [Hz]."""
    phase_deg: SixFigures
    response_ii: SixFigures
    base_m_per_s2: SixFigures
    base_u: SixFigures
    held: Hold
    motion: Steadiness
    tries: int
    lock: LockResult
    periods: int = 0
    """Number of drive periods in the search or the phase-locked loop; 0 if the number is not recorded."""
    mode_hz: SixFigures | None = None
    """Natural frequency; absent if the flanks do not determine it."""
    mode_u_hz: SixFigures | None = None
    damping_ratio: SixFigures | None = None
    harmonic: int = 1
    """Number of the harmonic of m0 whose phase is used: above 1 for a superharmonic resonance."""
    subharmonic: int = 1
    """Number of drive periods in one period of m0: above 1 for a subharmonic resonance."""
    harmonic_m: SixFigures | None = None
    """Amplitude of the tracked harmonic or subharmonic [m]."""


class NoiseNote(AbstractNote):
    """Error of the base spectrum during one realisation."""

    kind: Literal["spectrum"] = "spectrum"
    realisation: int
    """Number of the realisation; -1 during equalisation."""
    base_rms: SixFigures
    """Rms acceleration of the base in the band [m/s2]."""
    asked_rms: SixFigures
    """Requested rms acceleration in the band at full level, with notches [m/s2]."""
    within: SixFigures
    """Fraction of the spectral lines within the plan's tolerance of the target of this realisation."""
    worst_db: SixFigures
    worst_hz: SixFigures
    notched: SixFigures
    """Fraction of the spectral lines that are lowered to limit the response."""
    kurtosis: SixFigures
    """Kurtosis of the base's acceleration; 3 for Gaussian noise."""


class HeldResponseNote(AbstractNote):
    """Controlled response at one frequency, and the base level."""

    kind: Literal["held_response"] = "held_response"
    frequency_hz: float
    """Commanded drive frequency [Hz]."""
    response_m: SixFigures
    response_ii: SixFigures
    base_m_per_s2: SixFigures
    base_u: SixFigures
    setting_vpp: SixFigures
    level: Hold


class BranchEnd(StrEnum):
    """Reason for the end of a branch."""

    RANGE = "its frequency left the range"
    POINTS = "it has as many points as were requested"
    LOST = "no further point was found, however short the step"


class BranchPointNote(AbstractNote):
    """One motion of a branch, held by a fast control loop; amplitudes are peak values of fundamentals."""

    kind: Literal["branch_point"] = "branch_point"
    point: int
    """Number of the point along the branch, from 0."""
    frequency_hz: SixFigures
    base_m: SixFigures
    base_u_m: SixFigures = 0.0
    """Standard uncertainty [m], from the scatter of the averaged values; 0 if the recording states none."""
    m0_m: SixFigures
    m0_u_m: SixFigures = 0.0
    phase_deg: SixFigures
    """Phase of the displacement of m0 relative to the base displacement [deg]."""
    residue: SixFigures
    """Rms of the second and higher harmonics of base displacement, relative to its fundamental."""
    residue_acceleration: SixFigures
    """Rms of the second and higher harmonics of base acceleration, relative to its fundamental."""
    reference_v: SixFigures
    """First Fourier coefficient of the controller's target [V]."""
    tries: int


class Stability(StrEnum):
    """Stability of a motion under prescribed base motion without feedback."""

    STABLE = "stable"
    UNSTABLE = "unstable"
    OPEN = "not determined"
    """Stability is not determined, because the bounds on the multiplier include 1 or the motion changed."""


class BranchStabilityNote(AbstractNote):
    """Stability of one motion of a branch, determined with small perturbations."""

    kind: Literal["branch_stability"] = "branch_stability"
    point: int
    """Number of the branch point that has this motion."""
    stability: Stability
    multiplier: SixFigures | None
    """Magnitude of the largest Floquet multiplier under prescribed base motion; None if unknown."""
    multiplier_u: SixFigures | None
    """Standard uncertainty of this magnitude; 95 % bounds are at 2.1 times this uncertainty."""
    perturbation: SixFigures
    """Requested relative rms change of the fundamentals of base and m0; applies to the larger change."""
    moved: SixFigures
    """Relative change of the fundamental of m0 from before to after the perturbations."""


class BranchEndNote(AbstractNote):
    """How the measurement of a branch ended."""

    kind: Literal["branch_end"] = "branch_end"
    points: int
    end: BranchEnd


class UntilNote(AbstractNote):
    """Error bounds of results, for a step or dwell that is recorded until the bounds are small enough."""

    kind: Literal["until"] = "until"
    stretch: int
    """Number of the recorded step; 1 for an excitation without steps."""
    wishes: dict[str, SixFigures]
    """Requested relative 95 % bounds, by name of the result."""
    longest_s: SixFigures
    """Longest time for which the step or dwell may be recorded [s]."""
    bounds: dict[str, SixFigures | None] = Field(default_factory=dict)
    """Relative 95 % bounds at the last analysis; None if not determined; empty before the first analysis."""
    looked_s: SixFigures = 0.0
    """Recorded time of the step or dwell at the last analysis [s]."""
    looks: int = 0
    hindrance: str = ""
    """Reason why no bounds could be determined; empty if all bounds were determined."""
    recorded_s: SixFigures | None = None
    """Total recorded time of the step or dwell [s]; None while it is being recorded."""

    @property
    def shares(self) -> tuple[float, ...]:
        """Error bound relative to the requested bound, for each result; infinite if unknown."""
        found = {name: inf if bound is None else bound for name, bound in self.bounds.items()}
        return tuple(found.get(name, inf) / wish for name, wish in self.wishes.items())

    @property
    def is_reached(self) -> bool:
        """Whether all error bounds are as small as requested."""
        return max(self.shares) <= 1.0

    @property
    def sentence(self) -> str:
        """Return a sentence with the reached and requested bounds, and the remaining or recorded time."""
        text = ", ".join(
            f"{name} {'not known' if bound is None else f'± {100 * bound:.2g} %'} (goal: {100 * wish:.2g} %)"
            for name, wish in self.wishes.items()
            for bound in (self.bounds.get(name),)
        )
        # A mean's scatter is inversely proportional to the square root of the time.
        needed_s = self.looked_s * max(self.shares) ** 2 if self.bounds else inf
        if self.recorded_s is not None:
            end = "known well enough" if self.is_reached else "longest time"
            text = f"{end} after {self.recorded_s:.4g} s: {text}"
        elif self.is_reached:
            text = f"{text}: reached"
        elif needed_s <= self.longest_s:
            text = f"{text}, about {needed_s - self.looked_s:.3g} s left"
        elif isfinite(needed_s):
            text = f"{text}, not within {self.longest_s:.3g} s"
        return f"{text} ({self.hindrance})" if self.hindrance else text


FeedbackNote: TypeAlias = (
    SettledNote
    | SegmentNote
    | DwellNote
    | SweepNote
    | LevelNote
    | ExcursionNote
    | JumpNote
    | ResonanceNote
    | NoiseNote
    | HeldResponseNote
    | BranchPointNote
    | BranchStabilityNote
    | BranchEndNote
    | UntilNote
)
_NOTES: TypeAdapter[FeedbackNote] = TypeAdapter(FeedbackNote, config=ConfigDict(defer_build=True))
_KINDS = frozenset(note.model_fields["kind"].default for note in get_args(FeedbackNote))


def feedback_note(event: Event) -> FeedbackNote | None:
    """Return the note in an event; None for truncated events and events without a note.

    Raises RecordingError when the note is not valid, for example because a newer version wrote it.
    """
    if event.kind not in _KINDS:
        return None
    try:
        numbers = json.loads(event.text)
    except (ValueError, RecursionError):
        return None
    if not isinstance(numbers, dict):
        return None
    try:
        return _NOTES.validate_python({**numbers, "kind": event.kind})
    except ValidationError as error:
        version = numbers.get("version", VERSION)
        raise RecordingError(
            f"the note {event.kind!r} at sample {event.sample} (version {version}) cannot be read by this "
            f"vibench (it reads version {VERSION}); read the samples with h5py, or update vibench"
        ) from error
