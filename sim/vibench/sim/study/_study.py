"""A study: every combination of contact laws, dampings, gaps, amplitudes, starts and frequencies."""

import hashlib
import json
import math
from collections.abc import Iterable, Iterator
from enum import StrEnum
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import (
    AfterValidator,
    AliasChoices,
    BeforeValidator,
    Field,
    NonNegativeFloat,
    PositiveFloat,
    TypeAdapter,
    model_validator,
)

from ..engine.run import Accuracy
from ..scene.scene import BUDGET_S, AutomaticDuration, FixedDuration, Given, Observable, Rest, Scene, Target
from ..scene.solve import InBatches, Solver, solve_scene
from ..scene.states_alone import batches_are_worth_it
from ..specimen.drive import Harmonic
from ..specimen.frozen_model import FrozenModel, NumberWith
from ..specimen.specimen_description import ContactWord, SpecimenTable, usual_specimen
from ._grid import (
    COLUMNS,
    FORMAT,
    FREQUENCY,
    IDENTITY_DIGITS,
    MODEL,
    START,
    Column,
    GridPlan,
    StudyAxis,
)

LONGEST = 1_000_000
"""Largest total number of values of all ranges; more values are probably a mistake."""
WHOLE = 1e-9
"""Relative tolerance within which a range has a whole number of steps and so includes its stop."""
ROUNDING_ULPS = 8
"""Largest difference between equal values of two ranges, in units of the last place."""


def frequency_range(start: float, stop: float, step: float) -> tuple[float, ...]:
    """Return `start`, `start` + `step`, ... up to `stop`, which is included if a step reaches it [Hz].

    Raises ValueError when the range is empty or too long.
    """
    if not (0.0 < step < math.inf and math.isfinite(start) and math.isfinite(stop) and start <= stop):
        raise ValueError(
            f"a range from {start:g} to {stop:g} in steps of {step:g} is not allowed:"
            " start must not be above stop, and the step must be positive"
        )
    steps = (stop - start) / step
    if steps >= LONGEST:
        raise ValueError(f"a range of {steps:.3g} values is too long: at most {LONGEST}")
    return tuple(start + step * k for k in range(math.floor(steps * (1.0 + WHOLE) + WHOLE) + 1))


def expand_ranges(given: object) -> object:
    """Return the values, with tables of start, stop and step (also in lists) replaced by numbers."""
    match given:
        case {"start": start, "stop": stop, "step": step, **rest} if not rest:
            # Do not use isinstance, which also accepts true as an int.
            if not {type(start), type(stop), type(step)} <= {float, int}:
                raise ValueError(
                    f"a range from {start!r} to {stop!r} by {step!r} is not allowed: give three numbers"
                )
            try:
                return frequency_range(float(start), float(stop), float(step))
            except OverflowError as error:
                raise ValueError("a number in the range has over 300 digits; give a smaller one") from error
        case list() | tuple():
            values: list[object] = []
            for each in given:
                some = expand_ranges(each)
                values.extend(some if isinstance(some, tuple) else (some,))
                if len(values) > LONGEST:
                    raise ValueError(f"ranges have more than {LONGEST} values in total; give larger steps")
            if not all(isinstance(value, (int, float)) for value in values):
                return values
            distinct: list[float] = sorted(set(values))  # type: ignore[arg-type]
            if values == list(given):
                return distinct  # without ranges: every number was typed, or read from a file
            # Ranges reach the same frequency with different rounding errors; compute it once.
            return [b for a, b in pairwise([-math.inf, *distinct]) if b - a > ROUNDING_ULPS * math.ulp(b)]
        case _:
            return given


MOST_POINTS = 10_000_000
"""Largest number of points of a study; the file of such a study has 2 GB."""
AS_DESCRIBED = "as described"
"""Label of an axis for which no values are given, so that the specimen's value is used."""


class Start(StrEnum):
    """Initial state of a point."""

    REST = "rest"
    UP = "up"
    """Final state of the point at the next lower frequency; rest at the lowest frequency."""
    DOWN = "down"
    """Final state of the point at the next higher frequency; rest at the highest frequency."""


