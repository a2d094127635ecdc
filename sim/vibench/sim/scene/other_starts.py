"""Whether the start of a scene decides what it comes to, and what other starts come to where it does not."""

from ..model.outcome import Outcome
from .ensemble import ErrorOf, ensemble_of
from .fixed_run import SceneRun
from .followed_run import FollowedRun
from .linear_motion import LinearMotion, never_touches
from .pace import Pace
from .prediction import Ensemble, StartMemory
from .repetition import FEWEST_NEUTRAL
from .scene import AutomaticDuration, FixedDuration, Observable, Scene
from .several_starts import FEWEST, Draw, Horizon, ReachedMotion, SeveralStarts, forgets_its_start
from .states_alone import Asking

ALONE = 0.5
"""Share of a budget that is spent on following chaos on; other starts have the rest."""


def memory_of(scene: Scene, begin: FollowedRun, seen: SceneRun, motion: LinearMotion) -> StartMemory:
    """Say whether the start decided which motion was reached.

    Parameters
    ----------
    scene
        What was asked.
    begin
        The motion where it began.
    seen
        What it came to.
    motion
        It without stops.

    """
    if never_touches(scene.specimen, motion):
        return StartMemory.KEPT
    if seen.grew:
        return StartMemory.LOST
    if scene.budget_s == 0.0 or seen.path[-1].outcome is not Outcome.REACHED_END:
        return StartMemory.UNKNOWN
    return StartMemory.LOST if forgets_its_start(begin, seen.path) else StartMemory.KEPT


def ensemble_beside(
    scene: Scene,
    begin: FollowedRun,
    asked: ReachedMotion,
    pace: Pace,
    error_of: ErrorOf,
    draw: Draw | None = None,
) -> Asking[Ensemble | None]:
    """Follow other starts beside the one asked for, as the budget of the scene allows or as ``draw`` says.

    None where the budget allows too few.
    """
    several = SeveralStarts(begin, asked, pace, _horizon(scene, pace), draw or _draw(scene, asked))
    yield from several.follow()
    if len(several.reached) == 1:
        return None
    return ensemble_of(several, scene.drive.amplitude_m, pace.forgetting_s, error_of)


def _draw(scene: Scene, asked: ReachedMotion) -> Draw:
    """Say how many starts are followed at what cost: enough of them, where their scatter was asked for."""
    if Observable.SCATTER in scene.observe:
        return Draw(clear=FEWEST)
    return Draw(budget_s=max(scene.budget_s - asked.run.cost_s, ALONE * scene.budget_s))


def _horizon(scene: Scene, pace: Pace) -> Horizon:
    """Say how far other starts are followed: as far as the one that was asked for."""
    match scene.duration:
        case FixedDuration(duration_s=longest_s, window_s=window_s):
            first_s = longest_s
        case AutomaticDuration(longest_s=longest_s, window_s=window_s):
            first_s = pace.settling_s
    judging_s = min(FEWEST_NEUTRAL * pace.forgetting_s, max(0.0, longest_s - window_s))
    last_s = max(0.0, longest_s - window_s - judging_s)
    return Horizon(min(first_s, last_s), last_s, judging_s, window_s)
