"""Stepping through frequencies on one branch, each settled before it is recorded."""

from collections.abc import Sequence

from ..excitation.settled_sine import SettledSine
from ..excitation.steps import Segment
from ..recording import JumpSide, SegmentLabel
from .control_action import Controller
from .dwell_controller import recorded
from .jump_controller import JumpLocator
from .jump_search import SettledPoint, ratio
from .settling_controller import SettlingController
from .sine_loop import SineLoop, glided, started


def step_settled(loop: SineLoop, plan: SettledSine) -> Controller[None]:
    """Carry out every pass, from the first ramp up to the last ramp down."""
    settling_controller = SettlingController(loop, plan.settling, plan.base_level)
    passes = tuple(plan.passes())
    yield from started(loop, passes[0][1][0], plan.base_level)
    came_from = "rest"
    for number, (direction, frequencies_hz) in enumerate(passes, start=1):
        stepping = Pass(settling_controller, plan, number, direction)
        yield from stepping.carried_out(frequencies_hz, came_from)
        came_from = f"{direction} pass {number}, {frequencies_hz[-1]:g} Hz"
    yield from loop.ramp_down()
    yield from loop.say()


class Pass:
    """One way through the frequencies, and the branch that was followed."""

    def __init__(
        self, settling_controller: SettlingController, plan: SettledSine, number: int, direction: str
    ) -> None:
        self._settling_controller = settling_controller
        self._plan = plan
        self._number = number
        self._direction = direction
        self._branch = 1
        """Counts the branches of this pass: one more after every jump."""

    def carried_out(self, frequencies_hz: Sequence[float], came_from: str) -> Controller[None]:
        """Visit and record every frequency; look into the jumps between them."""
        points: list[SettledPoint] = []
        searched = 0
        search = self._plan.jumps
        for frequency_hz in frequencies_hz:
            point = yield from self._stepped(frequency_hz, came_from)
            has_jumped = search is not None and points and ratio(points[-1], point) > search.factor
            if search is not None and has_jumped and searched < search.most_searches:
                searched += 1
                locator = JumpLocator(self._settling_controller, self._plan, self._direction, self._number)
                arrival = yield from locator.localised(points, point)
                if arrival.is_jump and arrival.branch is JumpSide.AFTER:
                    self._branch += 1
                    points = []
                point = arrival.point
            points.append(point)
            came_from = f"{frequency_hz:g} Hz"

    def _stepped(self, frequency_hz: float, came_from: str) -> Controller[SettledPoint]:
        settling_controller = self._settling_controller
        yield from glided(
            settling_controller.loop, frequency_hz, self._plan.base_level, self._plan.glide_step_hz
        )
        found = yield from settling_controller.settled()
        segment = Segment(
            SegmentLabel.STEP,
            {
                "frequency_hz": frequency_hz,
                "direction": self._direction,
                "pass": self._number,
                "branch": self._branch,
                "came_from": came_from,
                **found.note.numbers,
            },
        )
        yield from recorded(settling_controller, found, segment, self._plan.record_s)
        return found.point
