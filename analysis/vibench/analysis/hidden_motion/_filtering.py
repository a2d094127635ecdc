"""Run the Kalman filter and the smoother over parts of a prepared motion."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from vibench.sim import Specimen
from vibench.sim.engine.library import Structure
from vibench.sim.engine.run import native_engine

from ..signals import Flags, Reals
from ._prepared_motion import ChannelNoise, PreparedMotion
from ._tracking_model import STATES, VX, StepTables, TrackedSpecimen, X, step_tables

_DIFFUSION_OF_GAP = 7e-6
"""Model error: random displacement of each mass relative to the gap, per root millisecond."""
_DIFFUSION_OF_SPEED = 2e-5
"""Random velocity of each mass relative to (gap x highest natural frequency), per root millisecond."""
_DRIFT_M_PER_S2 = 1e-3
"""Random walk of the accelerometer's slow error [m/s2] per root second."""
_ACCELERATION_EXCESS = 1.5
"""Variance of an acceleration interpolated linearly between samples, relative to a sample's."""
_IMPULSE_SHARE = 0.003
"""Relative model error of a collision's impulse."""
_SMOOTHING_S = 8e-3
"""Averaging time of squared innovations to detect the loss of a track [s]."""
LOSS_LIMIT = 8.0
"""Mean squared normalised innovation above which a track counts as lost; about 1 for a good track."""
_NOTHING = np.empty(0)
_FLIGHT = 0.0
"""Value of `FilterPredictions.kinds` for a step without contact."""


@dataclass(frozen=True, eq=False)
class MotionModel:
    """Model of specimen and channels for the filter."""

    specimen: Specimen
    tables: StepTables
    step_noise: Reals
    """Process noise Q of one sample, shape (8, 8)."""
    velocity_variance: float

    @property
    def without_stops(self) -> "MotionModel":
        """Return the model without stops, for an unknown contact force."""
        stop = self.tables.stop.copy()
        stop[:2] = np.inf
        return replace(self, tables=replace(self.tables, stop=stop))

    @property
    def gaps_m(self) -> tuple[float, float]:
        """Gaps at negative and at positive p."""
        return float(self.tables.stop[0]), float(self.tables.stop[1])


def motion_model(tracked: TrackedSpecimen, motion: PreparedMotion) -> MotionModel:
    """Build the filter's model for a motion."""
    tables = step_tables(tracked, motion.sample_rate_hz, motion.coupling_rad_per_s)
    noise = step_noise(tracked.specimen, tables, motion.noise)
    return MotionModel(tracked.specimen, tables, noise, motion.noise.velocity**2)


def step_noise(specimen: Specimen, tables: StepTables, noise: ChannelNoise) -> Reals:
    """Return Q: accelerometer noise, model error, and drift of the acceleration."""
    gap_m = min(specimen.gaps_m)
    speed = gap_m * 2.0 * np.pi * float(specimen.natural_frequencies_hz[-1])
    per_ms = tables.step_s / 1e-3
    q = np.zeros((STATES, STATES))
    places, rates = np.arange(X, VX), np.arange(VX, 2 * VX)
    q[places, places] = (_DIFFUSION_OF_GAP * gap_m) ** 2 * per_ms
    q[rates, rates] = (_DIFFUSION_OF_SPEED * speed) ** 2 * per_ms
    shaken = tables.acceleration_input
    q += _ACCELERATION_EXCESS * noise.acceleration**2 * np.outer(shaken, shaken)
    q[-1, -1] += _DRIFT_M_PER_S2**2 * tables.step_s
    return q


@dataclass(eq=False)
class FilterState:
    """State of a run of the filter, updated in place."""

    sample: int
    """Index of the last sample that the filter used, counted from the start of the motion."""
    state: Reals
    covariance: Reals
    innovation_level: float = 1.0
    """Running mean of the squared normalised innovation."""

    def copy(self) -> "FilterState":
        """Return an independent copy of this state."""
        return FilterState(self.sample, self.state.copy(), self.covariance.copy(), self.innovation_level)


@dataclass(frozen=True, eq=False)
class FilterPredictions:
    """Predictions of the filter for each sample, before that sample was used."""

    first: int
    """Index of the first predicted sample, counted from the start of the motion."""
    states: Reals
    covariances: Reals
    innovations: Reals
    """Innovation and its variance, which is 0 if the sample was not used."""
    kinds: Reals
    jacobians: Reals
    impulses: Reals

    @property
    def nis(self) -> Reals:
        """Squared normalised innovations; NaN if a sample was not used."""
        value, variance = self.innovations.T
        return np.asarray(np.where(variance > 0, value**2 / np.where(variance > 0, variance, 1.0), np.nan))

    @classmethod
    def room(cls, first: int, count: int) -> "FilterPredictions":
        """Allocate arrays for the predictions of this many samples."""
        shapes = (STATES,), (STATES, STATES), (2,), (), (STATES, STATES), ()
        return cls(first, *(np.empty((count, *shape)) for shape in shapes))

    @property
    def arrays(self) -> dict[str, Reals]:
        """Return arrays by name, in the order of `TrackRecord` in native/structures.hpp."""
        return {each.name: getattr(self, each.name) for each in fields(self)[1:]}

    def samples(self, begin: int, end: int | None = None) -> "FilterPredictions":
        """Return the predictions for samples ``begin`` to before ``end``."""
        return FilterPredictions(self.first + begin, *(each[begin:end] for each in self.arrays.values()))

    @property
    def record(self) -> Structure:
        """Return these predictions as a `TrackRecord` for the native engine."""
        return native_engine().new("TrackRecord", **self.arrays)


