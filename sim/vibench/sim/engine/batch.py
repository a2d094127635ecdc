"""SIMD batches: integrate eight motions of one specimen at the same time.

native/batch.hpp supports Hertz contacts at the accuracy levels *quick* and *standard*. The batch returns
states once per drive period, peaks and spectral lines (docs/decisions/0061-lanes.md). SI units.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from ..specimen.contact_laws import Hertz
from ..specimen.modes import modal_form
from ..specimen.specimen import VY, VZ, Floats, Specimen, Y, Z, energy_metric
from .library import Engine, Structure
from .run import DIRECTIONS, NativeRun, Outcome, Watch, native_engine
from .shapes import (
    DEPTHS,
    DURATION,
    END_ONTO_DURATION,
    HALF_FORCE,
    HARDEST,
    HEIGHTS,
    ONTO_DURATION,
    POINTS,
    SHARES,
    SOFTEST,
    SPACING,
    TERMS,
    collision_shapes,
)

# Fit of the polynomials with which a batch computes Hertz collisions (native/collision.hpp). SI units.
#
# A collision is scaled by the depth and the time u that it would have at the same speed without other forces.
# Once scaled, it depends only on u and on the acceleration due to all other springs. The variables of the fit
# are u, and this acceleration with its first four derivatives in the middle of the collision. The polynomials
# give the duration and the moments of the force about the middle. They are fitted to exact collisions.

MIDDLE = 1.47
"""Time from the start to the middle of a collision, in units of u."""
DERIVATIVES = 5
"""Number of fit variables for m1's acceleration: its value and its first four time derivatives."""
VARIABLES = DERIVATIVES + 1
MOMENTS = 5
POLYNOMIALS = 1 + MOMENTS
MONOMIALS = 289
SLOWEST, FASTEST = 0.06, 5.0
"""Lowest and highest approach speed of the collision fit, divided by gap times fastest modal rate."""
HARDEST_PRESS = 0.24
"""Largest acceleration due to other springs in the collision fit, in units of approach speed / u."""
FIRST_DERIVATIVE, LATER = 0.03, 0.1
"""Largest derivative of this acceleration [speed / u^2], and largest ratio of successive derivatives."""
PAPER_TURN = 0.053
"""Fastest modal rate times u [rad], for the paper's specimen at a medium approach speed."""
SLOWEST_TURN = 0.15
"""Largest product of fastest modal rate and u [rad] for a fit; a collision lasts about three u."""
COLLISIONS = 1500
CHECKED = 200
SEED = 1
CORRECTIONS = 8
FIT_ERROR = 2e-7
"""Largest allowed error of the separation speed of a fitted collision, relative to the approach speed."""
GUESS_POINTS = 64


_ONE_THREAD = Lock()


def collision_fit(engine: Engine, specimen: Specimen) -> Structure | None:
    """Return the `CollisionFit` of native/structures.hpp for a specimen; the fit takes about 0.05 s.

    Return None if the stops are too soft, or if the fit is not accurate enough.
    """
    with _ONE_THREAD:
        return _collision_fit(engine, specimen)


