"""Letting a motion die by lowering its drive and bringing it back: the way out of a stubborn branch."""

from ..plan import RunState
from ._control_action import Conduct
from ._sine_loop import SinePlay

RUNGS = 12
RUNG = 1.2
"""Factor of one rung: the lowest setting is a ninth of the one of now."""
_RUNG_S = 0.1
_LOWEST_S = 0.5


def let_die(play: SinePlay) -> Conduct[None]:
    """Lower the setting rung by rung, wait, and raise it to what it was."""
    now = play.played
    for rung in range(1, RUNGS + 1):
        play.change(now.frequency_hz, play.bounded_vpp(now.setting_vpp / RUNG**rung))
        yield from play.listen(RunState.SETTLING, _RUNG_S)
    yield from play.listen(RunState.SETTLING, _LOWEST_S)
    for rung in range(RUNGS - 1, -1, -1):
        play.change(now.frequency_hz, play.bounded_vpp(now.setting_vpp / RUNG**rung))
        yield from play.listen(RunState.SETTLING, _RUNG_S)
