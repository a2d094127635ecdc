"""An open bench in the words of the protocol."""

from ..bench import Bench
from ._status import BenchFacts, ChannelFacts


def bench_facts(bench: Bench) -> BenchFacts:
    """Say which bench is open."""
    return BenchFacts(
        rig_name=bench.rig.name,
        is_simulated=bench.rig.virtual is not None,
        identities={part: identity.reply for part, identity in bench.identities.items()},
        channels=tuple(
            ChannelFacts(
                role=channel.role.value,
                unit=channel.unit,
                units_per_volt=channel.units_per_volt,
                full_scale_v=channel.full_scale_v,
            )
            for channel in bench.channels
        ),
        sample_rate_hz=bench.digitizer.sample_rate_hz,
    )
