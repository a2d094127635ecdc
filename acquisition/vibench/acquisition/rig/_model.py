"""The rig as a linear chain, from a volt at the generator's terminal to table and specimen."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibench.sim import Specimen
from vibench.sim.shaker import Amplifier, Shaker

from ._configuration import AmplifierConfig, Rig, ShakerConfig

ComplexArray = NDArray[np.complex128]
_PEAK_OVER_RMS = 2.0**0.5
"""The current limiter's setting is the rms of the largest sine it lets pass."""


class BaseQuantity(StrEnum):
    """A quantity of the chain that has a limit."""

    AMPLIFIER_VOLTAGE = "amplifier_voltage"
    """At the amplifier's output [V]."""
    CURRENT = "current"
    """In the coil [A]."""
    FORCE = "force"
    """Of the coil on the table, force constant times current [N]."""
    STROKE = "stroke"
    """Displacement of the table from rest [m]."""
    VELOCITY = "velocity"
    """Of the table [m/s]."""
    ACCELERATION = "acceleration"
    """Of the table [m/s2]."""


@dataclass(frozen=True)
class RigModel:
    """Linear model of a rig, from the generator's terminal to the table, for limits before energising.

    The coil and the suspended table are coupled by the force constant G (an electrodynamic
    transducer, Beranek, Acoustics, ch. 3)::

        m x'' + d x' + k x = G i          L i' + R i + G x' = u

    with m the moving mass and the fixture. The amplifier is its gain between two first-order band
    edges. Not in it: the specimen (some 10 g on more than half a kilogram, whose resonances notch and
    raise the table's motion locally), clipping, the current limiter, the table's stops and its axial
    resonance above 15 kHz. Those belong to the virtual rig or to the check with the rig itself.
    """

    rig: Rig

    def transfer(self, quantity: BaseQuantity, frequency_hz: ArrayLike) -> ComplexArray:
        """Peak of ``quantity`` per volt at the generator's terminal, with phase, shape of ``frequency_hz``.

        Time goes as exp(+i omega t). Zero hertz is allowed: a direct-coupled amplifier holds the table
        deflected, one with a lower band edge does not.
        """
        s = np.asarray(2j * np.pi * np.asarray(frequency_hz, dtype=np.float64), dtype=np.complex128)
        shaker = self.rig.shaker
        voltage = amplifier_gain(self.rig.amplifier, s)
        force_constant = shaker.force_constant_n_per_a
        dynamic_stiffness = _dynamic_stiffness(shaker, s)
        impedance = shaker.coil_resistance_ohm + s * shaker.coil_inductance_h
        # Multiplied out by the dynamic stiffness, which may vanish: the current never divides by it.
        coupled = impedance * dynamic_stiffness + s * force_constant**2
        stroke = force_constant * voltage / coupled
        match quantity:
            case BaseQuantity.AMPLIFIER_VOLTAGE:
                result = voltage
            case BaseQuantity.CURRENT:
                result = dynamic_stiffness * voltage / coupled
            case BaseQuantity.FORCE:
                result = force_constant * dynamic_stiffness * voltage / coupled
            case BaseQuantity.STROKE:
                result = stroke
            case BaseQuantity.VELOCITY:
                result = s * stroke
            case BaseQuantity.ACCELERATION:
                result = s**2 * stroke
        return np.asarray(result, dtype=np.complex128)


def suspended_mass_kg(shaker: ShakerConfig) -> float:
    """Everything rigid that the coil moves [kg]: moving element and fixture, without the specimen."""
    return shaker.moving_mass_kg + shaker.fixture_mass_kg


def amplifier_gain(amplifier: AmplifierConfig, s: ComplexArray) -> ComplexArray:
    """Output volts per input volt at the Laplace variable ``s`` [rad/s], shape of ``s``."""
    above = 1.0 + s / (2 * np.pi * amplifier.high_cut_hz)
    low_cut = 2 * np.pi * amplifier.low_cut_hz
    below = s / (s + low_cut) if low_cut > 0 else np.ones_like(s)
    return np.asarray(amplifier.gain * below / above, dtype=np.complex128)


def _dynamic_stiffness(shaker: ShakerConfig, s: ComplexArray) -> ComplexArray:
    damping = shaker.suspension_damping_ns_per_m
    stiffness = shaker.suspension_stiffness_n_per_m
    return np.asarray(stiffness + s * damping + s**2 * suspended_mass_kg(shaker))


def specimen_of(rig: Rig) -> Specimen:
    """Make the specimen that a rig describes."""
    return rig.specimen.specimen()


def amplifier_of(rig: Rig) -> Amplifier:
    """Give the numbers of a rig's amplifier that the simulated table is driven with."""
    amplifier = rig.amplifier
    return Amplifier(
        gain=amplifier.gain,
        low_cut_hz=amplifier.low_cut_hz,
        high_cut_hz=amplifier.high_cut_hz,
        clip_v=amplifier.clip_v,
        current_limit_a=amplifier.current_limit_a.value * _PEAK_OVER_RMS,
    )


def shaker_of(rig: Rig) -> Shaker:
    """Give the numbers of a rig's shaker, its fixture included."""
    shaker = rig.shaker
    return Shaker(
        moving_mass_kg=suspended_mass_kg(shaker),
        suspension_stiffness_n_per_m=shaker.suspension_stiffness_n_per_m,
        suspension_damping_ns_per_m=shaker.suspension_damping_ns_per_m,
        force_constant_n_per_a=shaker.force_constant_n_per_a,
        coil_resistance_ohm=shaker.coil_resistance_ohm,
        coil_inductance_h=shaker.coil_inductance_h,
        stroke_m=shaker.limits.stroke_m.value,
    )
