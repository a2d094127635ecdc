"""Motions of one specimen followed eight at a time in a processor's vector registers, by their states alone.

native/batch.hpp does the work, for Hertz's stops at *quick* and *standard*; what is observed are the states
once a drive period (docs/decisions/0061-lanes.md). SI units.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np

from ..model.hertz import Hertz
from ..model.modes import modal_form
from ..model.outcome import Outcome
from ..model.specimen import Specimen
from ..model.state import Y, Z
from .collision_fit import collision_fit
from .run import DIRECTIONS, Floats, NativeRun, native_engine

LEAST_TOLERANCE = 1e-7
"""Polynomials know a collision no better; as in native/collision.hpp."""
FUSING_FAMILIES = ("x86_64_v3", "x86_64_v4")
"""Of processors that keep eight numbers in two registers or one, and fuse products with sums."""
MODES = 3
MOST_DAMPED = 0.05
"""Damping ratio up to which a mode is taken: beyond, its series would need more terms."""
LEAST_PART = 1e-9
"""Of a mode in p, over the largest: p alone is followed, and everything else found from it."""


@dataclass(frozen=True, eq=False)
class BatchedMotion:
    """Course of one motion."""

    states: Floats
    """Once a drive period, up to the end, shape (periods, 6). One within a short collision, unless it is the
    last, is extrapolated from the flight after it."""
    impacts: int


@cache
def batches_pay() -> bool:
    """Whether this processor follows motions in a batch in less time than one after the other."""
    return native_engine().family in FUSING_FAMILIES


def is_batchable(specimen: Specimen, tolerance: float) -> bool:
    """Whether motions of such a specimen can be followed in a batch at such a tolerance."""
    return (
        tolerance >= LEAST_TOLERANCE
        and _turns_in_p(specimen)
        and collision_fit(native_engine(), specimen) is not None
    )


@lru_cache(maxsize=8)
def _turns_in_p(specimen: Specimen) -> bool:
    """Whether Hertz's stops are met by three modes that turn, and each moves p."""
    if not isinstance(specimen.contact, Hertz) or not math.isfinite(sum(specimen.gaps_m)):
        return False
    modes = modal_form(specimen)
    path = np.abs(modes.shapes[:, Y] - modes.shapes[:, Z])
    is_damped = -modes.rates.real > MOST_DAMPED * np.abs(modes.rates.imag)
    return len(modes.rates) == MODES and not is_damped.any() and bool(path.min() >= LEAST_PART * path.max())


def follow_batch(runs: Sequence[NativeRun], periods: Sequence[int]) -> list[BatchedMotion | None]:
    """Advance motions of a specimen that is batchable, each by a number of its drive periods.

    Parameters
    ----------
    runs
        Each in flight, at a whole drive period, at the same tolerance. They carry no small changes.
    periods
        How far each is followed, in its own drive periods.

    Returns
    -------
    What was seen of each; None of one that was lost, which stays where it was.

    Raises ValueError when the specimen is not batchable, or a motion is on a stop.

    """
    first = runs[0]
    engine = first.engine
    fit = collision_fit(engine, first.specimen) if is_batchable(first.specimen, first.tolerance) else None
    if fit is None:
        msg = "This specimen cannot be followed in a batch: use Hertz's stops and three modes that turn."
        raise ValueError(msg)
    # The longest first, so that all lanes end at about the same time.
    order = np.argsort(-np.asarray(periods), kind="stable")
    states = [np.empty((count, DIRECTIONS)) for count in periods]
    motions = engine.rows("BatchMotion", len(runs))
    for motion, place in zip(motions, order, strict=True):
        motion["tables"], motion["now"] = runs[place].addresses
        motion["sections"], motion["periods"] = states[place].ctypes.data, periods[place]
    batch = engine.new("Batch", count=len(runs), tolerance=first.tolerance)
    batch["motions"], batch["fit"] = motions.ctypes.data, fit.ctypes.data
    engine.call("follow_batch", batch)
    found: list[BatchedMotion | None] = [None] * len(runs)
    for motion, place in zip(motions, order, strict=True):
        if motion["outcome"] == Outcome.REACHED_END:
            found[place] = BatchedMotion(states[place], int(motion["impacts"]))
    return found
