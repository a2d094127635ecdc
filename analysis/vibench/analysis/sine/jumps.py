"""Jumps of a response along a sweep, with bounds on their frequency."""

from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np
from scipy.ndimage import uniform_filter1d

from ..errors import InvalidRequest
from ..signals import PER_NEPER_DB, Flags, Reals
from ..tables import Tabular
from .stepped_response import SteppedResponse, SteppedSineAnalysis
from .sweep import SweepResponse

_SIDE = 12
"""Number of intervals on each side to which a straight line is fitted."""
_SMALLEST_DB = 1.5
_CLEAR = 8.0
"""Minimum size of a jump [standard errors], since thousands of steps with roughly known errors are tested."""
_LIKELY = 3.84
"""Twice the log likelihood ratio at 95 % (chi squared, one degree of freedom)."""
_TRANSITION = 3
"""Number of intervals within the jump itself, which belong to neither side."""
_DEGREE, _EXPLAINED = 4, 0.06
"""Degree of the polynomial fitted to 1/response squared at a resonance, and its largest residual relative to
the step. A jump leaves a residual of 0.13 or more; 400 resonances left at most 0.03."""
_LARGER = 2.0
"""Minimum ratio of a jump to the largest step near it in the response of the linear specimen."""


@dataclass(frozen=True)
class Jump:
    """Jump of a response in a sweep."""

    DOCUMENT: ClassVar = "frequency_hz lower_hz upper_hz time_s before after decibel"

    frequency_hz: float
    lower_hz: float
    upper_hz: float
    """95 % bounds of the frequency of the jump, including the neighbouring intervals."""
    time_s: float
    before: float
    after: float
    """Response before and after the jump, in the order of time."""
    standard_errors: float
    """Size of the jump in ln(response), divided by its standard error."""

    @property
    def decibel(self) -> float:
        """Size of the step [dB]; positive if the response grows with time."""
        return float(20 * np.log10(self.after / self.before))


def jumps(
    time_s: Reals,
    frequency_hz: Reals,
    response: Reals,
    smooth: Flags | None = None,
    linear: Reals | None = None,
) -> tuple[Jump, ...]:
    """Return the jumps of a response over time.

    Before and after each interval, a straight line is fitted to the logarithm of the response. A jump is a
    local maximum of the difference between both lines, of at least 1.5 dB and 8 standard errors. Resonances
    of a linear specimen, which are steep and ring in a fast sweep, are excluded. The position of a jump
    maximises the likelihood; its bounds come from the likelihood ratio.

    Parameters
    ----------
    time_s, frequency_hz, response
        In the order of time, shape (intervals,); the response must be positive.
    smooth
        Intervals with smooth motion, by default all. At least one side of a jump must be smooth, because a
        chaotic response fluctuates without jumps.
    linear
        Response of the linear specimen in the same sweep, positive, if known. A jump must be twice as large
        as any step of this response nearby.
    """
    if not time_s.shape == frequency_hz.shape == response.shape:
        raise InvalidRequest(
            f"times {time_s.shape}, frequencies {frequency_hz.shape} and responses {response.shape} "
            "must be equally long"
        )
    allowed = np.ones(time_s.shape, dtype=np.bool_) if smooth is None else smooth
    logarithm = _logarithm(response)
    size, error = _steps(logarithm)
    clear = (np.abs(size) * PER_NEPER_DB >= _SMALLEST_DB) & (np.abs(size) >= _CLEAR * error)
    explained = np.zeros_like(size) if linear is None else _steps(_logarithm(linear))[0]
    found = []
    for place in _peaks(np.where(clear, np.abs(size), 0.0)):
        near = slice(max(0, place - _SIDE), place + _SIDE)
        before = allowed[max(0, place - _SIDE) : max(0, place - _TRANSITION)]
        after = allowed[place + _TRANSITION : place + _SIDE]
        is_linear = _LARGER * np.abs(explained[near]).max() > abs(size[place])
        if not (before.all() or after.all()) or is_linear or _is_resonance(logarithm, place, size[place]):
            continue
        low, best, high = _likely(logarithm[near])
        first = near.start
        found.append(_jump((first + low, first + best, first + high), time_s, frequency_hz, logarithm))
    return tuple(found)


def _logarithm(response: Reals) -> Reals:
    return np.asarray(np.log(np.maximum(response, np.finfo(np.float64).tiny)))