class GivenStart(FrozenModel):
    """Given initial state, the same for every point."""

    label: Annotated[str, Field(min_length=1, max_length=60)]
    """Name of the start in the file and in results."""
    state: tuple[float, float, float, float, float, float]
    """Initial x, y, z, vx, vy, vz [m, m/s]."""

    def __str__(self) -> str:
        return self.label


Numbers = tuple[float, ...]


def _ascending(values: Numbers) -> Numbers:
    for before, after in pairwise(values):
        if not before < after:
            raise ValueError(f"{after:g} comes after {before:g}; give every value once, ascending")
    return values


Positive = Annotated[tuple[PositiveFloat, ...], Field(min_length=1), AfterValidator(_ascending)]
NotNegative = Annotated[tuple[NonNegativeFloat, ...], Field(min_length=1), AfterValidator(_ascending)]
Frequencies = Annotated[Positive, BeforeValidator(expand_ranges)]

TargetError = Annotated[float, Field(gt=0.0, lt=1.0), NumberWith("%")]
"""Relative error, such as 0.01 or "1 %"."""
TargetTime = Annotated[float, Field(gt=0.0, lt=math.inf), NumberWith("ms", "s", "min", "h")]
"""Time in seconds or with a unit, such as "200 ms", "2 s", "5 min"."""
StudyObservable = Literal[Observable.RESPONSE, Observable.LYAPUNOV, Observable.SCATTER]
"""Observables that give single numbers for each point."""


def _own_law(values: dict[str, Any]) -> tuple[str, ...]:
    return (_described_specimen(values).contact,)


def _own_damping(values: dict[str, Any]) -> tuple[float, ...] | None:
    own_s = _described_specimen(values).damping_time_s
    return None if own_s is None else (own_s,)


def _own_gap(values: dict[str, Any]) -> tuple[float, ...] | None:
    own_m = _described_specimen(values).gap_m
    return (own_m,) if isinstance(own_m, float) else None


def _described_specimen(values: dict[str, Any]) -> SpecimenTable:
    """Return the specimen of a study during validation; the default specimen if the given one is invalid."""
    found: SpecimenTable = values.get("specimen") or usual_specimen()
    return found


_scenes = TypeAdapter(Scene)


def scene_identity(scene: Scene, continued: str = "") -> str:
    """Return the digest of a scene's content.

    Parameters
    ----------
    scene
        Scene. The digest depends on every bit of its numbers, but not on the order of its fields.
    continued
        Identity of the scene that this scene continues, if any. This identity replaces initial state and
        phase in the digest, because both are results of that scene.
    """
    content = _scenes.dump_python(scene, mode="python")
    # The start's name has no effect on the motion.
    content["start"].pop("name", None)
    if content["target"] is None:
        # Without this, digests in files from before scenes had targets would not match.
        del content["target"]
    if continued:
        content["start"] = {"continues": continued}
        del content["drive"]["phase_rad"]
    # Python writes a float with the fewest exact digits, and infinity as a word.
    text = json.dumps(content, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:IDENTITY_DIGITS]


AXES_OF_SPECIMEN = 3
"""Number of leading axes of a study that define the specimen: contact law, damping, gap."""


