"""A study: every combination of models, dampings, gaps, amplitudes, starts and frequencies, as one value."""

import math
from enum import StrEnum
from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    NonNegativeFloat,
    PositiveFloat,
    model_validator,
)

from ..model import (
    ALUMINIUM,
    PAPER_FREQUENCIES_HZ,
    PAPER_MASSES,
    PAPER_RADIUS_M,
    STEEL,
    Accuracy,
    Harmonic,
    Specimen,
    Triple,
    hertz_stiffness,
    model_named,
)
from ..scene import AutomaticDuration, FixedDuration, Given, Observable, Rest, Scene
from ._axes import FREQUENCY, MODEL, START, Grid, StudyAxis, grid_of
from ._frequency_range import listed

MOST_POINTS = 10_000_000
"""A file of 2 GB: a range that asks for more is a slip of the pen."""
ANY_GAP_M = 1e-5
"""For asking whether a model's name is known, which depends on no gap."""


class Structure(BaseModel):
    """The paper's specimen where nothing else is said (Gong et al. 2025, section 2)."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True)

    masses_kg: Triple = PAPER_MASSES
    """m0, m1, m2."""
    single_frequencies_hz: Triple = PAPER_FREQUENCIES_HZ
    """f0, f1, f2 of the single oscillators: k_i = m_i (2 pi f_i)^2."""
    hertz_stiffness: float = hertz_stiffness(STEEL, ALUMINIUM, PAPER_RADIUS_M)
    """k of F = k d^(3/2) at a stop [N/m^1.5]; what other models are fitted to."""

    def specimen(self, model: str, damping_time_s: float, gap_m: float) -> Specimen:
        """Build one specimen; raises ValueError in one sentence when a number or the model is not allowed."""
        stiffnesses = tuple(
            m * (2.0 * math.pi * f) ** 2
            for m, f in zip(self.masses_kg, self.single_frequencies_hz, strict=True)
        )
        k0, k1, k2 = stiffnesses
        return Specimen(
            masses=self.masses_kg,
            stiffnesses=(k0, k1, k2),
            dampings=(damping_time_s * k0, damping_time_s * k1, damping_time_s * k2),
            gap_m=gap_m,
            contact=model_named(model, self.hertz_stiffness, gap_m),
        )


class Start(StrEnum):
    """The state from which a point begins."""

    REST = "rest"
    UP = "up"
    """The end of the point at the next lower frequency; the lowest begins at rest."""
    DOWN = "down"
    """The end of the point at the next higher frequency; the highest begins at rest."""


class GivenStart(BaseModel):
    """A state of one's own, for every point the same."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    label: Annotated[str, Field(min_length=1, max_length=60)]
    """How the start is called in the file and in results."""
    state: tuple[float, float, float, float, float, float]
    """x, y, z, vx, vy, vz [m, m/s]."""

    def __str__(self) -> str:
        return self.label


Numbers = tuple[float, ...]


def _ascending(values: Numbers) -> Numbers:
    for before, after in pairwise(values):
        if not before < after:
            raise ValueError(f"{after:g} comes after {before:g}; give every value once, ascending")
    return values


def _known(model: str) -> str:
    """Refuse a name that no structure would understand, with its key."""
    Structure().specimen(model, damping_time_s=0.0, gap_m=ANY_GAP_M)
    return model


Model = Annotated[str, AfterValidator(_known)]
Positive = Annotated[tuple[PositiveFloat, ...], Field(min_length=1), AfterValidator(_ascending)]
NotNegative = Annotated[tuple[NonNegativeFloat, ...], Field(min_length=1), AfterValidator(_ascending)]
Frequencies = Annotated[Positive, BeforeValidator(listed)]
StudyObservable = Literal[Observable.RESPONSE, Observable.LYAPUNOV, Observable.SCATTER]
"""What has one number a point."""