def _steps(logarithm: Reals) -> tuple[Reals, Reals]:
    """Return the step at each interval, from the line fitted before to the line fitted after, with errors."""
    count = logarithm.size
    size, error = np.zeros(count), np.full(count, np.inf)
    ahead = np.arange(_SIDE) + _TRANSITION / 2
    # Weights with which a line fitted to (ahead, y) gives the value at zero, and the value's variance.
    basis = np.column_stack((np.ones(_SIDE), ahead))
    solver = np.linalg.pinv(basis)
    variance = float(np.linalg.inv(basis.T @ basis)[0, 0])
    places = np.arange(_SIDE + _TRANSITION, count - _SIDE - _TRANSITION)
    away = _TRANSITION // 2 + np.arange(_SIDE)
    sides = np.stack((logarithm[places[:, None] + away], logarithm[places[:, None] - 1 - away]))
    lines = sides @ solver.T
    scatter = np.sum((sides - lines @ basis.T) ** 2, axis=-1) / (_SIDE - 2)
    size[places] = lines[0, :, 0] - lines[1, :, 0]
    error[places] = np.sqrt(variance * scatter.sum(axis=0)) + np.finfo(np.float64).eps
    return size, error


def _is_resonance(logarithm: Reals, place: int, step: float) -> bool:
    """Return whether a resonance explains a step: 1/response squared follows a smooth polynomial."""
    near = logarithm[max(0, place - _SIDE - _TRANSITION) : place + _SIDE + _TRANSITION]
    square = np.exp(2 * (near.max() - near))
    basis = np.vander(np.linspace(-1.0, 1.0, near.size), _DEGREE + 1) / square[:, np.newaxis]
    solution, *_ = np.linalg.lstsq(basis, np.ones(near.size))
    left = (basis @ solution - 1) / 2
    return bool(np.sqrt(np.sum(left**2) / (near.size - _DEGREE - 1)) < _EXPLAINED * abs(step))


def _peaks(size: Reals) -> list[int]:
    """Return the index of the largest step in each neighbourhood."""
    left = size.copy()
    found = []
    while left.max(initial=0.0) > 0.0:
        place = int(np.argmax(left))
        found.append(place)
        left[max(0, place - _SIDE) : place + _SIDE + 1] = 0.0
    return sorted(found)


def _likely(logarithm: Reals) -> tuple[int, int, int]:
    """Return lower bound, best value and upper bound of the index at which one level changes to another."""
    count = logarithm.size
    misfit = np.full(count, np.inf)
    for place in range(2, count - 1):
        before, after = logarithm[:place], logarithm[place:]
        misfit[place] = before.size * before.var() + after.size * after.var()
    best = int(np.argmin(misfit))
    ratio = count * np.log(misfit / max(misfit[best], np.finfo(np.float64).tiny))
    likely = np.flatnonzero(ratio <= _LIKELY)
    return int(likely[0]), best, int(likely[-1])


def _jump(places: tuple[int, int, int], time_s: Reals, frequency_hz: Reals, logarithm: Reals) -> Jump:
    best = places[1]
    between = [0.5 * float(frequency_hz[each - 1] + frequency_hz[each]) for each in places]
    # The jump lies at a boundary between two intervals, within half an interval on either side.
    half = 0.5 * abs(float(frequency_hz[best] - frequency_hz[best - 1]))
    size, error = _steps(logarithm[max(0, best - 2 * _SIDE) : best + 2 * _SIDE])
    at = best - max(0, best - 2 * _SIDE)
    before = float(np.exp(np.median(logarithm[max(0, best - 1 - _TRANSITION) : best - 1])))
    after = float(np.exp(np.median(logarithm[best + 1 : best + 1 + _TRANSITION])))
    return Jump(
        frequency_hz=between[1],
        lower_hz=min(between) - half,
        upper_hz=max(between) + half,
        time_s=0.5 * float(time_s[best - 1] + time_s[best]),
        before=before,
        after=after,
        standard_errors=float(abs(size[at]) / error[at]) if 0 < at < size.size else 0.0,
    )


JUMP_FACTOR = 2.0
"""Minimum ratio of Response II at two levels that counts as a jump; for a linear specimen the ratio is 1."""

_UNSTEADY = 0.05
"""Relative uncertainty of Response II above which a step may contain two motions; NaN counts as above."""


@dataclass(frozen=True)
class LevelJump:
    """Jump of Response II between two consecutive levels."""

    direction: str
    """``"up"`` or ``"down"``: direction in which the level is stepped."""
    before_vpp: float
    after_vpp: float
    factor: float
    """Response II after the jump divided by Response II before the jump."""


def level_jumps(response: SteppedResponse) -> tuple[LevelJump, ...]:
    """Return the jumps of a stepped level in the order of time, except across a turning point.

    If the motion jumps during a step, its response is a mean of two motions. Such a step is skipped, and the
    steps before and after it are compared.
    """
    levels, sizes = response.amplitude_vpp.tolist(), response.response_ii.tolist()
    steps = list(zip(response.direction, levels, sizes, strict=True))
    steady = response.sd_response_ii < _UNSTEADY * response.response_ii
    for place in range(len(steps) - 2, 0, -1):
        (way, *_, before), (_, *_, now), (other, *_, after) = steps[place - 1 : place + 2]
        if not steady[place] and way == other and min(before, after) < now < max(before, after):
            del steps[place]
    found = []
    for (way, before_vpp, before), (other, after_vpp, after) in pairwise(steps):
        if way == other and before > 0 and not 1 / JUMP_FACTOR <= after / before <= JUMP_FACTOR:
            found.append(LevelJump(way, before_vpp, after_vpp, after / before))
    return tuple(found)