def run_filter(
    model: MotionModel,
    motion: PreparedMotion,
    at: FilterState,
    count: int,
    *,
    loss_limit: float = np.inf,
    force_variance: Reals = _NOTHING,
) -> FilterPredictions:
    """Advance ``at`` by ``count`` samples, or until the mean squared innovation exceeds the limit.

    ``force_variance`` is the variance of an unknown contact force held over each sample [N^2].
    """
    kept = FilterPredictions.room(at.sample + 1, min(count, motion.samples - 1 - at.sample))
    done = move_filter(
        [model.tables],
        motion,
        at,
        kept.kinds.size,
        noise=model.step_noise,
        velocity_variance=model.velocity_variance,
        loss_limit=loss_limit,
        force_variance=force_variance,
        record=kept.record,
    )
    return kept.samples(0, done)


def move_filter(
    tables: Sequence[StepTables],
    motion: PreparedMotion,
    at: FilterState,
    count: int,
    *,
    noise: Reals,
    velocity_variance: float,
    loss_limit: float,
    deviations: Reals = _NOTHING,
    force_variance: Reals = _NOTHING,
    record: Structure | None = None,
) -> int:
    """Advance ``at`` by up to ``count`` samples; return the number of samples until the track was lost.

    Each table after the first has one parameter changed by its deviation.
    """
    engine, first = native_engine(), tables[0]
    work = engine.new(
        "MotionFilter",
        acceleration=motion.accelerations(at.sample, at.sample + count + 1),
        velocity=motion.velocities(at.sample + 1, at.sample + count + 1),
        flows=np.stack([each.flow for each in tables]),
        small_flows=np.stack([each.small_flow for each in tables]),
        stops=np.stack([each.stop for each in tables]),
        deviations=deviations,
        step=first.step_s,
        small_steps=first.small_steps,
        noise=noise,
        velocity_variance=velocity_variance,
        impulse_share=_IMPULSE_SHARE,
        force_variance=force_variance if force_variance.size else np.zeros(count),
        force_input=first.force_input,
        level=at.innovation_level,
        level_share=min(1.0, first.step_s / _SMOOTHING_S),
        limit=loss_limit,
        state=at.state,
        covariance=at.covariance,
        **({} if record is None else {"record": record}),
    )
    done = engine.call("filter_motion", work)
    at.sample += done
    at.innovation_level = float(work["level"])
    return done


@dataclass(frozen=True, eq=False)
class RtsTrack:
    """A part of the motion after smoothing."""

    first: int
    states: Reals
    """Smoothed states, shape (samples, 8)."""
    variances: Reals
    """Variances of p and of its rate, shape (samples, 2)."""
    forces: Reals
    """Latent force on m1 and its variance, shape (samples, 2), if requested."""
    first_covariance: Reals
    """Covariance of the first state, shape (8, 8)."""
    touched: Flags
    """Flags of the steps with contact, shape (samples,)."""

    @property
    def p(self) -> Reals:
        """Relative displacement y - z [m]."""
        return np.asarray(self.states[:, 1] - self.states[:, 2])

    @property
    def rate(self) -> Reals:
        """Rate of change of p [m/s]."""
        return np.asarray(self.states[:, 4] - self.states[:, 5])


def smooth(model: MotionModel, run: FilterPredictions, force_variance: Reals = _NOTHING) -> RtsTrack:
    """Smooth a run of the filter backwards in time."""
    count = run.states.shape[0]
    states, variances = np.empty((count, STATES)), np.empty((count, 2))
    forces, matrix = np.empty((force_variance.size, 2)), np.empty((STATES, STATES))
    engine = native_engine()
    work = engine.new(
        "MotionSmoother",
        record=run.record,
        flow=model.tables.flow,
        force_variance=force_variance,
        force_input=model.tables.force_input,
        states=states,
        variances=variances,
        forces=forces,
        matrix=matrix,
    )
    engine.call("smooth_motion", work)
    covariance = run.covariances[0] if count else np.empty((STATES, STATES))
    return RtsTrack(
        run.first,
        states,
        variances,
        forces,
        covariance - covariance @ matrix @ covariance,
        run.kinds != _FLIGHT,
    )