@lru_cache(maxsize=8)
def _collision_fit(engine: Engine, specimen: Specimen) -> Structure | None:
    """Return a fit to random collisions within the variables' ranges, or None; see `collision_fit`."""
    middle, half = _box(specimen)
    if not np.all(half > 0.0) or _fastest(specimen) * (middle[-1] + half[-1]) > SLOWEST_TURN:
        return None
    rng = np.random.default_rng(SEED)
    count = COLLISIONS + CHECKED
    places = rng.uniform(-1.0, 1.0, (count, VARIABLES))
    # Like Chebyshev points, draw more collisions near the ends of the variables' ranges.
    places[:COLLISIONS] = np.sin(0.5 * math.pi * places[:COLLISIONS])
    variables = middle + half * places
    solved = _solve(variables[:, :DERIVATIVES], variables[:, -1], _coupling(specimen))
    powers, counts = np.zeros((MONOMIALS, VARIABLES)), np.zeros(POLYNOMIALS)
    engine.call("describe_collisions", engine.new("CollisionMonomials", powers=powers, counts=counts))
    factors = places[:, :, None] ** np.arange(powers.max() + 1.0)
    monomials = np.ones((len(places), MONOMIALS))
    for variable, power in enumerate(powers.T.astype(int)):
        monomials *= factors[:, variable, power]
    # Normal equations are faster than a QR decomposition, but lose digits. A second solution, for the
    # residual, restores these digits (Björck, Linear Algebra Appl. 88 (1987) 31).
    known, checked = monomials[:COLLISIONS], monomials[COLLISIONS:]
    products = known.T @ known
    parts, errors = [], []
    for most, wanted in zip(counts.astype(int), solved.T, strict=True):
        part = np.zeros(most)
        for _ in range(2):
            residual = wanted[:COLLISIONS] - known[:, :most] @ part
            part += np.linalg.solve(products[:most, :most], known[:, :most].T @ residual)
        parts.append(part)
        errors.append(float(np.abs(checked[:, :most] @ part - wanted[COLLISIONS:]).max()))
    turn = _fastest(specimen) * variables[:, -1].max()
    if not max(error * turn**m / math.factorial(m) for m, error in enumerate(errors[1:])) < FIT_ERROR:
        return None
    unit = _time_over_fifth_root(specimen)
    roots = np.linspace(middle[-1] - half[-1], middle[-1] + half[-1], GUESS_POINTS) / unit
    fit = engine.new("CollisionFit", unit=unit)
    fit["coefficients"], fit["middle"], fit["half"] = np.concatenate(parts), middle, half
    fit["guess"] = np.polyfit(roots ** (-5.0 / 4.0), roots, 3)
    return fit


def _fastest(specimen: Specimen) -> float:
    return float(np.max(np.abs(modal_form(specimen).rates)))


def _time_over_fifth_root(specimen: Specimen) -> float:
    """Return u v^(1/5) at the approach speed v, with u = d / v and m v^2 / 2 = 2 k d^(5/2) / 5."""
    m1, m2 = specimen.masses[1:]
    reduced = m1 * m2 / (m1 + m2)
    return float((HALF_FORCE * reduced / specimen.contact.stops.contact_stiffness) ** 0.4)


def _box(specimen: Specimen) -> tuple[Floats, Floats]:
    """Return the centre and the half width of the range of each variable of the fit, shape (6,) each."""
    unit = min(specimen.gaps_m) * _fastest(specimen)
    shortest, longest = (
        _time_over_fifth_root(specimen) * (part * unit) ** -0.2 for part in (FASTEST, SLOWEST)
    )
    turn = 0.5 * (shortest + longest) * _fastest(specimen) / PAPER_TURN
    later = [FIRST_DERIVATIVE * turn * (LATER * turn) ** k for k in range(DERIVATIVES - 1)]
    half = np.array([HARDEST_PRESS, *later, 0.5 * (longest - shortest)])
    return np.array([0.0] * DERIVATIVES + [0.5 * (longest + shortest)]), half


def _coupling(specimen: Specimen) -> Floats:
    """Return the effect of each repeated time integral of the force on p, relative to the second integral."""
    modes, orders, (_, m1, m2) = modal_form(specimen), np.arange(TERMS), specimen.masses
    kick = (modes.shapes[:, Y] - modes.shapes[:, Z]) * (modes.rows[:, VZ] / m2 - modes.rows[:, VY] / m1)
    onto_p = (kick * modes.rates ** orders[:, None]).real.sum(axis=1) / [math.factorial(m) for m in orders]
    return np.asarray(onto_p / onto_p[1])


