"""Motion, impacts, gaps, m1, springs and dampers without a contact model."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import ClassVar

import numpy as np

from vibench.sim.engine.run import native_engine

from ..errors import NotEnoughData
from ..signals import Flags, Reals, Samples, runs_of
from ..tables import Tabular
from ._prepared_motion import PreparedMotion
from ._tracking import (
    LatentMotion,
    MotionModel,
    TrackedPiece,
    latent_motion,
    latent_start,
    motion_model,
    run_filter,
)
from ._tracking_model import PRIOR_SD, SEARCHES, Hidden, TrackedSpecimen, value_of, with_values

_BLOCK_S, _OVERLAP_S = 0.12, 0.02
_MISFIT = 3.0
"""Largest mean squared normalised innovation of a valid block."""
FITTED = (Hidden.M1, Hidden.C1, Hidden.K0, Hidden.K2, Hidden.C0, Hidden.C2)
_SHARES = (0.1, 0.1, 0.03, 0.01, 0.004)
"""Values of `closed_share` in successive fits; the first values tolerate an error of 5 % in m1."""
_FIT_STRETCH_S = 0.12
_LARGEST_RESIDUAL = 5.0
_RESIDUAL_START_S = 4e-3
_LEAST_OF_MEDIAN = 0.07
"""Smallest accepted impulse relative to the median; smaller impulses may be residuals of other impacts."""
_LEAST_P_OF_MEDIAN = 0.9
"""Smallest |p| of an impact relative to the median; at smaller |p|, a force cannot come from a stop."""
_DEPTH_POWER = 0.8
"""Power of the impulse to which the depth of a Hertz collision is proportional: d ~ v^(4/5) and J ~ v."""
_LAW_UNKNOWN = 0.15
"""Error of a gap if the contact law is not Hertz's, relative to the mean depth of contacts."""
FEWEST_IMPACTS = 8
_LEAST_SPREAD = 0.3
"""A line is fitted only if the middle 90 % of contact depths span at least this fraction of their mean."""
_HUBER, _HUBER_ROUNDS, _LEAST_SCATTER_M = 2.0, 20, 1e-12
_WORST_SCATTER_OF_GAP = 0.1
"""Largest scatter of |p| at the impacts of a valid block, relative to the gap."""


@dataclass(frozen=True, eq=False)
class FreeImpacts(Tabular):
    """Impacts found in the estimated contact force; each array contains one value per impact."""

    OWN_UNITS: ClassVar = {
        "impulses": "N s",
        "p": "m",
        "p_sd": "m",
        "rate_before": "m s-1",
        "rate_after": "m s-1",
    }

    samples: Reals
    """Centre of each contact, in samples since the start of the motion."""
    sides: Reals
    """Side of each impact: -1 at the lower stop, +1 at the upper stop."""
    impulses: Reals
    """Magnitude of the impulse on m1 [N s]."""
    p: Reals
    """Relative displacement in the middle of the contact [m]."""
    p_sd: Reals
    rate_before: Reals
    rate_after: Reals
    """Speeds of p towards and away from the stop, extrapolated from the flights to the contact [m/s]."""


@dataclass(frozen=True, eq=False)
class FreeMotion(Tabular):
    """Motion of m1 against m2, estimated without a contact model."""

    OWN_UNITS: ClassVar = {"p": "m", "p_sd": "m"}

    p: Samples
    """Relative displacement y - z [m], NaN where undetermined; shape (samples,)."""
    p_sd: Samples
    impacts: FreeImpacts
    share_told: float


