"""What a window asks of maps: motions over frequency and amplitude, and the motion at one point of them."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PositiveFloat, model_validator
from scipy.ndimage import distance_transform_edt

from vibench.sim import Harmonic, MotionKind, Scene, integrate, settle_scene
from vibench.sim.maps import Map, MapResults, Range, Spacing, compute_map, map_solver
from vibench.sim.study import MemoryStore, PointAnswer, executor_of

from ..dynamics import SpecimenChoice, map_caption, motion_classes
from ..signals.arrays import Reals

BETWEEN_PICTURES_S = 0.5
PERIODS, SAMPLES = 64, 256
"""Drive periods of a motion that are shown, and samples in each."""
MOST_CELLS = 200_000
"""Of a map in a window; larger ones are made by `vibench map`, and opened."""


class MapRequest(SpecimenChoice):
    """Motions over drive frequency and base amplitude."""

    start_hz: PositiveFloat = 60.0
    """Lowest drive frequency."""
    stop_hz: PositiveFloat = 420.0
    """Highest drive frequency."""
    lowest_m: PositiveFloat = 1e-6
    """Smallest amplitude of the base displacement."""
    highest_m: PositiveFloat = 50e-6
    """Largest amplitude; values between lie logarithmically."""
    columns: Annotated[int, Field(ge=3, le=1000)] = 121
    """Frequencies."""
    rows: Annotated[int, Field(ge=3, le=1000)] = 81
    """Amplitudes."""
    random_starts: Annotated[int, Field(ge=0, le=100)] = 0
    """Random starts at every point, beside rest: they tell how many motions there are."""
    periods: Annotated[int, Field(ge=300, le=30_000)] = 3000
    """Drive periods after which a motion that does not repeat is followed no longer."""

    @model_validator(mode="after")
    def _is_a_map(self) -> Self:
        cells = self.columns * self.rows * (1 + self.random_starts)
        if cells > MOST_CELLS:
            raise ValueError(
                f"{cells} points are too many for a window: at most {MOST_CELLS}; see vibench map"
            )
        self.plan  # noqa: B018 - making it is the check
        return self

    @property
    def plan(self) -> Map:
        """The same as every program computes it."""
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
    """A map as far as it has come; cells that are not known yet look like the nearest that is."""

    frequency_hz: tuple[float, float]
    """Outer edges."""
    amplitude_m: tuple[float, float]
    classes: NDArray[np.int8]
    """Places in `MOTION_CLASSES`, shape (rows, columns)."""
    response_i: NDArray[np.float32]
    motions: NDArray[np.float32]
    """How many motions the starts of a cell came to."""
    said: str


class MotionRequest(SpecimenChoice):
    """The motion that a specimen comes to from rest at one drive."""

    frequency_hz: PositiveFloat
    amplitude_m: PositiveFloat
    periods: Annotated[int, Field(ge=300, le=30_000)] = 3000


@dataclass(frozen=True, eq=False)
class SettledMotion:
    """The end of a motion, sampled, and what it is."""

    frequency_hz: float
    amplitude_m: float
    said: str
    time_s: Reals
    displacement_m: Reals
    """x, of m0, shape (samples,)."""
    relative_m: Reals
    """p = y - z."""
    gaps_m: tuple[float, float]
    line_hz: Reals
    line_m: Reals
    """Amplitude of x over frequency, over whole drive periods."""


class PicturingStore(MemoryStore):
    """Keeps a map in memory, and shows how it grows, some times a second."""

    def __init__(self, plan: Map, tell: Callable[[MapPicture], None]) -> None:
        super().__init__(plan)
        self._plan, self._tell = plan, tell
        self._told_s = -BETWEEN_PICTURES_S

    def keep(self, answers: Sequence[PointAnswer]) -> None:
        """Keep, and show if the last picture is old."""
        super().keep(answers)
        if time.monotonic() - self._told_s >= BETWEEN_PICTURES_S:
            self.show()

    def show(self) -> None:
        """Tell what there is."""
        self._tell(picture_of(MapResults(self._plan, self.arrays)))
        self._told_s = time.monotonic()


def map_pictures(
    request: MapRequest, tell: Callable[[MapPicture], None], cancelled: Callable[[], bool]
) -> None:
    """Compute a map, and tell pictures of it as it grows; the last one is whole unless it was cancelled."""
    plan = request.plan
    store = PicturingStore(plan, tell)
    with executor_of(None, None, map_solver(plan)) as executor:
        compute_map(plan, executor, store, cancelled=cancelled)
    store.show()


def picture_of(results: MapResults) -> MapPicture:
    """Make the picture of a map over frequency and amplitude."""
    frequency, amplitude = (results.plan.range_of(each).edges for each in results.plan.varied)
    classes = motion_classes(results)
    is_known = np.isfinite(classes)
    nearest = np.indices(classes.shape)
    if is_known.any():
        _, nearest = distance_transform_edt(~is_known, return_indices=True)
    there = tuple(nearest)
    said = map_caption(results) if results.is_complete else f"{results.computed} points computed so far."
    return MapPicture(
        frequency_hz=(frequency[0], frequency[-1]),
        amplitude_m=(amplitude[0], amplitude[-1]),
        classes=np.nan_to_num(classes[there], nan=-1.0).astype(np.int8),
        response_i=results.shown("response_i")[there].astype(np.float32),
        motions=results.motion_counts[there].astype(np.float32),
        said=said,
    )


def settled_motion(request: MotionRequest) -> SettledMotion:
    """Follow a specimen from rest until its motion has settled, and sample what it does then.

    Raises
    ------
    ValueError
        When it cannot be followed.

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
        said=(
            f"{request.frequency_hz:.5g} Hz, {1e6 * request.amplitude_m:.4g} µm, from rest: {kind}, Response "
            f"I {found.response_i or 0.0:.3g}, {found.impact_rate_hz:.4g} impacts a second"
        ),
        time_s=np.asarray(run.time_s)[: len(states)],
        displacement_m=states[:, 0],
        relative_m=states[:, 1] - states[:, 2],
        gaps_m=scene.specimen.gaps_m,
        line_hz=np.asarray(np.arange(len(lines)) * (request.frequency_hz / PERIODS), dtype=np.float64),
        line_m=lines,
    )