def _solve(accelerations: Floats, units: Floats, coupling: Floats) -> Floats:
    """Return the durations of n collisions and the moments about their middles, shape (n, 6).

    Depths and duration are corrected with tabulated derivatives, as in native/collision.hpp.
    """
    shapes, durations = collision_shapes()
    press = np.clip(accelerations[:, 0] - MIDDLE * accelerations[:, 1], SOFTEST, HARDEST)
    place = np.rint((press - SOFTEST) / SPACING).astype(int)
    onto_depths, onto_length = shapes[place, : POINTS + 1], shapes[place, ONTO_DURATION]
    onto_length = np.column_stack([onto_length, durations[place, END_ONTO_DURATION]])
    depths, length = shapes[place, DEPTHS], durations[place, DURATION]
    # Indentation if there were no contact force, in powers of time.
    powers = np.arange(2, DERIVATIVES + 2)
    bent = accelerations / [math.factorial(k) for k in powers]
    speed = 1.0 - (powers * bent * (-MIDDLE) ** (powers - 1)).sum(axis=1)
    depth = MIDDLE * speed - (bent * (-MIDDLE) ** powers).sum(axis=1)
    times, free, orders = np.append(HEIGHTS, 1.0), np.column_stack([depth, speed, bent]), np.arange(TERMS)
    through = coupling * units[:, None] ** (orders - 1.0) * (orders > 0)
    shares = SHARES.transpose(1, 0, 2).reshape(POINTS, -1)
    for _ in range(CORRECTIONS):
        force = HALF_FORCE * depths * np.sqrt(np.maximum(depths, 0.0))
        pushed = (force @ shares).reshape(-1, TERMS, POINTS + 1)
        later = length[:, None] * times - MIDDLE
        misfit = np.zeros_like(later)
        for coefficient in free.T[::-1]:
            misfit = misfit * later + coefficient[:, None]
        misfit -= ((through * length[:, None] ** (orders + 1))[:, None] @ pushed)[:, 0]
        misfit[:, :POINTS] -= depths
        depths = depths - (misfit[:, None] @ onto_depths)[:, 0]
        length = length - (misfit * onto_length).sum(axis=1)
    force = HALF_FORCE * depths * np.sqrt(np.maximum(depths, 0.0))
    ends = np.einsum("nk,mk->nm", force, SHARES[:, :, POINTS]) * length[:, None] ** (orders + 1)
    return np.column_stack([length, _about_the_middle(ends, length)])


def _about_the_middle(ends: Floats, length: NDArray[np.float64]) -> Floats:
    """Convert integrals of F (T - t)^m to integrals of F (T / 2 - t)^m, shape (n, MOMENTS)."""
    return np.stack(
        [
            sum(math.comb(m, j) * (-0.5 * length) ** (m - j) * ends[:, j] for j in range(m + 1))
            for m in range(MOMENTS)
        ],
        axis=1,
    )


LEAST_TOLERANCE = 1e-7
"""Smallest integration tolerance for batches, limited by the polynomials' error (native/collision.hpp)."""
FUSING_FAMILIES = ("x86_64_v3", "x86_64_v4")
"""Processor families with wide registers and fused multiply-add, on which batches are faster."""
MODES = 3
MOST_DAMPED = 0.05
"""Largest damping ratio of a mode in batches; a larger ratio would need more terms of the series."""
REACHED_END = Outcome.REACHED_END.value
LEAST_PART = 1e-9
"""Smallest contribution of a mode to p, relative to the largest one; a batch derives all modes from p."""


@dataclass(frozen=True, eq=False)
class BatchedMotion:
    """Result of one motion that was integrated in a batch."""

    states: Floats
    """States once per drive period, shape (periods, 6). If a period other than the last ends during a short
    collision, the state is extrapolated back from the motion after the collision."""
    impacts: int
    peak_x_m: float
    peak_p_m: float
    area_x: complex
    """Integral of x exp(-i (omega t + phase)) over the periods [m s]; zero if not observed."""
    area_p: complex
    growth: Floats
    """Logarithm of the tangent vector's length once per drive period, shape (periods,); empty without one."""
    struck: NDArray[np.int64]
    """Impact count until the end of each drive period, shape (periods,); empty without a tangent vector."""