def free_motion(
    model: MotionModel, motion: PreparedMotion, on_sample: Callable[[int], None] = lambda _sample: None
) -> FreeMotion:
    """Estimate the motion of m1 against m2 from the channels and the linear parameters of the specimen."""
    p, sd = (np.full(motion.samples, np.nan, dtype=np.float32) for _ in range(2))
    found: list[Reals] = []
    for first, begin, end in _blocks(motion):
        latent = latent_motion(model, motion, first, end - first - 1)
        if latent.misfit < _MISFIT:
            offset = latent.smoothed.first
            stop = min(end, begin + round(_BLOCK_S * motion.sample_rate_hz))
            place = slice(max(begin, offset) - offset, stop - offset)
            p[max(begin, offset) : stop] = np.where(latent.is_dropout, np.nan, latent.smoothed.p)[place]
            sd[max(begin, offset) : stop] = np.sqrt(latent.smoothed.variances[place, 0])
            rows = _impacts(latent, motion.sample_rate_hz)
            inside = (rows[:, 0] >= begin) & (rows[:, 0] < stop)
            found.append(rows[inside])
        on_sample(end)
    rows = np.concatenate(found) if found else np.empty((0, 7))
    impacts = FreeImpacts(*rows[_at_stops(rows)].T)
    _, residuals = _gap_line(impacts)
    for _, begin, stop in _blocks(motion):
        end = min(stop, begin + round(_BLOCK_S * motion.sample_rate_hz))
        here = (impacts.samples >= begin) & (impacts.samples < end) & ~np.isnan(residuals)
        # During an impact p lies at a stop, so the scatter of p there shows the error of the whole block.
        scatter = float(np.sqrt(np.mean(residuals[here] ** 2))) if here.any() else 0.0
        sd[begin:end] = np.hypot(sd[begin:end], scatter)
        if scatter > _WORST_SCATTER_OF_GAP * min(model.gaps_m):
            p[begin:end] = np.nan
    return FreeMotion(p, sd, impacts, float(np.mean(~np.isnan(p))))


def _at_stops(rows: Reals) -> Flags:
    """Return flags of the rows that describe impacts at a stop."""
    kept = np.zeros(len(rows), dtype=np.bool_)
    if not len(rows):
        return kept
    strong = rows[:, 2] > _LEAST_OF_MEDIAN * np.median(rows[rows[:, 2] > np.max(rows[:, 2]) * 0.01, 2])
    reach = rows[:, 1] * rows[:, 3]
    for side in (-1.0, 1.0):
        here = strong & (rows[:, 1] == side)
        if here.any():
            kept |= here & (reach > _LEAST_P_OF_MEDIAN * np.median(reach[here]))
    return kept


def _blocks(motion: PreparedMotion) -> Iterator[tuple[int, int, int]]:
    """Yield overlapping blocks: first sample to filter, first sample to keep, and end of the block."""
    block, overlap = (round(each * motion.sample_rate_hz) for each in (_BLOCK_S, _OVERLAP_S))
    for begin in range(0, motion.samples, block):
        end = min(begin + block + overlap, motion.samples)
        if end - begin > overlap:
            yield max(begin - overlap, 0), begin, end


def _impacts(latent: LatentMotion, sample_rate_hz: float) -> Reals:
    """Return one impact for every window with an impulse, shape (impacts, 7)."""
    smoothed, rows = latent.smoothed, []
    force, moved, rate = smoothed.forces[:, 0], smoothed.p, smoothed.rate
    # The force is constant over the step before a sample, so the force's centre is half a sample earlier.
    place = np.arange(force.size) - 0.5
    for begin, end in runs_of(latent.is_open).tolist():
        if begin < 2 or end > force.size - 2 or latent.is_dropout[begin:end].any():
            continue
        part = slice(begin, end)
        impulse = float(force[part].sum()) / sample_rate_hz
        if impulse == 0.0:
            continue
        weight = np.clip(force[part] * np.sign(impulse), 0.0, None)
        middle = float(np.sum(weight * place[part]) / weight.sum())
        sample = int(np.clip(np.floor(middle), 0, force.size - 2))
        nearest = slice(sample, sample + 2)
        p = _interpolate(moved[nearest], rate[nearest] / sample_rate_hz, middle - sample)
        side = -np.sign(impulse)
        rows.append(
            (
                smoothed.first + middle,
                side,
                abs(impulse),
                p,
                float(np.sqrt(smoothed.variances[sample, 0])),
                side * _extrapolate(rate, begin - 2, begin - 1, middle),
                -side * _extrapolate(rate, end + 1, end, middle),
            )
        )
    return np.array(rows).reshape(-1, 7)


def _extrapolate(values: Reals, far: int, near: int, place: float) -> float:
    """Extrapolate a line through two samples of a flight to the centre of the adjacent contact."""
    return float(values[near] + (values[near] - values[far]) * (place - near) / (near - far))


def _interpolate(values: Reals, slopes: Reals, t: float) -> float:
    """Interpolate between two samples by the cubic that matches their values and slopes (per sample)."""
    (a, b), (da, db) = values, slopes
    return float(
        a * (1 + 2 * t) * (1 - t) ** 2 + da * t * (1 - t) ** 2 + b * t**2 * (3 - 2 * t) + db * t**2 * (t - 1)
    )


