"""Table of the motions that depend sensitively on the start, with their shares."""

from collections.abc import Iterator, Sequence

from rich.table import Table

from vibench.sim import Ensemble, FoundMotion, ScenePrediction, StartMemory

_SHOWN = 24
"""Rows on the terminal; JSON and file contain all."""


def share_text(point: ScenePrediction) -> str:
    """Return the share of starts that settled on a point's motion; empty if all starts give the same."""
    match point:
        case ScenePrediction(ensemble=Ensemble() as ensemble):
            return f"{ensemble.motions[ensemble.asked].starts}/{ensemble.starts}"
        case ScenePrediction(memory=StartMemory.LOST):
            return "forgotten"
        case _:
            return ""


def motions_table(points: Sequence[ScenePrediction]) -> Table | None:
    """Return a table of the motions at points with more than one; None without such a point."""
    several = list(_several(points))
    if not several:
        return None
    rows = Table(
        title="Motions with sensitive dependence on the start: starts differ by a millionth of a gap",
        caption=f"{len(several) - _SHOWN} more are in the JSON" if len(several) > _SHOWN else None,
    )
    for heading in ("f [Hz]", "I", "II", "I of p", "II of p", "motion", "error", "share"):
        rows.add_column(heading, justify="right")
    for point, motion in several[:_SHOWN]:
        responses = (motion.response_i, motion.response_ii, motion.relative_i, motion.relative_ii)
        rows.add_row(
            f"{point.frequency_hz:g}",
            *("" if value is None else f"{value:.4g}" for value in responses),
            motion_text(motion),
            "" if motion.error_estimate is None else f"{motion.error_estimate:.1g}",
            f"{motion.share.share:.0%} ({100 * motion.share.low:.0f}-{100 * motion.share.high:.0f}%)",
        )
    return rows


def motion_text(motion: FoundMotion) -> str:
    """Return name and period of a motion."""
    return str(motion.motion) if motion.period is None else f"{motion.motion}, {motion.period}"


def forgetting_text(points: Sequence[ScenePrediction]) -> str:
    """Return where motions depended sensitively on the start, and the cost of the additional starts."""
    lost = [point for point in points if point.memory is StartMemory.LOST]
    if not lost:
        return ""
    ensembles = [point.ensemble for point in lost if point.ensemble is not None]
    starts, followed_s = sum(each.starts for each in ensembles), sum(each.followed_s for each in ensembles)
    where = f"At {len(lost)} of {len(points)} points"
    said = f"{where} the motion depends sensitively on the start, or did not settle."
    if not ensembles:
        averaged = sum(point.target.starts for point in lost if point.target is not None)
        return f"{said} There the answer is a mean over starts, {averaged} in all." if averaged else said
    return (
        f"{said} There {starts} starts were simulated for {followed_s:.0f} s in all; "
        f"{sum(each.is_one_of_several for each in lost)} points have more than one motion."
    )


def _several(points: Sequence[ScenePrediction]) -> Iterator[tuple[ScenePrediction, FoundMotion]]:
    for point in points:
        if point.ensemble is not None and point.is_one_of_several:
            for motion in point.ensemble.motions:
                yield point, motion
