"""Runs of the filter and of the smoother over stretches of a prepared motion, as values."""

from dataclasses import dataclass, replace

import numpy as np

from vibench.sim import Specimen

from ..signals import Flags, Reals
from ._filter_kernels import FLIGHT, STATES, VX, X, forward
from ._prepared_motion import ChannelNoise, PreparedMotion
from ._smoother_kernels import backward
from ._tracking_model import StepTables, TrackedSpecimen, step_tables

_DIFFUSION_OF_GAP = 7e-6
"""What the model leaves out moves each mass by this part of the gap in the root of a millisecond."""
_DIFFUSION_OF_SPEED = 2e-5
"""... and changes its speed by this part of the gap times the highest natural frequency."""
_DRIFT_M_PER_S2 = 1e-3
"""Of the accelerometer's slow error in the root of a second."""
_ACCELERATION_EXCESS = 1.5
"""Variance of an acceleration between samples over that of one: what linear interpolation adds."""
IMPULSE_SHARE = 0.003
"""Error of a collision's impulse that the model's own equations may make."""
SMOOTHING_S = 8e-3
"""Over which squared innovations are averaged to notice a loss."""
LOSS_LIMIT = 8.0
"""Mean squared normalised innovation, 1 for a track, beyond which the motion is no longer followed."""
_NOTHING = np.empty(0)


@dataclass(frozen=True, eq=False)
class MotionModel:
    """A specimen behind a bench's channels, as the filter takes it."""

    specimen: Specimen
    tables: StepTables
    step_noise: Reals
    """Q of one sample, shape (8, 8)."""
    velocity_variance: float

    @property
    def without_stops(self) -> "MotionModel":
        """The same, m1 free to pass: for a contact force that no law tells."""
        stop = self.tables.stop.copy()
        stop[:2] = np.inf
        return replace(self, tables=replace(self.tables, stop=stop))

    @property
    def gaps_m(self) -> tuple[float, float]:
        """At negative and at positive p."""
        return float(self.tables.stop[0]), float(self.tables.stop[1])


def motion_model(tracked: TrackedSpecimen, motion: PreparedMotion) -> MotionModel:
    """Build what the filter needs for a motion."""
    tables = step_tables(tracked, motion.sample_rate_hz, motion.coupling_rad_per_s)
    noise = step_noise(tracked.specimen, tables, motion.noise)
    return MotionModel(tracked.specimen, tables, noise, motion.noise.velocity**2)


def step_noise(specimen: Specimen, tables: StepTables, noise: ChannelNoise) -> Reals:
    """Give Q: the accelerometer's noise, what the model leaves out, and the drift of the acceleration."""
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
    """Where a run of the filter stands; it moves on in place."""

    sample: int
    """Number in the motion of the last sample that was used."""
    state: Reals
    covariance: Reals
    innovation_level: float = 1.0
    """Running mean of the squared normalised innovation."""

    def copy(self) -> "FilterState":
        """Give one that moves on by itself."""
        return FilterState(self.sample, self.state.copy(), self.covariance.copy(), self.innovation_level)


@dataclass(frozen=True, eq=False)
class Filtered:
    """What a run of the filter kept, sample by sample, before each sample was used."""

    first: int
    """Number in the motion of the first sample."""
    states: Reals
    covariances: Reals
    innovations: Reals
    """Innovation and its variance; the variance is 0 where the sample was not used."""
    kinds: Reals
    jacobians: Reals
    impulses: Reals

    @property
    def squared(self) -> Reals:
        """Squared normalised innovations; NaN where a sample was not used."""
        value, variance = self.innovations.T
        return np.asarray(np.where(variance > 0, value**2 / np.where(variance > 0, variance, 1.0), np.nan))

    def cut(self, count: int) -> "Filtered":
        """Keep the first ``count`` samples."""
        return Filtered(
            self.first,
            self.states[:count],
            self.covariances[:count],
            self.innovations[:count],
            self.kinds[:count],
            self.jacobians[:count],
            self.impulses[:count],
        )


def run_filter(
    model: MotionModel,
    motion: PreparedMotion,
    at: FilterState,
    count: int,
    *,
    loss_limit: float = np.inf,
    force_variance: Reals = _NOTHING,
) -> Filtered:
    """Move ``at`` on by ``count`` samples, or until the running innovations pass the limit.

    ``force_variance`` is that of a contact force held over each sample [N^2], where no law tells it.
    """
    a = motion.accelerations(at.sample, at.sample + count + 1)
    v = motion.velocities(at.sample + 1, at.sample + count + 1)
    kept = _room(v.size)
    latent = force_variance if force_variance.size else np.zeros(v.size)
    level = np.array([at.innovation_level, min(1.0, model.tables.step_s / SMOOTHING_S)])
    done = forward(
        a,
        v,
        model.tables.flow[np.newaxis],
        model.tables.small_flow[np.newaxis],
        model.tables.stop[np.newaxis],
        _NOTHING,
        model.tables.step_s,
        model.tables.small_steps,
        model.step_noise,
        model.velocity_variance,
        IMPULSE_SHARE,
        latent,
        model.tables.force_input,
        loss_limit,
        level,
        at.state,
        at.covariance,
        *kept,
    )
    found = Filtered(at.sample + 1, *kept)
    at.sample += done
    at.innovation_level = float(level[0])
    return found if done == v.size else found.cut(done)


def _room(count: int) -> tuple[Reals, ...]:
    return (
        np.empty((count, STATES)),
        np.empty((count, STATES, STATES)),
        np.empty((count, 2)),
        np.empty(count),
        np.empty((count, STATES, STATES)),
        np.empty(count),
    )


@dataclass(frozen=True, eq=False)
class Smoothed:
    """A stretch seen from both its ends."""

    first: int
    states: Reals
    """Shape (samples, 8)."""
    variances: Reals
    """Of p and of its rate, shape (samples, 2)."""
    forces: Reals
    """Latent force on m1 and its variance, shape (samples, 2); only where one was asked for."""
    first_covariance: Reals
    """Of the first state, shape (8, 8)."""
    touched: Flags
    """Where a step met a stop."""

    @property
    def p(self) -> Reals:
        """Relative displacement y - z [m]."""
        return np.asarray(self.states[:, 1] - self.states[:, 2])

    @property
    def rate(self) -> Reals:
        """Of p [m/s]."""
        return np.asarray(self.states[:, 4] - self.states[:, 5])


def smooth(model: MotionModel, run: Filtered, force_variance: Reals = _NOTHING) -> Smoothed:
    """Run back over what the filter kept."""
    count = run.states.shape[0]
    states, variances = np.empty((count, STATES)), np.empty((count, 2))
    forces, matrix = np.empty((force_variance.size, 2)), np.zeros((STATES, STATES))
    backward(
        np.ascontiguousarray(model.tables.flow[:, :STATES]),
        run.states,
        run.covariances,
        run.innovations,
        run.kinds,
        run.jacobians,
        force_variance,
        model.tables.force_input,
        states,
        variances,
        forces,
        matrix,
    )
    covariance = run.covariances[0] if count else np.empty((STATES, STATES))
    return Smoothed(
        run.first,
        states,
        variances,
        forces,
        covariance - covariance @ matrix @ covariance,
        run.kinds != FLIGHT,
    )
