"""Linear model of the rig, from the voltage at the generator's terminal to table and specimen."""

from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from math import inf

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibench.sim import NoContact, Specimen
from vibench.sim.shaker.linear_motion import SINE_COLUMNS, LinearMotion, linear_motion
from vibench.sim.shaker.loaded_shaker import Amplifier, Shaker

from ._configuration import Rig, ShakerConfig

ComplexArray = NDArray[np.complex128]
_PEAK_OVER_RMS = 2.0**0.5
"""Ratio of peak to rms of a sine; the limiter's setting is the rms current of the largest unlimited sine."""
_VOLTAGE, _CURRENT, _BASE, _M0, _P = range(len(SINE_COLUMNS))


class BaseQuantity(StrEnum):
    """A quantity of shaker or specimen that the model predicts."""

    AMPLIFIER_VOLTAGE = "amplifier_voltage"
    """Voltage at the output of the amplifier [V]."""
    CURRENT = "current"
    """Current in the coil [A]."""
    FORCE = "force"
    """Force of the coil on the table, force constant times current [N]."""
    STROKE = "stroke"
    """Displacement of the table from rest [m]."""
    VELOCITY = "velocity"
    """Velocity of the table [m/s]."""
    ACCELERATION = "acceleration"
    """Acceleration of the table [m/s2]."""
    AMPLITUDE = "amplitude"
    """Amplitude of the specimen: displacement of m0 relative to the table [m]."""
    M0_DISPLACEMENT = "m0_displacement"
    """Absolute displacement of m0 [m]."""
    M0_VELOCITY = "m0_velocity"
    """Absolute velocity of m0 [m/s]."""
    M0_ACCELERATION = "m0_acceleration"
    """Absolute acceleration of m0 [m/s2]."""
    P = "p"
    """Displacement of m1 relative to m2 [m]."""


_COLUMNS = {
    BaseQuantity.AMPLIFIER_VOLTAGE: (_VOLTAGE, 0),
    BaseQuantity.CURRENT: (_CURRENT, 0),
    BaseQuantity.FORCE: (_CURRENT, 0),
    BaseQuantity.STROKE: (_BASE, 0),
    BaseQuantity.VELOCITY: (_BASE, 1),
    BaseQuantity.ACCELERATION: (_BASE, 2),
    BaseQuantity.M0_DISPLACEMENT: (_M0, 0),
    BaseQuantity.M0_VELOCITY: (_M0, 1),
    BaseQuantity.M0_ACCELERATION: (_M0, 2),
    BaseQuantity.P: (_P, 0),
}
"""Column of the linear motion for each quantity, and the power of i omega that multiplies the column."""


class OnTable(StrEnum):
    """What is mounted on the table in the model."""

    SPECIMEN = "specimen"
    NOTHING = "nothing"
    """Bare table, whose response is smooth; used by feedback, which measures the specimen's influence."""