class Study(GridPlan):
    """Plan of a study; equal studies give equal results."""

    called: ClassVar[str] = "study"
    format: ClassVar[str] = FORMAT

    specimen: SpecimenTable = Field(
        default_factory=usual_specimen, validation_alias=AliasChoices("specimen", "structure")
    )
    """Name or path of a specimen, or a table that may name one in ``model``; by default the paper's."""
    frequencies_hz: Frequencies
    """Drive frequencies [Hz]: numbers, and tables of start, stop and step; or one such table."""
    amplitudes_m: Positive
    """Amplitudes of the base displacement [m]."""
    models: Annotated[tuple[ContactWord, ...], Field(min_length=1, default_factory=_own_law)]
    """Contact laws, by their names in `vibench.sim.specimen`; by default that of the specimen."""
    damping_times_s: Annotated[NotNegative | None, Field(default_factory=_own_damping)]
    """Ratios of damping to stiffness, c_i / k_i [s]; by default that of the specimen."""
    gaps_m: Annotated[Positive | None, Field(default_factory=_own_gap)]
    """Clearances at both stops [m]; by default that of the specimen."""
    starts: Annotated[tuple[Start | GivenStart, ...], Field(min_length=1)] = (Start.REST,)
    """Initial states of each point, which may lead to different motions: rest, up, down, or given ones."""
    observe: tuple[StudyObservable, ...] = (Observable.RESPONSE,)
    """Quantities to compute. Sections and spectra are available only for single scenes, because their lengths
    differ."""
    accuracy: Accuracy = Accuracy.STANDARD
    """Accuracy level of every point."""
    duration_s: PositiveFloat | Literal["auto"] = 30.0
    """Length of each run [s]; "auto" runs until the motion has settled."""
    window_s: PositiveFloat = 5.0
    """Length of the window, at the end of the run, in which responses are evaluated [s]."""
    budget_s: NonNegativeFloat = BUDGET_S
    """Processor time per point [s] for integrating chaos further and, with sensitive dependence on the start,
    for other starts."""
    error: TargetError | None = None
    """Target relative error of each point, such as "1 %"; replaces accuracy, duration and budget."""
    time_s: TargetTime | None = None
    """Limit of the computing time per point, such as 2 or "2 s"; one minute if only an error is given."""

    @model_validator(mode="after")
    def _target_stands_alone(self) -> Self:
        if self.target is not None:
            self.require_target_alone("accuracy", "duration_s", "budget_s")
        return self

    @model_validator(mode="after")
    def _labels_differ(self) -> Self:
        for name, labels in (("models", self.models), ("starts", self.start_labels)):
            twice = sorted({label for label in labels if labels.count(label) > 1})
            if twice:
                raise ValueError(f"{name} contains {twice[0]!r} twice; give each entry once")
        return self

    @model_validator(mode="after")
    def _scenes_are_allowed(self) -> Self:
        """Raise ValueError for an unknown model or a window that is too short, before any computation."""
        for model in range(len(self.models)):
            for gap in range(1 if self.gaps_m is None else len(self.gaps_m)):
                for end in (0, -1):  # the lowest and the highest amplitude and frequency
                    self.scene((model, 0, gap, end, 0, end), Rest())
        return self

    @model_validator(mode="after")
    def _fits_a_file(self) -> Self:
        if self.grid.size > MOST_POINTS:
            raise ValueError(f"{self.grid.size} points were requested; a study has at most {MOST_POINTS}")
        return self

    @property
    def start_labels(self) -> tuple[str, ...]:
        """Names of the initial states in the file and in results."""
        return tuple(str(start) for start in self.starts)

    @property
    def axes(self) -> tuple[StudyAxis, ...]:
        """Axes of the study's results, the slowest-varying first."""
        return (
            StudyAxis(MODEL, self.models, "", "contact law"),
            _axis("damping_time", self.damping_times_s, "s", "damping over stiffness of every link"),
            _axis("gap", self.gaps_m, "m", "clearance at both stops"),
            StudyAxis("amplitude", self.amplitudes_m, "m", "amplitude of the base displacement"),
            StudyAxis(START, self.start_labels, "", "state from which a point begins"),
            StudyAxis(FREQUENCY, self.frequencies_hz, "Hz", "drive frequency"),
        )

    @property
    def columns(self) -> tuple[Column, ...]:
        """Columns that the study's file stores for each point."""
        return COLUMNS

    def scene(self, place: tuple[int, ...], start: Rest | Given, phase_rad: float = 0.0) -> Scene:
        """Return the scene at a position of the grid.

        Raises ValueError when a scene with these values is not allowed.
        """
        model, damping, gap, amplitude, _, frequency = place
        return Scene(
            specimen=self.specimen.specimen(
                self.models[model],
                None if self.damping_times_s is None else self.damping_times_s[damping],
                None if self.gaps_m is None else self.gaps_m[gap],
            ),
            drive=Harmonic(self.frequencies_hz[frequency], self.amplitudes_m[amplitude], phase_rad),
            observe=self.observe,
            accuracy=self.accuracy,
            duration=self.duration,
            start=start,
            budget_s=self.budget_s,
            target=self.target,
        )

    def first_scene(self, place: tuple[int, ...]) -> Scene:
        """Return the scene at a position of the grid that continues no other point."""
        start = self.starts[place[-2]]
        return self.scene(place, Given(start.state, start.label) if isinstance(start, GivenStart) else Rest())

    def label_after(self, place: tuple[int, ...], before: tuple[int, ...]) -> str:  # noqa: ARG002
        """Return the name of an initial state taken from the final state at another frequency."""
        return f"end at {self.frequency_at(before):g} Hz"

    def frequency_at(self, place: tuple[int, ...]) -> float:
        """Return the drive frequency at a position of the grid [Hz]."""
        return self.frequencies_hz[place[-1]]

    @property
    def target(self) -> Target | None:
        """Target error and time of each point; None if neither is given."""
        return None if self.error is None and self.time_s is None else Target(self.error, self.time_s)

    @property
    def duration(self) -> FixedDuration | AutomaticDuration:
        """Duration setting of every point's run: fixed, or until the motion settles."""
        if self.target is None and isinstance(self.duration_s, float):
            return FixedDuration(self.duration_s, self.window_s)
        return AutomaticDuration(window_s=self.window_s)


