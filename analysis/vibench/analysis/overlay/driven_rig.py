"""Parameters of a recording's rig, and the recorded voltage that drove it."""

from dataclasses import dataclass
from enum import StrEnum
from functools import partial

import numpy as np
from pydantic import ValidationError

from vibench.acquisition.recording import Recording, coupling_cut_hz
from vibench.acquisition.rig import Rig, amplifier_of, shaker_of
from vibench.sim import Specimen, base_transmissibility
from vibench.sim.shaker.loaded_shaker import Amplifier, Shaker
from vibench.sim.shaker.sampled_voltage import DrivenTable

from ..errors import UnusableData
from ..recordings.channels import BASE, DRIVE, sensor_gain
from ..recordings.response import ResponseChannel
from ..signals.arrays import Complexes, Reals

AMPLIFIER = "amplifier_voltage"
"""Role of the channel that records the amplifier's output."""


class Driven(StrEnum):
    """Recorded signal that drives the simulated specimen."""

    AMPLIFIER = "recorded amplifier voltage"
    GENERATOR = "recorded generator voltage"
    BASE = "recorded base motion"

    @property
    def by_voltage(self) -> bool:
        """Whether a voltage drives the simulation, which then includes the shaker's table."""
        return self is not Driven.BASE


@dataclass(frozen=True)
class DrivenRig:
    """Rig and specimen that a recorded voltage drives."""

    table: DrivenTable
    driven: Driven
    role: str
    """Role of the voltage channel."""
    response: str
    """Role of the channel that measures m0."""


def driven_rig(recording: Recording, specimen: Specimen, shaker: Shaker | None = None) -> DrivenRig:
    """Return the rig that the recorded voltage drives.

    Raises UnusableData when the recording does not describe its shaker or amplifier, or does not measure m0.

    Parameters
    ----------
    recording
        Recording; its amplifier voltage is used or, if not recorded, its generator voltage.
    specimen
        Specimen on the table.
    shaker
        Fitted shaker; by default the shaker of the bench configuration.
    """
    response = ResponseChannel(recording).role
    rig = _bench_rig(recording)
    if AMPLIFIER in recording.roles:
        amplifier, driven, role = Amplifier(), Driven.AMPLIFIER, AMPLIFIER
    else:
        amplifier, driven, role = Amplifier() if rig is None else amplifier_of(rig), Driven.GENERATOR, DRIVE
    if shaker is None:
        if rig is None:
            raise UnusableData(
                "the bench in the recording describes no shaker, so the recorded voltage cannot be "
                "simulated; record with a complete bench configuration, or analyse the recording together "
                "with weak noise of the same rig, to which a shaker can be fitted"
            )
        shaker = shaker_of(rig)
    base, m0 = (recording.channel(each) for each in (BASE, response))
    table = DrivenTable(
        amplifier,
        shaker,
        specimen,
        partial(sensor_gain, recording.bench, base),
        partial(sensor_gain, recording.bench, m0),
        coupling_cut_hz(base.coupling),
    )
    return DrivenRig(table, driven, role, response)


def carried_mass(specimen: Specimen, frequency_hz: Reals) -> Complexes:
    """Return the apparent mass without contact: momentum of the masses divided by the base velocity [kg]."""
    moved = base_transmissibility(specimen, frequency_hz)[:, :3]
    return np.asarray(moved @ np.asarray(specimen.masses, dtype=np.float64))


def acceleration_per_volt(shaker: Shaker, s: Complexes, carried_kg: Complexes) -> Complexes:
    """Return the base's acceleration per coil voltage at s = i omega [m/s2/V]."""
    dynamic = (
        shaker.suspension_stiffness_n_per_m
        + shaker.suspension_damping_ns_per_m * s
        + (shaker.moving_mass_kg + carried_kg) * s**2
    )
    coupled = (shaker.coil_resistance_ohm + shaker.coil_inductance_h * s) * dynamic
    return np.asarray(shaker.force_constant_n_per_a * s**2 / (coupled + s * shaker.force_constant_n_per_a**2))


def described_shaker(recording: Recording) -> Shaker | None:
    """Return the shaker of a recording's bench configuration; None if not described."""
    rig = _bench_rig(recording)
    return None if rig is None else shaker_of(rig)


def _bench_rig(recording: Recording) -> Rig | None:
    try:
        return Rig.model_validate(dict(recording.bench))
    except ValidationError:
        return None


def recorded_voltage(recording: Recording, rig: DrivenRig, start: int = 0, stop: int | None = None) -> Reals:
    """Read the driving voltage [V], by default of the whole recording, shape (samples,).

    Raises UnusableData when samples were lost.
    """
    volts = recording.read(rig.role, start, stop)
    lost = int(np.count_nonzero(np.isnan(volts)))
    if lost:
        raise UnusableData(
            f"{lost} samples of the {rig.driven.value.removeprefix('recorded ')} were lost, so the motion "
            "cannot be simulated; the measured result remains valid"
        )
    return volts
