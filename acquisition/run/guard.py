"""The watch over the running measurement: every block against the limits of the rig."""

import numpy as np

from ..errors import LimitExceeded
from ..instruments import Block, Samples
from ..plan.measurement import InRunLimits, OnOverload
from ..rig.channel import Channel
from ..rig.configuration import Rig, Role


class Guard:
    """Says when the run must end.

    It sits in the loop that reads the samples, with nothing between it and the generator: no window
    and no other process has a say.
    """

    def __init__(self, rig: Rig, channels: tuple[Channel, ...], limits: InRunLimits) -> None:
        self._rig = rig
        self._channels = channels
        self._limits = limits

    def require_safe(self, block: Block) -> None:
        """Raise LimitExceeded when a block passes a limit; the run then ramps down."""
        rig, fractions = self._rig, self._limits
        shaker = rig.shaker.limits
        acceleration = shaker.acceleration_m_per_s2
        self._require(
            "the base acceleration",
            self._peak(block, Role.BASE_ACCELERATION),
            acceleration.value * fractions.base_acceleration,
            "m/s2",
            acceleration.source,
        )
        amplifier_v = self._peak(block, Role.AMPLIFIER_VOLTAGE)
        self._require(
            "the amplifier voltage",
            amplifier_v,
            rig.amplifier.clip_v * fractions.amplifier_voltage,
            "V",
            f"clipping of the {rig.amplifier.model}",
        )
        self._require(
            "the coil current (voltage over resistance)",
            amplifier_v / rig.shaker.coil_resistance_ohm,
            shaker.current_a.value * fractions.current,
            "A",
            shaker.current_a.source,
        )
        if block.overloads and fractions.on_overload is OnOverload.STOP:
            first = block.overloads[0]
            raise LimitExceeded(
                f"{first.channel} was overloaded at sample {first.first_sample}. "
                "The run was ramped down and its recording kept; widen the range or lower amplitude_vpp"
            )

    def _peak(self, block: Block, role: Role) -> float:
        """Largest magnitude of a channel in its unit; zero for a channel the rig does not have."""
        for channel, volts in zip(self._channels, block.volts, strict=True):
            if channel.role is role:
                return _largest(volts) * abs(channel.units_per_volt)
        return 0.0

    def _require(self, what: str, value: float, limit: float, unit: str, source: str) -> None:
        if value > limit:
            raise LimitExceeded(
                f"{what} reached {value:.4g} {unit}, allowed is {limit:.4g} {unit} ({source}). "
                "The run was ramped down and its recording kept; lower amplitude_vpp"
            )


def _largest(volts: Samples) -> float:
    return float(np.max(np.abs(volts))) if volts.size else 0.0
