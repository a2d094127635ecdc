"""Whether a measurement is conducted by what is heard, and by whom."""

from ..bench import RunBench
from ..control import Conduct, conduct
from ..errors import ConfigurationError
from ..excitation import AbstractFeedback
from ..plan import Measurement, Player, player_of


def conductor_for(bench: RunBench, measurement: Measurement) -> Conduct[None] | None:
    """Give who conducts a measurement; None for one whose course is known.

    Raises
    ------
    ConfigurationError
        When the bench cannot do it: before anything plays.

    """
    if not isinstance(measurement.excitation, AbstractFeedback):
        return None
    if player_of(measurement, bench.rig) is Player.OUTPUT:
        raise ConfigurationError(
            f"{measurement.name} is decided while it plays, and an analogue output is written ahead of its "
            "time. Nothing was played; let daq.output play streams only, and connect the function generator"
        )
    return conduct(measurement, bench.rig, bench.channels, bench.digitizer.sample_rate_hz)