def hysteresis_vpp(jumps: tuple[LevelJump, ...]) -> tuple[float, float] | None:
    """Return the bounds of the difference: level of the jump up minus level of the jump down [V].

    Returns None unless there are jumps in both directions.
    """
    rises = [each for each in jumps if each.direction == "up" and each.factor > 1]
    falls = [each for each in jumps if each.direction == "down" and each.factor < 1]
    if not rises or not falls:
        return None
    rise, fall = rises[0], falls[-1]
    return rise.before_vpp - fall.before_vpp, rise.after_vpp - fall.after_vpp


@dataclass(frozen=True, eq=False)
class SteppedLevelAnalysis(SteppedSineAnalysis):
    """Results of a stepped level, with the jumps of its response."""

    DOCUMENT: ClassVar = (
        f"{SteppedSineAnalysis.DOCUMENT} amplitude_vpp=response.amplitude_vpp jumps hysteresis_vpp"
    )

    @property
    def jumps(self) -> tuple[LevelJump, ...]:
        """Jumps in the order of time."""
        return level_jumps(self.response)

    @property
    def hysteresis_vpp(self) -> tuple[float, float] | None:
        """Bounds of the difference: level of the jump up minus level of the jump down [V]."""
        return hysteresis_vpp(self.jumps)


_POINTS = 1000
_APART_DB = 1.5
_SMOOTHED_POINTS = 21
"""Number of points that are averaged, so that the scatter of chaos does not count as hysteresis."""
_PER_BEL_DB = 20.0


@dataclass(frozen=True, eq=False)
class Hysteresis(Tabular):
    """Difference between an up sweep and a down sweep; arrays of shape (points,)."""

    frequency_hz: Reals
    up: Reals
    down: Reals
    """Response II of the up sweep and of the down sweep."""
    differs: Flags
    """Flags of points where the sweeps, averaged over 2 % of the band, differ by more than 1.5 dB."""
    pairs: tuple[tuple[Jump, Jump], ...]
    """Pairs of opposite jumps: (jump of the up sweep, nearest jump of the down sweep)."""

    @property
    def widths_hz(self) -> tuple[tuple[float, float, float], ...]:
        """Width of each pair, with bounds: jump frequency of the up sweep minus that of the down sweep."""
        return tuple(
            (
                up.frequency_hz - down.frequency_hz,
                up.lower_hz - down.upper_hz,
                up.upper_hz - down.lower_hz,
            )
            for up, down in self.pairs
        )


def hysteresis(
    up: SweepResponse, down: SweepResponse, up_jumps: tuple[Jump, ...], down_jumps: tuple[Jump, ...]
) -> Hysteresis:
    """Compare an up sweep with a down sweep in their common range.

    Raises InvalidRequest when the directions are not up and down, or there is no common range.
    """
    if not (up.sweep_rate_hz_per_s > 0 > down.sweep_rate_hz_per_s):
        raise InvalidRequest("hysteresis needs an up sweep and a down sweep, in this order")
    low = max(float(up.frequency_hz.min()), float(down.frequency_hz.min()))
    high = min(float(up.frequency_hz.max()), float(down.frequency_hz.max()))
    if low >= high:
        raise InvalidRequest("the two sweeps have no frequency in common; compare sweeps of the same range")
    frequency_hz = np.linspace(low, high, _POINTS)
    orders = ((each, np.argsort(each.frequency_hz)) for each in (up, down))
    curves = [np.interp(frequency_hz, one.frequency_hz[to], one.response_ii[to]) for one, to in orders]
    apart_db = _PER_BEL_DB * np.log10(curves[0] / curves[1])
    together = uniform_filter1d(apart_db, _SMOOTHED_POINTS, mode="nearest")
    differs = np.asarray(np.abs(together) > _APART_DB)
    return Hysteresis(frequency_hz, curves[0], curves[1], differs, _pairs(up_jumps, down_jumps))


def _pairs(up: tuple[Jump, ...], down: tuple[Jump, ...]) -> tuple[tuple[Jump, Jump], ...]:
    """Pair jumps of opposite sign, because a step up in the up sweep is a step down in the down sweep."""
    pairs, free = [], list(down)
    for jump in up:
        opposite = [each for each in free if each.decibel * jump.decibel < 0]
        if opposite:
            nearest = min(opposite, key=lambda each: abs(each.frequency_hz - jump.frequency_hz))
            free.remove(nearest)
            pairs.append((jump, nearest))
    return tuple(pairs)
