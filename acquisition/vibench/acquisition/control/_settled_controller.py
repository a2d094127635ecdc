"""Stepping through frequencies on one branch, each settled before it is recorded."""

from collections.abc import Sequence

from ..excitation import STEP_LABEL, Segment, SettledSine
from ._control_action import Controller
from ._jump_controller import JumpLocator
from ._jump_search import Side, SettledPoint, ratio
from ._record import recorded
from ._settle import SettlingController
from ._sine_loop import SineLoop
from ._start import glided, started


def step_settled(play: SineLoop, plan: SettledSine) -> Controller[None]:
    """Carry out every pass, from the first ramp up to the last ramp down."""
    settler = SettlingController(play, plan.settling, plan.base_level)
    passes = tuple(plan.passes())
    yield from started(play, passes[0][1][0], plan.base_level)
    came_from = "rest"
    for number, (direction, frequencies_hz) in enumerate(passes, start=1):
        stepping = Pass(settler, plan, number, direction)
        yield from stepping.carried_out(frequencies_hz, came_from)
        came_from = f"{direction} pass {number}, {frequencies_hz[-1]:g} Hz"
    yield from play.ramp_down()
    yield from play.say()


class Pass:
    """One way through the frequencies, and the branch that was followed."""

    def __init__(self, settler: SettlingController, plan: SettledSine, number: int, direction: str) -> None:
        self._settler = settler
        self._plan = plan
        self._number = number
        self._direction = direction
        self._branch = 1
        """Counts the branches of this pass: one more after every jump."""

    def carried_out(self, frequencies_hz: Sequence[float], came_from: str) -> Controller[None]:
        """Visit and record every frequency; look into the jumps between them."""
        visited: list[SettledPoint] = []
        searched = 0
        search = self._plan.jumps
        for frequency_hz in frequencies_hz:
            visit = yield from self._stepped(frequency_hz, came_from)
            has_jumped = search is not None and visited and ratio(visited[-1], visit) > search.factor
            if search is not None and has_jumped and searched < search.most_searches:
                searched += 1
                hunt = JumpLocator(self._settler, self._plan, self._direction, self._number)
                arrival = yield from hunt.localised(visited, visit)
                if arrival.is_jump and arrival.branch is Side.AFTER:
                    self._branch += 1
                    visited = []
                visit = arrival.visit
            visited.append(visit)
            came_from = f"{frequency_hz:g} Hz"

    def _stepped(self, frequency_hz: float, came_from: str) -> Controller[SettledPoint]:
        settler = self._settler
        yield from glided(settler.play, frequency_hz, self._plan.base_level, self._plan.glide_step_hz)
        found = yield from settler.settled()
        segment = Segment(
            STEP_LABEL,
            {
                "frequency_hz": frequency_hz,
                "direction": self._direction,
                "pass": self._number,
                "branch": self._branch,
                "came_from": came_from,
                **found.numbers(),
            },
        )
        yield from recorded(settler, found, segment, self._plan.record_s)
        return found.visit
