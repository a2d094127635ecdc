"""Where the motion jumps as the level of a sine is stepped up and down, and how far apart the two lie."""

from dataclasses import asdict, dataclass
from itertools import pairwise

from .stepped_response import SteppedResponse

JUMP_FACTOR = 2.0
"""Response II that changes by more than this between two levels has jumped: a linear one does not change."""

_UNSTEADY = 0.05
"""Relative uncertainty of Response II above which a step may hold two motions; NaN is above it too."""


@dataclass(frozen=True)
class LevelJump:
    """Response II changed by a factor between two levels that follow each other."""

    direction: str
    """``"up"`` or ``"down"``: which way the level went."""
    before_vpp: float
    after_vpp: float
    before_m: float
    """Amplitude of the base there [m]."""
    after_m: float
    factor: float
    """Response II after over before."""


def level_jumps(response: SteppedResponse, factor: float = JUMP_FACTOR) -> tuple[LevelJump, ...]:
    """Find the jumps of a stepped level, in the order of time; none is looked for across a turning point.

    A step during which the motion jumped shows a mean of both: the jump is that from the step before it to
    the one after it.
    """
    steps = list(
        zip(
            response.direction,
            response.amplitude_vpp.tolist(),
            response.drive_amplitude_m.tolist(),
            response.response_ii.tolist(),
            strict=True,
        )
    )
    steady = response.sd_response_ii < _UNSTEADY * response.response_ii
    for place in range(len(steps) - 2, 0, -1):
        (way, *_, before), (_, *_, now), (other, *_, after) = steps[place - 1 : place + 2]
        if not steady[place] and way == other and min(before, after) < now < max(before, after):
            del steps[place]
    found = []
    for (way, before_vpp, before_m, before), (other, after_vpp, after_m, after) in pairwise(steps):
        if way == other and before > 0 and not 1 / factor <= after / before <= factor:
            found.append(LevelJump(way, before_vpp, after_vpp, before_m, after_m, after / before))
    return tuple(found)


def hysteresis_vpp(jumps: tuple[LevelJump, ...]) -> tuple[float, float] | None:
    """Tell how far the level of the jump up lies above that of the fall back, at least and at most [V].

    None when the motion did not jump up going up and fall going down.
    """
    rises = [each for each in jumps if each.direction == "up" and each.factor > 1]
    falls = [each for each in jumps if each.direction == "down" and each.factor < 1]
    if not rises or not falls:
        return None
    rise, fall = rises[0], falls[-1]
    return rise.before_vpp - fall.before_vpp, rise.after_vpp - fall.after_vpp


def level_summary(response: SteppedResponse) -> dict[str, object]:
    """Give levels and jumps as JSON can hold them."""
    jumps = level_jumps(response)
    return {
        "amplitude_vpp": response.amplitude_vpp,
        "jumps": [asdict(each) for each in jumps],
        "hysteresis_vpp": hysteresis_vpp(jumps),
    }