@dataclass(frozen=True)
class FreeGap:
    """A gap, found without a contact model."""

    value_m: float
    sd_m: float
    """Standard deviation of the gap, from the scatter of impacts and the unknown contact law."""
    impacts: int


def free_gaps(impacts: FreeImpacts) -> tuple[FreeGap | None, FreeGap | None]:
    """Return both gaps from |p| at the centre of contacts against the impulse; None if undetermined.

    Harder impacts indent a stop more: |p| against J^0.8 is a straight line that starts at the gap. The fit is
    robust and has one slope for both sides.
    """
    return _gap_line(impacts)[0]


def free_loss(impacts: FreeImpacts) -> float | None:
    """Return the loss of the stops [s/m] from speeds before and after impacts; None for too few impacts.

    For a small loss of Hunt and Crossley's law, speed after / speed before = 1 - 2/3 loss * speed before. The
    result is only a start value, since both extrapolated speeds are a few per cent too low.
    """
    before, after = impacts.rate_before, impacts.rate_after
    good = (before > np.median(before)) & (after > 0.0) if before.size else before > 0.0
    if int(good.sum()) < FEWEST_IMPACTS:
        return None
    return float(np.median(1.5 * (1.0 - after[good] / before[good]) / before[good]))


def measured_gaps(impacts: FreeImpacts) -> Reals:
    """Return the gap from each impact: |p| minus the depth for the impact's impulse [m], shape (impacts,).

    NaN on a side with too few impacts.
    """
    gaps, residuals = _gap_line(impacts)
    lower, upper = (np.nan if each is None else each.value_m for each in gaps)
    return np.asarray(np.where(impacts.sides < 0, lower, upper) + residuals)


def _gap_line(impacts: FreeImpacts) -> tuple[tuple[FreeGap | None, FreeGap | None], Reals]:
    """Return both gaps, and the residual of every impact [m], NaN on a side with too few impacts."""
    sides = [impacts.sides < 0, impacts.sides > 0]
    usable_sides = [each for each in sides if each.sum() >= FEWEST_IMPACTS]
    residuals = np.full(impacts.samples.size, np.nan)
    if not usable_sides:
        return (None, None), residuals
    used = np.logical_or.reduce(usable_sides)
    depth = impacts.impulses**_DEPTH_POWER
    if np.subtract(*np.quantile(depth[used], [0.95, 0.05])) < _LEAST_SPREAD * depth[used].mean():
        for each in usable_sides:
            residuals[each] = np.abs(impacts.p[each]) - np.median(np.abs(impacts.p[each]))
        return (None, None), residuals
    matrix = np.column_stack([*(each.astype(float) for each in usable_sides), depth / depth.mean()])[used]
    target = np.abs(impacts.p[used])
    solution, covariance = _robust_line(matrix, target)
    residuals[used] = target - matrix @ solution
    unknown = _LAW_UNKNOWN * abs(float(solution[-1]))
    places = iter(range(len(usable_sides)))
    gaps = [
        FreeGap(
            float(solution[n := next(places)]),
            float(np.hypot(np.sqrt(covariance[n, n]), unknown)),
            int(each.sum()),
        )
        if each.sum() >= FEWEST_IMPACTS
        else None
        for each in sides
    ]
    return (gaps[0], gaps[1]), residuals


def _robust_line(matrix: Reals, target: Reals) -> tuple[Reals, Reals]:
    """Fit a linear model with Huber's weights; return the parameters and their covariance."""
    weight = np.ones(target.size)
    for _ in range(_HUBER_ROUNDS):
        solution, *_ = np.linalg.lstsq(matrix * weight[:, None], target * weight)
        left = target - matrix @ solution
        scale = 1.4826 * float(np.median(np.abs(left))) + _LEAST_SCATTER_M
        weight = np.sqrt(np.minimum(1.0, _HUBER * scale / np.maximum(np.abs(left), _LEAST_SCATTER_M)))
    normal = (matrix * weight[:, None] ** 2).T @ matrix
    return np.asarray(solution), np.asarray(scale**2 * np.linalg.pinv(normal))


