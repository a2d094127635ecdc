"""Localising one jump: back to before it, on the branch it was left from, and halving the way to it."""

import json
from collections.abc import Sequence
from dataclasses import dataclass

from ..excitation.settled_sine import SEARCH_LABEL, SettledSine
from ..excitation.steps import Segment
from .jump_search import LocatedJump, Side, Visit, is_on_branch, located, side
from .move import Conduct
from .record import recorded
from .settle import Settled, Settler, shortened
from .start import moved

_MOST_RETURNS = 2
"""How often a branch is looked for that is lost again on the way forward."""


@dataclass
class _Hunted:
    """Where the search stands."""

    branch: list[Visit]
    """Visits on the branch before the jump, in the order of the pass."""
    after: Visit
    here: Side


class JumpHunt:
    """Looks into one jump of a pass."""

    def __init__(self, settler: Settler, plan: SettledSine, direction: str, number: int) -> None:
        assert plan.jumps is not None
        self._settler = settler
        self._plan = plan
        self._rule = plan.jumps
        self._direction = direction
        self._number = number
        self._until_s = settler.play.elapsed_s + plan.search_s

    def localised(self, visited: Sequence[Visit], after: Visit) -> Conduct[bool]:
        """Narrow the bracket between the last of ``visited`` and ``after``; end at ``after``'s frequency.

        Returns whether it is a jump. A response that only changes steeply is none: it closes as the
        bracket does.
        """
        hunted = _Hunted(list(visited), after, Side.AFTER)
        found, why = yield from self._bisected(hunted)
        is_jump = found.is_jump(self._rule.factor)
        self._say(found, why if is_jump else "steep, but no jump")
        moved(self._settler.play, after.frequency_hz, self._plan.base_level)
        yield from self._settler.settled()
        return is_jump

    def _bisected(self, hunted: _Hunted) -> Conduct[tuple[LocatedJump, str]]:
        before, after = hunted.branch[-1], hunted.after
        seek = located(before, after, self._rule.resolution_hz)
        try:
            frequency_hz = next(seek)
            while True:
                if hunted.here is Side.AFTER and not (yield from self._led_back(hunted)):
                    return LocatedJump(before, after), "its branch was not found again"
                if self._is_late():
                    return LocatedJump(before, after), "the time for the search was over"
                visit = yield from self._searched(frequency_hz)
                hunted.here = side(visit, before, after)
                if hunted.here is Side.BEFORE:
                    before = visit
                    hunted.branch.append(visit)
                else:
                    after = visit
                frequency_hz = seek.send(visit)
        except StopIteration as end:
            jump: LocatedJump = end.value
            return jump, "localised"

    def _led_back(self, hunted: _Hunted) -> Conduct[bool]:
        """Go back along the pass until the responses of its branch are found again, then forward to its end."""
        branch = hunted.branch
        for _ in range(_MOST_RETURNS):
            place = yield from self._rejoined(branch)
            if place is None:
                return False
            if (yield from self._followed(branch[place + 1 :])):
                return True
        return False

    def _rejoined(self, branch: Sequence[Visit]) -> Conduct[int | None]:
        for place in range(len(branch) - 1, -1, -1):
            if self._is_late():
                return None
            found = yield from self._led_to(branch[place].frequency_hz)
            visit = Visit(found.frequency_hz, found.response)
            if is_on_branch(visit, branch[place], self._rule.factor):
                return place
        return None

    def _followed(self, ahead: Sequence[Visit]) -> Conduct[bool]:
        for expected in ahead:
            if self._is_late():
                return False
            found = yield from self._led_to(expected.frequency_hz)
            if not is_on_branch(Visit(found.frequency_hz, found.response), expected, self._rule.factor):
                return False
        return True

    def _led_to(self, frequency_hz: float) -> Conduct[Settled]:
        moved(self._settler.play, frequency_hz, self._plan.base_level)
        return (yield from self._settler.settled())

    def _searched(self, frequency_hz: float) -> Conduct[Visit]:
        found = yield from self._led_to(frequency_hz)
        segment = Segment(
            SEARCH_LABEL,
            {
                "frequency_hz": frequency_hz,
                "direction": self._direction,
                "pass": self._number,
                **found.numbers(),
            },
        )
        yield from recorded(self._settler, found, segment, self._plan.record_s)
        return Visit(frequency_hz, found.response)

    def _is_late(self) -> bool:
        """Whether the time left is too short for one more step and the way to the end."""
        step_s = self._plan.settling.longest_wait_s
        return self._settler.play.elapsed_s + 2 * step_s + self._plan.record_s > self._until_s

    def _say(self, found: LocatedJump, how: str) -> None:
        said = {
            "direction": self._direction,
            "pass": self._number,
            "frequency_hz": shortened(found.frequency_hz),
            "before_hz": found.before.frequency_hz,
            "after_hz": found.after.frequency_hz,
            "response_before": shortened(found.before.response),
            "response_after": shortened(found.after.response),
            "how": how,
        }
        self._settler.play.note("jump", json.dumps(said))
