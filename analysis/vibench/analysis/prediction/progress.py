"""Requests for simulations and maps, the pieces in which results arrive, and the results so far."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator
from scipy.ndimage import distance_transform_edt

from vibench.sim import (
    BUDGET_S,
    Accuracy,
    Ensemble,
    FoundMotion,
    Harmonic,
    MotionKind,
    Observable,
    PowerLaw,
    Scene,
    StartMemory,
    integrate,
    settle_scene,
)
from vibench.sim.maps import Map, MapResults, Range, Spacing, compute_map, map_solver
from vibench.sim.study import (
    MemoryStore,
    PointAnswer,
    Study,
    TargetError,
    TargetTime,
    executor_of,
    frequency_range,
)

from .. import dynamics
from ..comparison import Curve, CurveKind, CurveOrigin
from ..errors import AnalysisError
from ..overlay.similarity import Similarity, SimilarityCurve, similarity
from ..signals import Reals, runs_of

BETWEEN_PICTURES_S = 0.5
PERIODS, SAMPLES = 64, 256
"""Number of drive periods in the picture of a motion, and number of samples per period."""
MOST_CELLS = 200_000
"""Maximum number of map cells in a window; compute larger maps with `vibench map` and open them."""


class MapRequest(dynamics.SpecimenChoice):
    """Request for a map of motions over drive frequency and base amplitude."""

    start_hz: PositiveFloat = 60.0
    """Lowest drive frequency."""
    stop_hz: PositiveFloat = 420.0
    """Highest drive frequency."""
    lowest_m: PositiveFloat = 1e-6
    """Smallest amplitude of the base displacement."""
    highest_m: PositiveFloat = 50e-6
    """Largest amplitude of the base displacement; amplitudes are spaced logarithmically."""
    columns: Annotated[int, Field(ge=3, le=1000)] = 121
    """Number of drive frequencies."""
    rows: Annotated[int, Field(ge=3, le=1000)] = 81
    """Number of base amplitudes."""
    random_starts: Annotated[int, Field(ge=0, le=100)] = 0
    """Number of random initial states at every point, in addition to rest, to find coexisting motions."""
    periods: Annotated[int, Field(ge=300, le=30_000)] = 3000
    """Maximum length of a run in drive periods, for a motion that does not repeat."""

    @model_validator(mode="after")
    def _is_a_map(self) -> Self:
        cells = self.columns * self.rows * (1 + self.random_starts)
        if cells > MOST_CELLS:
            raise ValueError(
                f"{cells} points are too many for the window (at most {MOST_CELLS}); use vibench map"
            )
        self.plan  # noqa: B018 - making it is the check
        return self

    @property
    def plan(self) -> Map:
        """The request as a plan of a map."""
        return Map(
            specimen=self.described,
            model=self.law,
            damping_time_s=self.damping_time_s,
            gap_m=self.gap_m,
            frequency_hz=Range(start=self.start_hz, stop=self.stop_hz, points=self.columns),
            amplitude_m=Range(
                start=self.lowest_m, stop=self.highest_m, points=self.rows, spacing=Spacing.LOGARITHMIC
            ),
            random_starts=self.random_starts,
            periods=self.periods,
        )


@dataclass(frozen=True, eq=False)
class MapPicture:
    """The map computed so far; each missing cell shows the value of the nearest computed cell."""

    frequency_hz: tuple[float, float]
    """Lower and upper edge of the picture [Hz]."""
    amplitude_m: tuple[float, float]
    classes: NDArray[np.int8]
    """Indices in `MOTION_CLASSES`, shape (rows, columns)."""
    response_i: NDArray[np.float32]
    motions: NDArray[np.float32]
    """Number of motions found in each cell of the map."""
    text: str


class MotionRequest(dynamics.SpecimenChoice):
    """Request for the motion from rest at one drive frequency and amplitude."""

    frequency_hz: PositiveFloat
    amplitude_m: PositiveFloat
    periods: Annotated[int, Field(ge=300, le=30_000)] = 3000


@dataclass(frozen=True, eq=False)
class SettledMotion:
    """Samples of a settled motion, with the kind of motion as text."""

    frequency_hz: float
    amplitude_m: float
    text: str
    time_s: Reals
    displacement_m: Reals
    """Displacement x of m0, shape (samples,)."""
    relative_m: Reals
    """Displacement p = y - z of m1 relative to m2, shape (samples,)."""
    gaps_m: tuple[float, float]
    line_hz: Reals
    line_m: Reals
    """Amplitude spectrum of x, from whole drive periods."""


class WatchedStore(MemoryStore):
    """Store that keeps results in memory and passes them on."""

    def __init__(self, plan: Study | Map, watch: Callable[[Sequence[PointAnswer]], None]) -> None:
        super().__init__(plan)
        self._watch = watch

    def keep(self, answers: Sequence[PointAnswer]) -> None:
        """Store results, and pass them on."""
        super().keep(answers)
        self._watch(answers)


def map_pictures(
    request: MapRequest, tell: Callable[[MapPicture], None], cancelled: Callable[[], bool]
) -> None:
    """Compute a map and send a picture at most every 0.5 s; unless cancelled, the last one is complete."""
    plan, sent_s = request.plan, [-BETWEEN_PICTURES_S]

    def show(_: Sequence[PointAnswer]) -> None:
        if time.monotonic() - sent_s[-1] >= BETWEEN_PICTURES_S:
            tell(picture_of(MapResults(plan, store.arrays)))
            sent_s[-1] = time.monotonic()

    store = WatchedStore(plan, show)
    with executor_of(None, None, map_solver(plan)) as executor:
        compute_map(plan, executor, store, cancelled=cancelled)
    tell(picture_of(MapResults(plan, store.arrays)))


def picture_of(results: MapResults) -> MapPicture:
    """Return the picture of a map over frequency and amplitude."""
    frequency, amplitude = (results.plan.range_of(each).edges for each in results.plan.varying)
    classes = dynamics.motion_classes(results)
    is_known = np.isfinite(classes)
    if is_known.any():
        _, nearest = distance_transform_edt(~is_known, return_indices=True)
        there = tuple(nearest)
    else:
        there = tuple(np.indices(classes.shape))
    text = (
        dynamics.map_caption(results) if results.is_complete else f"{results.points} points computed so far."
    )
    return MapPicture(
        frequency_hz=(frequency[0], frequency[-1]),
        amplitude_m=(amplitude[0], amplitude[-1]),
        classes=np.nan_to_num(classes[there], nan=-1.0).astype(np.int8),
        response_i=results.map_values("response_i")[there].astype(np.float32),
        motions=results.motion_counts[there].astype(np.float32),
        text=text,
    )


def settled_motion(request: MotionRequest) -> SettledMotion:
    """Simulate a specimen from rest until its motion has settled, and return samples of that motion.

    Raises ValueError when the motion cannot be simulated.
    """
    plan = MapRequest(
        **request.model_dump(exclude={"frequency_hz", "amplitude_m"}),
        start_hz=request.frequency_hz,
        stop_hz=2.0 * request.frequency_hz,
        lowest_m=request.amplitude_m,
        highest_m=2.0 * request.amplitude_m,
    ).plan
    scene: Scene = plan.scene((0, 0, 0))
    found = settle_scene(scene)
    drive = Harmonic(request.frequency_hz, request.amplitude_m)
    run = integrate(
        scene.specimen,
        drive,
        PERIODS / request.frequency_hz,
        scene.accuracy,
        found.final_state,
        SAMPLES * request.frequency_hz,
    )
    states = np.asarray(run.states)[: PERIODS * SAMPLES]
    lines = np.abs(np.fft.rfft(states[:, 0])) * 2.0 / max(len(states), 1)
    kind = f"period {found.period}" if found.motion is MotionKind.PERIODIC else str(found.motion)
    return SettledMotion(
        frequency_hz=request.frequency_hz,
        amplitude_m=request.amplitude_m,
        text=(
            f"{request.frequency_hz:.5g} Hz, {1e6 * request.amplitude_m:.4g} µm, from rest: {kind}, Response "
            f"I {found.response_i or 0.0:.3g}, {found.impact_rate_hz:.4g} impacts per second"
        ),
        time_s=np.asarray(run.time_s)[: len(states)],
        displacement_m=states[:, 0],
        relative_m=states[:, 1] - states[:, 2],
        gaps_m=scene.specimen.gaps_m,
        line_hz=np.asarray(np.arange(len(lines)) * (request.frequency_hz / PERIODS), dtype=np.float64),
        line_m=lines,
    )


@dataclass(frozen=True)
class SimulatedPoint:
    """Result of one model at one frequency; values that were not requested or not found are None."""

    model: str
    frequency_hz: float
    response_i: float | None
    response_ii: float | None
    impacts: int
    lyapunov_per_s: float | None
    memory: StartMemory = StartMemory.UNKNOWN
    ensemble: Ensemble | None = None
    """Motions from other initial states; computed if the motion depends sensitively on its initial state."""


@dataclass(frozen=True, eq=False)
class SimulatedSignal:
    """Samples of the end of a run; arrays of shape (samples,)."""

    model: str
    frequency_hz: float
    time_s: Reals
    displacement_m: Reals
    """Displacement x of m0."""
    relative_m: Reals
    """Displacement p = y - z of m1 relative to m2, between the stops."""
    gaps_m: tuple[float, float]
    """Gaps of the stops at negative and at positive p."""


@dataclass(frozen=True)
class Trouble:
    """Error message for a point that could not be computed."""

    sentence: str


PartialResult = (
    SimulatedPoint
    | SimulatedSignal
    | dynamics.BranchLine
    | dynamics.SpectrumPoint
    | dynamics.ChainRun
    | MapPicture
    | SettledMotion
    | Trouble
)
MOST_POINTS = 20_000
"""Maximum number of points of both models together; more points take hours and cannot be seen in a plot."""


class Exponent(StrEnum):
    """Whether the largest Lyapunov exponent is computed."""

    LEFT_OUT = "left out"
    COMPUTED = "computed"


class SimulationRequest(dynamics.SpecimenChoice):
    """Request for simulations at every frequency of a range."""

    compared_with: dynamics.ContactWord = "linear"
    """Contact law of a second model, whose similarity with the first is shown; empty for none."""
    amplitude_m: PositiveFloat = 5e-6
    """Amplitude of the base displacement."""
    start_hz: PositiveFloat = 50.0
    """Lowest drive frequency."""
    stop_hz: PositiveFloat = 600.0
    """Highest drive frequency."""
    step_hz: PositiveFloat = 5.0
    """Step between drive frequencies."""
    accuracy: Accuracy = Accuracy.STANDARD
    """Accuracy of contacts; free flight is exact at every level. Costs and errors are shown below."""
    duration_s: PositiveFloat = 8.0
    """Simulated time of each run, which starts from rest."""
    window_s: PositiveFloat = 5.0
    """Observed time at the end of each run."""
    budget_s: NonNegativeFloat = BUDGET_S
    """Maximum processor time per point to try other initial states if the motion depends on them; 0: none."""
    error: TargetError | None = None
    """Target relative error at each point, such as 0.01; replaces accuracy, duration and budget."""
    time_s: TargetTime | None = None
    """Time limit per point, with or without a target error."""
    exponent: Exponent = Exponent.LEFT_OUT
    """Whether to compute the largest Lyapunov exponent, which about doubles the computing time."""
    signal_hz: PositiveFloat | None = 260.0
    """Frequency whose time signal is shown; empty for none."""

    @model_validator(mode="after")
    def _is_a_study(self) -> Self:
        """Refuse requests that would take too long; requests that the study refuses raise its error."""
        points = len(self.models) * len(frequency_range(self.start_hz, self.stop_hz, self.step_hz))
        if points > MOST_POINTS:
            raise ValueError(
                f"{points} points were requested; at most {MOST_POINTS} are simulated here: "
                "choose a larger step, or use a study file"
            )
        self.study  # noqa: B018 - making it is the check
        return self

    @property
    def models(self) -> tuple[str, ...]:
        """Names of the models; the first is the reference of the similarity."""
        second = self.compared_with.strip()
        return (self.law,) if second in ("", self.law) else (self.law, second)

    @property
    def study(self) -> Study:
        """The request as a study."""
        exponents = (Observable.LYAPUNOV,) if self.exponent is Exponent.COMPUTED else ()
        varied = {"damping_times_s": self.damping_time_s, "gaps_m": self.gap_m}
        return Study(
            specimen=self.described,
            models=self.models,
            **{name: (value,) for name, value in varied.items() if value is not None},
            amplitudes_m=(self.amplitude_m,),
            frequencies_hz=frequency_range(self.start_hz, self.stop_hz, self.step_hz),
            observe=(Observable.RESPONSE, *exponents),
            window_s=self.window_s,
            error=self.error,
            time_s=self.time_s,
            **({} if self.has_target else self.model_dump(include={"accuracy", "duration_s", "budget_s"})),
        )

    @property
    def has_target(self) -> bool:
        """Whether an error or a time limit was requested."""
        return self.error is not None or self.time_s is not None

    @property
    def points(self) -> int:
        """Number of simulated points, for all models together."""
        return self.study.grid.size


MOTION_COLUMNS = ("Model", "f (Hz)", "Response I", "Response II", "Error", "Share of starts", "Motion")


def _motion_words(motion: FoundMotion) -> tuple[str, ...]:
    """Return the table cells of a motion: responses, error, fraction of initial states, kind."""
    share, period = motion.share, "" if motion.period is None else f", period {motion.period}"
    return (
        "–" if motion.response_i is None else f"{motion.response_i:.4g}",
        "–" if motion.response_ii is None else f"{motion.response_ii:.4g}",
        "–" if motion.error_estimate is None else f"{motion.error_estimate:.1g}",
        f"{100 * share.share:.0f} % ({100 * share.low:.0f} to {100 * share.high:.0f} %)",
        f"{motion.motion}{period}",
    )


class SimulationProgress:
    """Results of a request so far; their pieces may arrive in any order."""

    def __init__(self, amplitude_m: float, points: int, note: str) -> None:
        self._amplitude_m = amplitude_m
        self.requested = points
        """Number of requested points."""
        self._note = note
        self._found: dict[str, dict[float, SimulatedPoint]] = {}
        self._signals: dict[str, SimulatedSignal] = {}
        self._troubles: list[str] = []

    def add(self, parts: tuple[PartialResult, ...]) -> None:
        """Add received pieces of the results."""
        for part in parts:
            match part:
                case SimulatedPoint():
                    self._found.setdefault(part.model, {})[part.frequency_hz] = part
                case SimulatedSignal():
                    self._signals[part.model] = part
                case Trouble():
                    self._troubles.append(part.sentence)

    @property
    def done(self) -> int:
        """Number of finished points, including points that could not be computed."""
        return sum(len(each) for each in self._found.values()) + len(self._troubles)

    @property
    def models(self) -> tuple[str, ...]:
        """Models that have results."""
        return tuple(dict.fromkeys((*self._signals, *self._found)))

    @property
    def signals(self) -> tuple[SimulatedSignal, ...]:
        """Time signals, one per model."""
        return tuple(self._signals.values())

    @property
    def largest_signal_m(self) -> float:
        """Largest displacement in all time signals [m]."""
        reached = [np.max(np.abs((each.displacement_m, each.relative_m))) for each in self.signals]
        return float(max(reached, default=0.0))

    @property
    def smallest_and_largest_response(self) -> tuple[float, float]:
        """Smallest and largest response so far; zeros before the first response."""
        points = [point for found in self._found.values() for point in found.values()]
        known = [v for p in points for v in (p.response_i, p.response_ii) if v is not None and v > 0]
        return (min(known), max(known)) if known else (0.0, 0.0)

    @property
    def troubles(self) -> tuple[str, ...]:
        """Error messages of points that could not be computed."""
        return tuple(self._troubles)

    def column(self, model: str, name: str) -> tuple[Reals, Reals]:
        """Return the frequencies and the values of one quantity of a model; unknown values are NaN."""
        points = [self._found[model][key] for key in sorted(self._found.get(model, {}))]
        values = [getattr(point, name) for point in points]
        frequency_hz = np.array([point.frequency_hz for point in points], dtype=np.float64)
        return frequency_hz, np.array([np.nan if v is None else v for v in values], dtype=np.float64)

    def other_motions(self, model: str) -> tuple[Reals, Reals]:
        """Return frequency and Response I of each additional motion found from other initial states."""
        found = [
            (point.frequency_hz, motion.response_i)
            for point in self._found.get(model, {}).values()
            if point.ensemble is not None
            for place, motion in enumerate(point.ensemble.motions)
            if place != point.ensemble.requested_motion and motion.response_i is not None
        ]
        columns = np.array(sorted(found), dtype=np.float64).reshape(-1, 2)
        return columns[:, 0], columns[:, 1]

    @property
    def motion_rows(self) -> tuple[tuple[str, ...], ...]:
        """Table rows (`MOTION_COLUMNS`) for points with several motions."""
        return tuple(
            (model, f"{point.frequency_hz:g}", *_motion_words(motion))
            for model, points in self._found.items()
            for point in (points[key] for key in sorted(points))
            if point.ensemble is not None and len(point.ensemble.motions) > 1
            for motion in point.ensemble.motions
        )

    @property
    def sensitive(self) -> int:
        """Number of points whose motion depends sensitively on the initial state."""
        points = (point for found in self._found.values() for point in found.values())
        return sum(point.memory is StartMemory.LOST for point in points)

    def collision_bands_hz(self, model: str) -> tuple[tuple[float, float], ...]:
        """Return the frequency ranges of neighbouring points with collisions."""
        frequency_hz, impacts = self.column(model, "impacts")
        runs = runs_of(impacts > 0)
        return tuple((float(frequency_hz[first]), float(frequency_hz[stop - 1])) for first, stop in runs)

    def curves(self) -> tuple[Curve, ...]:
        """Return Responses I and II of every model as curves, to overlay on recordings."""
        return tuple(
            Curve(
                f"model {model}, {1e6 * self._amplitude_m:.4g} µm",
                CurveOrigin.PREDICTED,
                response,
                *self.column(model, name),
                np.full(len(self._found[model]), np.nan),
                self._note,
                self._amplitude_m,
            )
            for model in self.models
            if model in self._found
            for response, name in (
                (CurveKind.RESPONSE_I, "response_i"),
                (CurveKind.RESPONSE_II, "response_ii"),
            )
        )

    def similarity(self) -> Similarity | None:
        """Return the similarity of Response I of both models; None without common results."""
        if len(self._found) < 2:
            return None
        columns = [self.column(model, "response_i") for model in self.models if model in self._found]
        both_hz = np.intersect1d(columns[0][0], columns[1][0])
        curves = [
            SimilarityCurve(both_hz, response[np.isin(hz, both_hz)], self._amplitude_m)
            for hz, response in columns
        ]
        try:
            return similarity(curves[0], curves[1])
        except AnalysisError:
            return None


MACHINE = "one core of a 2-core AMD EPYC"
"""Machine on which speeds and errors were measured; `vibench tradeoff` measures them on your machine."""


@dataclass(frozen=True)
class MeasuredLevel:
    """Speed (simulated seconds per core second) and error of one accuracy level, for the paper's specimen."""

    free: float
    """Speed without impacts: Hertz's contact, 260 Hz and 1 um."""
    periodic: float
    """Speed with periodic impacts: 130 Hz and 20 um."""
    chaos: float
    """Speed in chaos: 260 Hz and 5 um."""
    power: float
    """Speed with the contact law power:3, whose force acts at every p: 150 Hz and 10 um."""
    state_error: float
    """Error of the state of a periodic motion after 2 s, in units of 100 um and 0.1 m/s."""
    response_i_error: float
    """Relative error of Response I of a periodic motion, compared with the level `reference`."""


