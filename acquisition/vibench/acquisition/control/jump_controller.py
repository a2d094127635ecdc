"""Locate a jump: return to the branch before the jump, then halve the frequency interval.

If the motion stays on the other branch, the drive is lowered until that motion stops.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum, auto
from math import inf, log

from ..excitation.plan import JumpSearch
from ..excitation.stepped_sine import SettledSine
from ..excitation.steps import Segment
from ..plan import RunState
from ..recording import JumpNote, JumpSearchEnd, JumpSide, SegmentLabel
from .control_action import Controller
from .settling_controller import SettledPoint, SettledState, SettlingController, record_settled
from .sine_loop import SineLoop, glide, start

RUNGS = 12
RUNG = 1.2
"""Factor by which each of `RUNGS` steps lowers the generator setting; all steps lower it to about 1/9."""
_RUNG_S = 0.1
_LOWEST_S = 0.5


def decay_motion(loop: SineLoop) -> Controller[None]:
    """Lower the generator setting in steps, wait, and raise the setting to its earlier value."""
    now = loop.setting
    for rung in range(1, RUNGS + 1):
        loop.change(now.frequency_hz, loop.bounded_vpp(now.setting_vpp / RUNG**rung))
        yield from loop.listen(RunState.SETTLING, _RUNG_S)
    yield from loop.listen(RunState.SETTLING, _LOWEST_S)
    for rung in range(RUNGS - 1, -1, -1):
        loop.change(now.frequency_hz, loop.bounded_vpp(now.setting_vpp / RUNG**rung))
        yield from loop.listen(RunState.SETTLING, _RUNG_S)


def side(point: SettledPoint, before: SettledPoint, after: SettledPoint) -> JumpSide:
    """Return whether a point between the ends of a jump belongs before or after the jump.

    The point belongs before the jump if its response and the response of ``before`` are the closest pair of
    the three responses. A jump to a third branch counts as after.
    """
    away = ratio(point, before)
    return JumpSide.BEFORE if away <= min(ratio(point, after), ratio(before, after)) else JumpSide.AFTER


def ratio(one: SettledPoint, other: SettledPoint) -> float:
    """Return the ratio of larger to smaller response; 1 if both are equal, infinite if only one is zero."""
    if min(one.response, other.response) <= 0.0:
        return 1.0 if one.response == other.response else inf
    return float(2.0 ** abs(log(one.response / other.response, 2)))


def is_on_branch(point: SettledPoint, expected: SettledPoint, factor: float) -> bool:
    """Return whether a point is on the same branch as an earlier point at the same frequency.

    Both points must have the same period or be aperiodic. The responses of two branches differ by at least
    ``factor``, so the limit is half of this factor in decibels. Repeated measurements of a chaotic motion
    scatter more than those of a periodic motion: their limit is the whole factor.
    """
    if point.period != expected.period:
        return False
    return bool(ratio(point, expected) < (factor if point.period == 0 else factor**0.5))


_MOST_BRACKETS = 4
"""Largest number of brackets (frequency intervals) per jump; if a branch is left early, a new one starts."""


class _Return(Enum):
    BACK = auto()
    NOT_FOUND = auto()
    LEFT = auto()
    """The motion returned to the branch before the jump, but left it again before the end of that branch."""


class _Pace(Enum):
    """How the frequency moves along a branch to its end."""

    GLIDE = auto()
    STEP = auto()


@dataclass
class JumpBracket:
    """Bracket around a jump; each new point replaces the end that `side` chooses."""

    branch: list[SettledPoint]
    """Points on the branch before the jump, in the order of the pass."""
    after: SettledPoint
    here: JumpSide = JumpSide.AFTER
    """Side of the jump on which the motion is now."""

    @property
    def before(self) -> SettledPoint:
        """The last point before the jump."""
        return self.branch[-1]

    @property
    def frequency_hz(self) -> float:
        """Middle of the frequency interval that contains the jump [Hz]."""
        return 0.5 * (self.before.frequency_hz + self.after.frequency_hz)

    def is_narrow(self, resolution_hz: float) -> bool:
        """Whether the interval is no wider than ``resolution_hz``."""
        return abs(self.after.frequency_hz - self.before.frequency_hz) <= resolution_hz * (1 + 1e-9)

    def is_jump(self, factor: float) -> bool:
        """Whether the response changes by more than ``factor`` across the bracket."""
        return ratio(self.before, self.after) > factor

    def narrow(self, point: SettledPoint) -> None:
        """Replace one end of the bracket by ``point``, which was measured between the two ends."""
        self.here = side(point, self.before, self.after)
        if self.here is JumpSide.BEFORE:
            self.branch.append(point)
        else:
            self.after = point


@dataclass(frozen=True)
class SettledPass:
    """One pass of a settled sine through all its frequencies."""

    controller: SettlingController
    plan: SettledSine
    direction: str
    number: int

    def settle_at(self, frequency_hz: float) -> Controller[SettledState]:
        """Move to a frequency and wait until the motion has settled."""
        yield from glide(self.controller.loop, frequency_hz, self.plan.base_level, self.plan.glide_step_hz)
        return (yield from self.controller.settle())

    def record_at(
        self, frequency_hz: float, label: SegmentLabel, **others: int | str
    ) -> Controller[SettledPoint]:
        """Settle at a frequency, and record a segment labelled with the pass and the settled motion."""
        found = yield from self.settle_at(frequency_hz)
        own: dict[str, int | float | str] = {"direction": self.direction, "pass": self.number}
        numbers = {"frequency_hz": frequency_hz, **own, **others, **found.note.numbers}
        yield from record_settled(self.controller, found, Segment(label, numbers), self.plan.record_s)
        return found.point

    def run(self, frequencies_hz: Sequence[float], came_from: str) -> Controller[None]:
        """Go to every frequency and record there; locate every jump between two neighbouring frequencies."""
        points: list[SettledPoint] = []
        searched, branch = 0, 1  # each jump increases the branch number by 1
        for frequency_hz in frequencies_hz:
            point = yield from self.record_at(
                frequency_hz, SegmentLabel.STEP, branch=branch, came_from=came_from
            )
            search = self.plan.jumps
            has_jumped = search is not None and points and ratio(points[-1], point) > search.factor
            if search is not None and has_jumped and searched < search.most_searches:
                searched += 1
                point, is_on_next_branch = yield from JumpLocator(self, search).localise(points, point)
                if is_on_next_branch:
                    branch += 1
                    points = []
            points.append(point)
            came_from = f"{frequency_hz:g} Hz"


class JumpLocator:
    """Search for one jump during one pass through the frequencies."""

    def __init__(self, one_pass: SettledPass, rule: JumpSearch) -> None:
        self._pass = one_pass
        self._rule = rule
        self._loop = one_pass.controller.loop
        self._until_s = self._loop.elapsed_s + one_pass.plan.search_s

    def localise(
        self, points: Sequence[SettledPoint], after: SettledPoint
    ) -> Controller[tuple[SettledPoint, bool]]:
        """Narrow the bracket from the last of ``points`` to ``after``, then go to the frequency of ``after``.

        Return the point reached there, and whether it is on the new branch behind a jump.

        A steep slope is not a jump: its change of the response shrinks with the bracket. If both branches
        exist at the frequency of ``after``, the motion may end on either branch, which the note states.
        """
        search = JumpBracket(list(points), after)
        why = yield from self._bisect(search)
        is_jump = search.is_jump(self._rule.factor)
        point = (yield from self._pass.settle_at(after.frequency_hz)).point
        has_arrived = is_on_branch(point, after, self._rule.factor)
        branch = JumpSide.AFTER if has_arrived or not is_jump else JumpSide.BEFORE
        self._say(search, why, branch)
        return point, is_jump and has_arrived

    def _bisect(self, search: JumpBracket) -> Controller[JumpSearchEnd]:
        for _ in range(_MOST_BRACKETS):
            why = yield from self._halve(search)
            if why is not None:
                return why
        return JumpSearchEnd.ELSEWHERE

    def _halve(self, search: JumpBracket) -> Controller[JumpSearchEnd | None]:
        """Halve the bracket until it is narrow enough; return None if the motion left its branch early."""
        while not search.is_narrow(self._rule.resolution_hz):
            if search.here is JumpSide.AFTER:
                match (yield from self._return_to_branch(search)):
                    case _Return.NOT_FOUND if not self._is_late():
                        return JumpSearchEnd.BRANCH_LOST
                    case _Return.LEFT:
                        return None
            if self._is_late():
                return JumpSearchEnd.OUT_OF_TIME
            search.narrow((yield from self._pass.record_at(search.frequency_hz, SegmentLabel.SEARCH)))
            if not search.is_jump(self._rule.factor):
                return JumpSearchEnd.STEEP
        return JumpSearchEnd.LOCALISED

    def _return_to_branch(self, search: JumpBracket) -> Controller[_Return]:
        """Go back along the pass until the motion is on its branch again, then forward to the branch's end.

        Move forward in a fast glide first. If the motion leaves the branch, repeat in steps to find where.
        """
        for pace in _Pace:
            place = yield from self._rejoin(search.branch)
            if place is None:
                return _Return.NOT_FOUND
            end = len(search.branch)
            steps = range(max(place + 1, end - 1), end) if pace is _Pace.GLIDE else range(place + 1, end)
            left = yield from self._find_departure(search.branch, steps)
            if left is None:
                return _Return.BACK
            if self._is_late():
                return _Return.NOT_FOUND
            if pace is _Pace.STEP:
                place, search.after = left
                del search.branch[place:]
        return _Return.LEFT

    def _find_departure(
        self, branch: Sequence[SettledPoint], steps: range
    ) -> Controller[tuple[int, SettledPoint] | None]:
        """Go forward. Return index and state at which the motion left the branch; None if it stayed."""
        for place in steps:
            found = yield from self._pass.settle_at(branch[place].frequency_hz)
            if self._is_late() or not is_on_branch(found.point, branch[place], self._rule.factor):
                return place, found.point
        return None

    def _rejoin(self, branch: Sequence[SettledPoint]) -> Controller[int | None]:
        """Go back in growing steps until the motion is on the branch. Return that index, or None."""
        stretch = 1
        place = len(branch) - 1
        while not self._is_late():
            found = yield from self._pass.settle_at(branch[place].frequency_hz)
            if is_on_branch(found.point, branch[place], self._rule.factor):
                return place
            if place == 0:
                return (yield from self._restart_from_rest(branch[0]))
            place, stretch = max(0, place - stretch), 2 * stretch
        return None

    def _restart_from_rest(self, first: SettledPoint) -> Controller[int | None]:
        """Stop the motion at the first frequency; return 0 if it restarts on the branch, else None."""
        yield from decay_motion(self._loop)
        found = yield from self._pass.controller.settle()
        return 0 if is_on_branch(found.point, first, self._rule.factor) else None

    def _is_late(self) -> bool:
        """Return whether the time is too short for another step and the move to the end of the bracket."""
        plan = self._pass.plan
        return self._loop.elapsed_s + 2 * plan.settling.longest_wait_s + plan.record_s > self._until_s

    def _say(self, found: JumpBracket, how: JumpSearchEnd, arrived: JumpSide) -> None:
        self._loop.note(
            JumpNote(
                direction=self._pass.direction,
                pass_number=self._pass.number,
                frequency_hz=found.frequency_hz,
                before_hz=found.before.frequency_hz,
                after_hz=found.after.frequency_hz,
                response_before=found.before.response,
                response_after=found.after.response,
                how=how,
                arrived=arrived,
            )
        )


def step_settled(loop: SineLoop, plan: SettledSine) -> Controller[None]:
    """Run all passes of a settled sine, from the ramp up to the ramp down."""
    controller = SettlingController(loop, plan.settling, plan.base_level)
    passes = tuple(plan.passes())
    yield from start(loop, passes[0][1][0], plan.base_level)
    came_from = "rest"
    for number, (direction, frequencies_hz) in enumerate(passes, start=1):
        yield from SettledPass(controller, plan, direction, number).run(frequencies_hz, came_from)
        came_from = f"{direction} pass {number}, {frequencies_hz[-1]:g} Hz"
    yield from loop.ramp_down()
