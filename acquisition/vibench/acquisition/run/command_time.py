"""Time that commands take: what a plan must leave for them, and how much longer it takes for them."""

from itertools import islice

from ..errors import ConfigurationError
from ..excitation.plan import AbstractFeedback
from ..excitation.steps import Tone
from ..instruments import FunctionGenerator
from ..plan import Measurement, RunState, known_phases

ROOM = 1.25
"""A step of a glide must be longer than a setting takes by this factor: not all take the same time."""
_MOST_COMMANDS = 2
"""For one change of tone: amplitude and frequency."""


def require_time_for_commands(measurement: Measurement, generator: FunctionGenerator) -> float:
    """Refuse a glide whose steps are too short; return how much longer a plan of settled tones will take [s].

    Raises ConfigurationError when a step is shorter than the generator takes for a setting, measured now.
    """
    step_s = measurement.excitation.glide_step_s
    if step_s is not None:
        latency_s = _commands_of_a_step(measurement) * generator.measured_latency_s()
        if step_s < ROOM * latency_s:
            raise ConfigurationError(
                f"step_s = {step_s:g} s is too short: the generator takes {latency_s:.3g} s for a setting, "
                f"and the drive would fall behind the plan. Nothing was played; give step_s of at least "
                f"{_rounded_up(ROOM * latency_s):.2f} s, or shorten generator.settle_s if the instrument "
                "allows it"
            )
        return 0.0
    settled = sum(phase.state is RunState.SETTLING for phase in known_phases(measurement))
    return settled * _MOST_COMMANDS * generator.measured_latency_s() if settled > 1 else 0.0


def _commands_of_a_step(measurement: Measurement) -> int:
    """Frequency, and amplitude where that changes too: under feedback it may at any step."""
    if isinstance(measurement.excitation, AbstractFeedback):
        return _MOST_COMMANDS
    levels = {
        step.play.level for step in islice(measurement.excitation.steps(), 2) if isinstance(step.play, Tone)
    }
    return len(levels)


def _rounded_up(step_s: float) -> float:
    """Give a hundredth of a second more, at most."""
    return -(-step_s // 0.01) * 0.01