@dataclass(frozen=True)
class RigModel:
    """A rig from the generator's terminal to table and specimen, linear except for the specimen's stops.

    Coil, table and specimen are solved together (`vibench.sim.shaker`), because near its resonances the
    specimen changes the table's motion by some decibels. Where a sine moves p beyond the gap, the stops are
    included to first order. Clipping, the current limiter, the table's stops and its axial resonance above 15
    kHz are not included; the virtual rig, or a check on the real rig, covers these effects.
    """

    rig: Rig
    on_table: OnTable = OnTable.SPECIMEN

    @property
    def gap_m(self) -> float:
        """Smaller of the two gaps of m1 at rest [m]; infinite without stops."""
        specimen = specimen_of(self.rig)
        without = self.on_table is OnTable.NOTHING or isinstance(specimen.contact, NoContact)
        return inf if without else min(specimen.gaps_m)

    def transfer(self, quantity: BaseQuantity, frequency_hz: ArrayLike) -> ComplexArray:
        """Return the complex ``quantity`` per volt at the terminal, in the shape of ``frequency_hz``.

        Valid without collisions; the time dependence is exp(+i omega t). 0 Hz is allowed; only a
        direct-coupled amplifier gives a static deflection of the table.
        """
        return self._of(quantity, frequency_hz, self._motion(frequency_hz).per_volt)

    def stuck_transfer(self, quantity: BaseQuantity, frequency_hz: ArrayLike) -> ComplexArray:
        """Return the same quantity as `transfer`, but with the stops fixing m1 to m2."""
        return self._of(quantity, frequency_hz, self._motion(frequency_hz).stuck_motion)

    def lever(self, quantity: BaseQuantity, frequency_hz: ArrayLike) -> ComplexArray:
        """Return the complex ``quantity`` per metre of p that the stops impose; shape of ``frequency_hz``."""
        return self._of(quantity, frequency_hz, self._motion(frequency_hz).lever)

    def under_sines(
        self, quantity: BaseQuantity, frequency_hz: ArrayLike, terminal_v: ArrayLike
    ) -> ComplexArray:
        """Return complex amplitudes of ``quantity`` for peak voltages ``terminal_v`` [V], by broadcasting."""
        return self._of(quantity, frequency_hz, self._motion(frequency_hz).response(terminal_v, self.gap_m))

    def volts_for(self, acceleration: ArrayLike, frequency_hz: ArrayLike) -> NDArray[np.float64]:
        """Return the peak terminal voltage [V] for a peak table acceleration [m/s2], shape (n,)."""
        hz = np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64))
        base_m = np.asarray(acceleration, dtype=np.float64) / (2 * np.pi * hz) ** 2
        return self._motion(hz).volts_for(base_m, self.gap_m)

    def _motion(self, frequency_hz: ArrayLike) -> LinearMotion:
        specimen = None if self.on_table is OnTable.NOTHING else specimen_of(self.rig)
        hz = np.ascontiguousarray(frequency_hz, dtype=np.float64)
        return _kept_motion(amplifier_of(self.rig), shaker_of(self.rig), specimen, hz.tobytes())

    def _of(self, quantity: BaseQuantity, frequency_hz: ArrayLike, moved: ComplexArray) -> ComplexArray:
        hz = np.asarray(frequency_hz, dtype=np.float64)
        s = 2j * np.pi * hz.ravel()
        if quantity is BaseQuantity.AMPLITUDE:
            result = moved[:, _M0] - moved[:, _BASE]
        else:
            column, order = _COLUMNS[quantity]
            result = s**order * moved[:, column]
        if quantity is BaseQuantity.FORCE:
            result *= self.rig.shaker.force_constant_n_per_a
        return np.asarray(result.reshape(hz.shape), dtype=np.complex128)


@lru_cache(maxsize=16)
def _kept_motion(
    amplifier: Amplifier, shaker: Shaker, specimen: Specimen | None, frequency_hz: bytes
) -> LinearMotion:
    """Return the linear motion, solved once for all quantities at the same frequencies."""
    return linear_motion(amplifier, shaker, specimen, np.frombuffer(frequency_hz, dtype=np.float64))


def suspended_mass_kg(shaker: ShakerConfig) -> float:
    """Return the rigid mass that the coil moves [kg]: moving element and fixture, without the specimen."""
    return shaker.moving_mass_kg + shaker.fixture_mass_kg


def specimen_of(rig: Rig) -> Specimen:
    """Return the specimen that a rig describes."""
    return rig.specimen.specimen()


def amplifier_of(rig: Rig) -> Amplifier:
    """Return the amplifier of a rig as a model for the simulation."""
    amplifier = rig.amplifier
    return Amplifier(
        gain=amplifier.gain,
        low_cut_hz=amplifier.low_cut_hz,
        high_cut_hz=amplifier.high_cut_hz,
        clip_v=amplifier.clip_v,
        current_limit_a=amplifier.current_limit_a.value * _PEAK_OVER_RMS,
    )


def shaker_of(rig: Rig) -> Shaker:
    """Return the shaker of a rig, including its fixture, as a model for the simulation."""
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