def free_numbers(
    described: TrackedSpecimen, motion: PreparedMotion, firsts: Sequence[int]
) -> tuple[TrackedSpecimen, Reals]:
    """Fit m1, c1, k0, k2, c0 and c2 to flights by Gauss-Newton on the innovations.

    Return the specimen with these parameters, and relative standard deviations in the order of `FITTED`.
    Raises NotEnoughData when the motion is too short.
    """
    count = round(_FIT_STRETCH_S * motion.sample_rate_hz)
    places = [each for each in firsts if each + count < motion.samples]
    if not places:
        raise NotEnoughData(f"{_FIT_STRETCH_S} s of motion with collisions are needed to determine m1")
    current = described
    prior = np.array([PRIOR_SD[each] for each in FITTED])
    for share in _SHARES:
        latent = [latent_motion(motion_model(current, motion), motion, each, count, share) for each in places]
        residual = _residuals(current, motion, latent)
        scale = max(1.0, 1.4826 * float(np.median(np.abs(residual))))
        values = np.array([value_of(current, each) for each in FITTED])
        slopes = np.empty((residual.size, len(FITTED)))
        for n, each in enumerate(FITTED):
            step = SEARCHES[each].step
            moved = with_values(current, {each: float(values[n]) * (1 + step)})
            slopes[:, n] = (_residuals(moved, motion, latent) - residual) / (scale * step)
        from_described = values / np.array([value_of(described, each) for each in FITTED]) - 1
        curvature = slopes.T @ slopes + np.diag(prior**-2)
        pull = np.clip(residual / scale, -_LARGEST_RESIDUAL, _LARGEST_RESIDUAL)
        change = -np.linalg.solve(curvature, slopes.T @ pull + from_described / prior**2)
        values *= 1 + np.clip(change, -prior, prior)
        current = with_values(current, dict(zip(FITTED, values.tolist(), strict=True)))
    variance = np.diag(np.linalg.inv(curvature)) * max(1.0, float(np.mean(pull**2)))
    return current, np.sqrt(variance)


def _residuals(tracked: TrackedSpecimen, motion: PreparedMotion, latent: Sequence[LatentMotion]) -> Reals:
    """Return the normalised innovations of stretches, with the contact windows of ``latent``."""
    model = motion_model(tracked, motion).without_stops
    begin = round(_RESIDUAL_START_S * motion.sample_rate_hz)
    parts = []
    for each in latent:
        start = latent_start(each.run.first - 1)
        run = run_filter(model, motion, start, each.force_variance.size, force_variance=each.force_variance)
        value, variance = run.innovations[begin:].T
        parts.append(value[variance > 0] / np.sqrt(variance[variance > 0]))
    return np.concatenate(parts)


_COLUMNS = 7
_MOST_STEPS = 400
"""Longest contact of a collision [samples]; in longer contacts, m1 rests on the stop."""


@dataclass(frozen=True, eq=False)
class Collisions(Tabular):
    """Contacts of m1 with its stops in the order of time; every array has one value per contact."""

    OWN_UNITS: ClassVar = {"impulses": "N s", "speeds_before": "m s-1", "speeds_after": "m s-1"}

    samples: Reals
    """Start of contact, in samples of the motion."""
    durations_s: Reals
    sides: Reals
    """Side of each contact: -1 at the lower stop, +1 at the upper stop."""
    impulses: Reals
    """Magnitude of the impulse on m1 [N s]."""
    penetrations_m: Reals
    """Largest penetration during each contact [m]."""
    speeds_before: Reals
    speeds_after: Reals
    """Speeds of p, towards and away from the stop [m/s]."""

    @property
    def count(self) -> int:
        """Number of collisions."""
        return self.samples.size


def collisions_of(model: MotionModel, motion: PreparedMotion, piece: TrackedPiece) -> Collisions:
    """Return the contacts that start in a piece; each is simulated from the smoothed flight before it."""
    smoothed, tables = piece.smoothed, model.tables
    samples = smoothed.states.shape[0]
    rows = np.empty((samples + 1, _COLUMNS))
    engine = native_engine()
    work = engine.new(
        "ContactSearch",
        states=smoothed.states,
        touched=smoothed.touched.astype(np.float64),
        acceleration=motion.accelerations(smoothed.first, smoothed.first + samples + _MOST_STEPS + 1),
        small_flow=tables.small_flow,
        stop=tables.stop,
        step=tables.step_s,
        small_steps=tables.small_steps,
        longest=_MOST_STEPS,
        contacts=rows,
    )
    found = rows[: engine.call("follow_contacts", work)].copy()
    found[:, 0] += smoothed.first
    return Collisions(*found.T)


def join_collisions(parts: list[Collisions]) -> Collisions:
    """Join the collisions of several parts of a motion."""
    names = [each.name for each in fields(Collisions)]
    return Collisions(
        **{name: np.concatenate([getattr(each, name) for each in parts] or [np.empty(0)]) for name in names}
    )
