"""Texts of a map: classes and names of motions, a caption, and the comparison with recorded levels."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vibench.sim import MotionKind, Specimen, SpecimenTable, count_text, shipped_specimens, usual_specimen
from vibench.sim.maps import QUANTITIES, Map, MapMotion, MapResults

from ..comparison import Curve
from ..errors import NotEnoughData
from ..recordings.facts import specimen_difference as specimen_difference, value_words  # noqa: PLC0414 - public
from ..signals import Reals

MOTION_CLASSES = (
    ("no impacts", "#eef3f7"),
    ("period 1", "#0072b2"),
    ("period 2", "#56b4e9"),
    ("period 3", "#009e73"),
    ("period 4", "#f0e442"),
    ("period 5 or more", "#e69f00"),
    ("quasi-periodic", "#cc79a7"),
    ("chaotic", "#d55e00"),
    ("undecided", "#9a9a9a"),
)
"""Classes of motions in a map, and their colours."""
NO_NUMBERS = ("name", "about", "sources")
"""Keys of a specimen's description that have no influence on its motion."""


def motion_classes(results: MapResults) -> Reals:
    """Return the index in `MOTION_CLASSES` of the motion from the first initial state; NaN if unknown.

    Returns
    -------
    ndarray
        Array with the shape of the grid of varied parameters.
    """
    motion, period, impacts = (results.map_values(name) for name in ("motion", "period", "impact_rate"))
    kinds = list(MotionKind)
    found = np.full(motion.shape, np.nan)
    is_periodic = motion == kinds.index(MotionKind.PERIODIC)
    found[is_periodic] = np.minimum(period[is_periodic], 5.0)
    found[is_periodic & (period == 1.0) & (impacts == 0.0)] = 0.0
    found[motion == kinds.index(MotionKind.QUASI_PERIODIC)] = 6.0
    found[np.isin(motion, [kinds.index(MotionKind.CHAOTIC), kinds.index(MotionKind.CHAOTIC_SO_FAR)])] = 7.0
    found[motion == kinds.index(MotionKind.UNDECIDED)] = 8.0
    return found


def motion_words(results: MapResults, motion: MapMotion) -> str:
    """Return a motion's name and the fraction of points with this motion; add an interval to an estimate."""
    kind = motion.motion.removesuffix(" so far") if motion.period is None else f"period {motion.period}"
    kind = kind if motion.has_impacts else "no impacts"
    text = f"{kind}, Response I {motion.response_i:.3g}: {motion.share.share:.2%} of the points"
    interval = f"{motion.share.low:.2%} to {motion.share.high:.2%}"
    if results.plan.random_starts:
        return f"{text}; with other random initial states, it would be {interval}"
    is_estimate = results.audit is not None and results.audit.filled > 0
    return f"{text}; if all points were computed, it would be {interval}" if is_estimate else text


def map_caption(results: MapResults) -> str:
    """Return the caption: specimen, computed points, filled points and the error rate of filled points."""
    plan = results.plan
    starts = count_text(len(plan.start_labels), "initial state")
    sentences = [
        (
            f"{', '.join((_specimen_words(plan.specimen), *_consts(plan)))}; {plan.accuracy.value}; motions "
            f"followed for up to {plan.periods} drive periods from {starts}."
        ),
        f"{results.points} of {plan.grid.size} points computed.",
    ]
    audit = results.audit
    if audit is not None and audit.audited:
        share = audit.wrong_share
        sentences.append(
            "The other points were filled in, because their neighbours agree. To check this, "
            f"{audit.audited} of these points were drawn at random and computed: {audit.wrong} had a "
            f"different motion ({share.low:.1%} to {share.high:.1%} of the filled points)."
        )
    return " ".join((*sentences, results.target_text(plan.error))).rstrip()


def _specimen_words(specimen: SpecimenTable) -> str:
    """Return a specimen's name and changes from the shipped specimen of that name or from the paper's."""
    shipped = shipped_specimens().get(specimen.name) or usual_specimen()
    changed = [
        f"{key} = {value_words(specimen.hertz_k if key == 'hertz_stiffness' else value)}"
        for key, value in specimen
        if key not in NO_NUMBERS and value not in (None, getattr(shipped, key))
    ]
    return f"Specimen {specimen.name}" + (f" ({', '.join(changed)})" if changed else "")


def _consts(plan: Map) -> list[str]:
    """Return the fixed parameters of a map; initial values of zero are left out."""
    law = [] if plan.model is None else [f"model = {plan.model}"]
    values = {each.field: getattr(plan, each.field) for each in QUANTITIES}
    is_set = {name: value != 0.0 or Map.model_fields[name].default is None for name, value in values.items()}
    return law + [
        f"{name} = {value:g}" for name, value in values.items() if isinstance(value, float) and is_set[name]
    ]


@dataclass(frozen=True, eq=False)
class RecordedLevel:
    """Measured base amplitude and Response I of a recording over frequency."""

    name: str
    pairs: Sequence[tuple[float, float]]
    """Frequency [Hz] and base amplitude [m]."""
    measured: Sequence[Curve]
    """Curves of Response I of m0."""
    specimen: Specimen | None = None
    """Specimen stored in the recording; None if the recording describes none."""

    def difference(self, simulated: Specimen) -> str:
        """Return how a simulated specimen differs from the recorded one; see `specimen_difference`."""
        return specimen_difference(simulated, self.specimen, self.name)


MOST_BINS = 100


def recorded_level(frequency_hz: Reals, drive_amplitude_m: Reals) -> tuple[tuple[float, float], ...]:
    """Return up to 100 pairs of frequency [Hz] and base amplitude [m] of a sweep or stepped sine, ascending.

    Raises NotEnoughData when the drive had fewer than two frequencies.

    Parameters
    ----------
    frequency_hz, drive_amplitude_m
        Measured values in any order, shape (n,). The median of each bin is used, so that one outlier has no
        effect.
    """
    known = np.isfinite(frequency_hz) & np.isfinite(drive_amplitude_m) & (drive_amplitude_m > 0.0)
    place, level = frequency_hz[known], drive_amplitude_m[known]
    if place.size < 2 or np.ptp(place) < 1e-3 * float(place.max()):
        raise NotEnoughData(
            "the drive of this recording covers no range of frequencies; choose a stepped sine or a sweep"
        )
    bins = min(MOST_BINS, place.size)
    edges = np.linspace(place.min(), place.max(), bins + 1)
    owner = np.clip(np.searchsorted(edges, place, side="right") - 1, 0, bins - 1)
    return tuple(
        (float(np.median(place[owner == k])), float(np.median(level[owner == k])))
        for k in range(bins)
        if bool(np.any(owner == k))
    )