@cache
def batches_pay() -> bool:
    """Return whether SIMD batches are faster than single runs on this processor."""
    return native_engine().family in FUSING_FAMILIES


def is_batchable(specimen: Specimen, tolerance: float) -> bool:
    """Return whether SIMD batches support a specimen and an integration tolerance."""
    return (
        tolerance >= LEAST_TOLERANCE
        and _turns_in_p(specimen)
        and collision_fit(native_engine(), specimen) is not None
    )


@lru_cache(maxsize=8)
def _turns_in_p(specimen: Specimen) -> bool:
    """Return whether the stops are Hertz contacts and all three modes oscillate and contribute to p."""
    if not isinstance(specimen.contact, Hertz) or not math.isfinite(sum(specimen.gaps_m)):
        return False
    modes = modal_form(specimen)
    path = np.abs(modes.shapes[:, Y] - modes.shapes[:, Z])
    is_damped = -modes.rates.real > MOST_DAMPED * np.abs(modes.rates.imag)
    return len(modes.rates) == MODES and not is_damped.any() and bool(path.min() >= LEAST_PART * path.max())


def follow_batch(
    runs: Sequence[NativeRun], periods: Sequence[int], watch: Watch = Watch.NOTHING
) -> list[BatchedMotion | None]:
    """Advance motions of one specimen in a batch, each by a given number of drive periods.

    Parameters
    ----------
    runs
        Motions with equal tolerances, out of contact, at the end of a drive period, with at most one tangent
        vector.
    periods
        Number of drive periods for each motion.
    watch
        Quantities to observe; observing does not change a motion.

    Returns
    -------
    Result of each motion; None for a failed motion, whose state is unchanged.

    Raises ValueError when batches do not support the specimen, or a motion is in contact.
    """
    first = runs[0]
    engine = first.engine
    fit = collision_fit(engine, first.specimen) if is_batchable(first.specimen, first.tolerance) else None
    if fit is None:
        raise ValueError(
            "This specimen cannot be simulated in a batch: use Hertz contacts and three oscillating modes."
        )
    # Start with the longest motion, so that motions computed in parallel end at about the same time.
    order = np.argsort(-np.asarray(periods), kind="stable")
    states = [np.empty((periods[place], DIRECTIONS)) for place in order]
    records, motions = engine.rows("Record", len(runs)), engine.rows("BatchMotion", len(runs))
    records["watch"] = watch
    for name, address in zip(
        ("tables", "now", "tangent"), np.transpose([runs[place].addresses for place in order]), strict=True
    ):
        motions[name] = address
    rooms = [len(own) if has else 0 for own, has in zip(states, motions["tangent"], strict=True)]
    growth, struck = [np.empty(room) for room in rooms], [np.empty(room, np.int64) for room in rooms]
    motions["growth"] = [own.ctypes.data for own in growth]
    motions["struck"] = [own.ctypes.data for own in struck]
    motions["sections"], motions["periods"] = [own.ctypes.data for own in states], np.take(periods, order)
    motions["record"] = records.ctypes.data + records.strides[0] * np.arange(len(runs))
    batch = engine.new("Batch", count=len(runs), tolerance=first.tolerance)
    batch["metric"] = energy_metric(first.specimen)
    batch["motions"], batch["fit"] = motions.ctypes.data, fit.ctypes.data
    engine.call("follow_batch", batch)
    seen = [records[name].tolist() for name in ("peak_x", "peak_p", "line_x", "line_p")]
    found: list[BatchedMotion | None] = [None] * len(runs)
    for place, outcome, *values in zip(
        *(order, motions["outcome"].tolist(), states, motions["impacts"].tolist(), *seen, growth, struck),
        strict=True,
    ):
        if outcome == REACHED_END:
            found[place] = BatchedMotion(*values)
    return found