def _axis(name: str, values: Numbers | None, units: str, long_name: str) -> StudyAxis:
    """Return an axis with these numbers, or with the label `AS_DESCRIBED` if there are no numbers."""
    if values is None:
        return StudyAxis(name, (AS_DESCRIBED,), "", long_name)
    return StudyAxis(name, values, units, long_name)


OTHER_STARTS = 8
"""Assumed number of runs per point if the motion may depend sensitively on the initial state."""


def study_solver(study: Study) -> Solver:
    """Return the solver of a study, which solves points in batches or one by one.

    Batches need points that do not continue other points, wide processor registers, and enough simulated time
    per specimen. Even then, points with non-Hertz stops or the accuracy *reference* are solved one by one.
    """
    is_chained = any(start in (Start.UP, Start.DOWN) for start in study.starts)
    starts = OTHER_STARTS if study.budget_s > 0.0 else 1
    motions = starts * math.prod(study.grid.shape[AXES_OF_SPECIMEN:])
    pays = study.target is None and not is_chained and batches_are_worth_it(motions, study.duration)
    return InBatches() if pays else solve_scene


MOST_GAPS = 1000.0
"""Ratio of base amplitude to gap above which a warning is given; for the paper's gap this means 45 mm, more
than the stroke of any shaker."""
WIDEST_M = 0.1
"""Gap above which a warning is given [m]; a whole specimen on a shaker is hardly larger."""
_MICRO = 1e-6


def plausibility_warnings(amplitudes_m: Iterable[float], gaps_m: Iterable[float]) -> Iterator[str]:
    """Yield warnings about implausible base amplitudes [m] and gaps [m] (infinite without a stop)."""
    gaps_m = tuple(gaps_m)
    largest_m, narrowest_m = max(amplitudes_m, default=0.0), min(gaps_m)
    if largest_m > MOST_GAPS * narrowest_m:
        yield (
            f"an amplitude of {largest_m:g} m is {largest_m / narrowest_m:.2g} times the gap of "
            f"{narrowest_m:g} m and is used as given; if {largest_m:g} micrometres were meant, "
            f"give {_MICRO * largest_m:g}"
        )
    widest_m = max((each for each in gaps_m if math.isfinite(each)), default=0.0)
    if widest_m > WIDEST_M:
        yield (
            f"a gap of {widest_m:g} m is wide for a specimen on a shaker and is used as given; if "
            f"{widest_m:g} micrometres were meant, give {_MICRO * widest_m:g}"
        )