MEASURED = {
    Accuracy.QUICK: MeasuredLevel(21015.0, 3603.0, 3084.0, 3368.0, 4.9e-10, 2.9e-10),
    Accuracy.STANDARD: MeasuredLevel(21501.0, 4182.0, 3077.0, 2902.0, 4.9e-10, 2.9e-10),
    Accuracy.REFERENCE: MeasuredLevel(22280.0, 675.0, 542.0, 1650.0, 6.3e-12, 0.0),
}
CHAOS_SCATTER = 0.03
"""Relative scatter of Response I between different initial states in chaos; equal for all accuracy levels."""


def cost_sentences(request: SimulationRequest, cores: int) -> tuple[str, ...]:
    """Return sentences on error and computing time of a request on ``cores`` idle cores."""
    if request.has_target:
        wish = "" if request.error is None else f" to an error of {100.0 * request.error:g} %"
        limit = "a minute" if request.time_s is None else f"{request.time_s:g} s"
        return (f"{request.points} points, each{wish} within {limit}, on {cores} idle cores.",)
    level = MEASURED[request.accuracy]
    each_s = request.points * request.duration_s / len(request.models)
    laws = [request.specimen_under(model).contact for model in request.models]
    powers = [isinstance(law, PowerLaw) for law in laws]
    shortest_s = sum(each_s / (level.power if is_power else level.free) for is_power in powers)
    longest_s = sum(each_s / (level.power if is_power else level.chaos) for is_power in powers)
    on_top = "; about twice as long with the exponent" if request.exponent is Exponent.COMPUTED else ""
    if request.budget_s > 0.0:
        on_top += f"; up to {request.budget_s:g} core seconds more if a motion depends on its initial state"
    error = f"{level.response_i_error:.0e}" if level.response_i_error else "none"
    shortest, longest = _time(shortest_s / cores), _time(longest_s / cores)
    return (
        (
            f"{request.points} points of {request.duration_s:g} s on {cores} idle cores: "
            f"{shortest} without impacts to {longest} in chaos{on_top}."
        ),
        (
            f"One core second simulates {level.free:.0f} s without impacts, {level.periodic:.0f} s of "
            f"periodic impacts, {level.chaos:.0f} s of chaos, {level.power:.0f} s of a power law."
        ),
        (
            f"Error of a periodic state: {level.state_error:.0e}; of Response I, relative to the reference: "
            f"{error}. In chaos, Response I scatters by {CHAOS_SCATTER:.0%} at every accuracy."
        ),
        f"Measured on {MACHINE}.",
    )


def _time(seconds: float) -> str:
    minute = 60.0
    return f"{seconds:.2g} s" if seconds < minute else f"{seconds / minute:.2g} min"