class Study(BaseModel):
    """What is to be predicted, completely: two equal studies have equal answers."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True)

    frequencies_hz: Frequencies
    """A list, or a table with start, stop and step, or several of these in a list."""
    amplitudes_m: Positive
    """Amplitudes of the base displacement."""
    models: Annotated[tuple[Model, ...], Field(min_length=1)] = ("hertz",)
    """Contact laws as `vibench.sim.model` spells them."""
    damping_times_s: NotNegative = (2e-5,)
    """c_i = damping time * k_i."""
    gaps_m: Positive = (45e-6,)
    """Clearance at both stops."""
    starts: Annotated[tuple[Start | GivenStart, ...], Field(min_length=1)] = (Start.REST,)
    """Where each point begins: the state that is reached may depend on it."""
    observe: tuple[StudyObservable, ...] = (Observable.RESPONSE,)
    """What is looked at; sections and spectra, whose lengths differ, are asked of one scene at a time."""
    accuracy: Accuracy = Accuracy.STANDARD
    """Of every point."""
    duration_s: PositiveFloat | Literal["auto"] = 30.0
    """Length of each run; "auto" runs until the motion has settled."""
    window_s: PositiveFloat = 5.0
    """Length of the end of the run that is observed."""
    structure: Structure = Structure()
    """Masses, springs and Hertz stiffness; the paper's when absent."""

    @model_validator(mode="after")
    def _labels_differ(self) -> Self:
        for name, labels in (("models", self.models), ("starts", self.start_labels)):
            twice = sorted({label for label in labels if labels.count(label) > 1})
            if twice:
                raise ValueError(f"{name} names {twice[0]!r} twice; give each once")
        return self

    @model_validator(mode="after")
    def _scenes_are_allowed(self) -> Self:
        """Refuse now, and not in each point, a model that nobody knows or a window that is too short."""
        for model in range(len(self.models)):
            for gap in range(len(self.gaps_m)):
                self.scene((model, 0, gap, 0, 0, 0), Rest())
        return self

    @model_validator(mode="after")
    def _fits_a_file(self) -> Self:
        points = grid_of(self.axes).size
        if points > MOST_POINTS:
            raise ValueError(f"{points} points are asked for; a study holds at most {MOST_POINTS}")
        return self

    @property
    def start_labels(self) -> tuple[str, ...]:
        """Names of the starts."""
        return tuple(str(start) for start in self.starts)

    @property
    def axes(self) -> tuple[StudyAxis, ...]:
        """Dimensions of the results, in order."""
        return (
            StudyAxis(MODEL, self.models, "", "contact law"),
            StudyAxis("damping_time", self.damping_times_s, "s", "damping over stiffness of every link"),
            StudyAxis("gap", self.gaps_m, "m", "clearance at both stops"),
            StudyAxis("amplitude", self.amplitudes_m, "m", "amplitude of the base displacement"),
            StudyAxis(START, self.start_labels, "", "state from which a point begins"),
            StudyAxis(FREQUENCY, self.frequencies_hz, "Hz", "drive frequency"),
        )

    @property
    def grid(self) -> Grid:
        """All points."""
        return grid_of(self.axes)

    def scene(self, place: tuple[int, ...], start: Rest | Given, phase_rad: float = 0.0) -> Scene:
        """Make the scene at a place of the grid.

        Raises
        ------
        ValueError
            When a scene of these numbers is not allowed.

        """
        model, damping, gap, amplitude, _, frequency = place
        return Scene(
            specimen=self.structure.specimen(
                self.models[model], self.damping_times_s[damping], self.gaps_m[gap]
            ),
            drive=Harmonic(self.frequencies_hz[frequency], self.amplitudes_m[amplitude], phase_rad),
            observe=self.observe,
            accuracy=self.accuracy,
            duration=self._duration(),
            start=start,
        )

    def _duration(self) -> FixedDuration | AutomaticDuration:
        match self.duration_s:
            case "auto":
                return AutomaticDuration(window_s=self.window_s)
            case float(duration_s):
                return FixedDuration(duration_s, self.window_s)

    def differences(self, other: Self) -> tuple[str, ...]:
        """Names of what differs between two studies."""
        mine, theirs = self.model_dump(mode="json"), other.model_dump(mode="json")
        return tuple(name for name in mine if mine[name] != theirs[name])
