"""Hardware configuration: the chain from generator to converter, with its limits and manual settings."""

import os
from datetime import date
from enum import StrEnum
from math import inf, pi, sqrt
from typing import Literal, Self

from pydantic import (
    Field,
    NonNegativeFloat,
    PositiveFloat,
    PositiveInt,
    field_validator,
    model_validator,
)

from vibench.sim import SpecimenTable

from ..errors import ConfigurationError
from ..host.toml_file import FrozenModel
from ..instruments import Knob
from ._sensors import (
    RESPONSE_ROLES,
    SCANNED_ROLES,
    AccelerometerConfig,
    Role,
    SensorConfig,
    Sourced,
    StatedUncertainty,
    TransducerConfig,
    VibrometerConfig,
    sensor_table,
)

TOKEN_KEY = "vibench-token"  # noqa: S105 - a name, not a password
"""Metadata key of the token in a gRPC call."""
TOKEN_VARIABLE = "VIBENCH_RIG_TOKEN"  # noqa: S105 - as above
"""Environment variable of the token; other users can read a command line."""


def given_token() -> str:
    """Return the token from the environment; empty if none is needed."""
    return os.environ.get(TOKEN_VARIABLE, "")


USUAL_GRID_RATE_HZ = 102_400.0
"""Default steps per second of the simulated analogue world."""
COARSEST_GRID_RATE_HZ = 12_800.0
"""Coarsest grid: the base moves by 0.8 % too little at `WATCHED_HZ`, see `level_error`."""
WATCHED_HZ = 500.0
"""The highest resonance of the specimen, and the top of the paper's sines."""
_MEASURED = 0.55
"""Factor of `level_error`, from a comparison with 409,600 steps per second at 60 Hz to 1 kHz."""
LARGEST_LEVEL_ERROR = 0.01
"""Largest level error of a plan on a coarser grid than the default."""
STEPS_PER_SAMPLE = 2
"""Fewest steps per sample on a coarser grid, for the transition band of the converter's filter."""


class VirtualConfig(FrozenModel):
    """Properties that only a simulated rig needs."""

    seed: int = Field(ge=0)
    pace: Literal["free", "wall"] = "free"
    """``"free"``: as fast as possible. ``"wall"``: ``speed`` times real time."""
    speed: PositiveFloat = 1.0
    grid_rate_hz: float = USUAL_GRID_RATE_HZ
    """Computed steps per second: 12.8 to 102.4 kHz, and at least twice the sample rate. A coarser grid is
    faster and less exact (docs/decisions/0006-virtual-rig.md)."""
    generator_clock_ppm: float = Field(ge=-200, le=200)
    converter_clock_ppm: float = Field(ge=-200, le=200)
    generator_noise_v: NonNegativeFloat
    """White, rms from zero to 25.6 kHz, at the terminal while the output is on [V]."""
    amplifier_noise_v: NonNegativeFloat
    """White, rms in the same band, at the output [V]."""
    accelerometer_noise_m_per_s2: NonNegativeFloat
    """White, rms in the same band [m/s2]."""
    vibrometer_noise_m_per_s_per_rthz: NonNegativeFloat
    vibrometer_dropouts_per_s: NonNegativeFloat
    faults: str | None = None
    """Path of a script of faults, relative to this file's folder; see docs/campaigns.md."""
    converter_noise_v: NonNegativeFloat
    """rms of each input, at any sample rate [V]."""

    @field_validator("grid_rate_hz")
    @classmethod
    def _is_fine_enough(cls, rate_hz: float) -> float:
        if not COARSEST_GRID_RATE_HZ <= rate_hz <= USUAL_GRID_RATE_HZ:
            raise ValueError(
                f"the virtual rig is computed in {COARSEST_GRID_RATE_HZ:g} to {USUAL_GRID_RATE_HZ:g} steps a "
                f"second: coarser, the base would move by more than "
                f"{level_error(WATCHED_HZ, COARSEST_GRID_RATE_HZ):.1%} too little at {WATCHED_HZ:g} Hz; give "
                "a rate in between, or leave it out"
            )
        return rate_hz


def level_error(frequency_hz: float, grid_rate_hz: float) -> float:
    """Return the largest relative shortfall of the base motion in a sine.

    Averaging and holding the drive over a step causes (pi f h)^2 / 3. Extrapolating the specimen's force on
    the table over the step causes the rest. The specimen's response to the base is exact.
    """
    return _MEASURED * (pi * frequency_hz / grid_rate_hz) ** 2


def highest_carried_hz(grid_rate_hz: float) -> float | None:
    """Return the highest frequency with correct levels on a grid; None for no limit, on the default grid."""
    if grid_rate_hz >= USUAL_GRID_RATE_HZ:
        return None
    return grid_rate_hz / pi * sqrt(LARGEST_LEVEL_ERROR / _MEASURED)


def fastest_sample_rate_hz(grid_rate_hz: float) -> float | None:
    """Return a converter's fastest rate on a grid; None for no limit, on the default grid."""
    return None if grid_rate_hz >= USUAL_GRID_RATE_HZ else grid_rate_hz / STEPS_PER_SAMPLE


class OutputUse(StrEnum):
    """Excitations that an analogue output plays; the function generator plays the others."""

    STREAMS = "streams"
    """Only signals that do not repeat, and so do not fit into a generator."""
    TONES_AND_STREAMS = "tones_and_streams"
    """Sines too: dwells, steps and sweeps, for a bench with a permanently connected output."""


class OutputConfig(FrozenModel):
    """An analogue output that plays into the amplifier signals too long for a function generator.

    It plays the voltage of the generator's terminal at the same setting, so ``amplitude_vpp`` means the
    same for both. Connect only one of the two to the amplifier: even at zero volts, an output of 50 ohm
    in parallel would halve the generator's voltage. The check at low level before every run finds a wrong
    connection.
    """

    physical: str = Field(pattern=r"^ao\d+$")
    """Name on the device: ``"ao0"``."""
    plays: OutputUse = OutputUse.STREAMS
    device: str | None = None
    """The output's module in the driver, if it is not the converter's; both must be able to share a start
    trigger, as modules of one chassis can."""
    limit_v: PositiveFloat = Field(le=10.0)
    """Largest allowed voltage of either sign [V]."""
    sample_rate_hz: PositiveFloat
    """Rate of the output, which the hardware must support exactly."""
    # Three blocks of a run at least: one plays, one is ready, and one is being written.
    ahead_s: float = Field(default=0.5, ge=0.3, le=5.0)
    """Buffered time [s]: the longest tolerated pause of this computer, and the delay of an early ramp
    down."""
    source: str = Field(min_length=1)
    """Source of limit and rate."""


_LARGEST = 1e250
"""Largest value of a shaker, in SI units; products of several must not overflow."""
HIGH_Z: Literal["high-z"] = "high-z"
SOURCE_OHM = 50.0
"""Output impedance of a function generator."""


Options = dict[str, str | int | float]
"""Settings of a plug-in; only the plug-in checks them."""


class GeneratorConfig(FrozenModel):
    """The function generator and the load on its output."""

    driver: str = "afg1022x"
    """Name of an entry point of ``vibench.generators``."""
    resource: str = Field(default="", pattern=r"^$|^(USB|TCPIP|GPIB|ASRL).*::(INSTR|SOCKET)$")
    """VISA resource name; empty for a generator without VISA."""
    options: Options = Field(default_factory=dict)
    """Further settings of the driver; the shipped drivers have none."""
    visa_library: str = "@py"
    """``"@py"`` for pyvisa-py, empty for the system's VISA."""
    channel: Literal[1, 2] = 1
    load_ohm: Literal["high-z"] | PositiveFloat = HIGH_Z
    """Load set at the generator; its display shows volts into this load."""
    connected_ohm: PositiveFloat
    """Connected input impedance: the amplifier's [ohm]."""
    amplitude_limit_vpp: PositiveFloat
    """Largest allowed setting, peak to peak [V]."""
    settle_s: NonNegativeFloat = 0.0
    """Pause that the instrument needs after each command [s]."""
    dead_man_s: float | None = Field(default=None, ge=0.2, le=60.0)
    """Length of bursts [s]: a sine plays as bursts that the run must trigger, so the drive ends with a
    burst if this computer hangs. docs/safety.md describes the effect on the signal."""

    @model_validator(mode="after")
    def _has_bursts(self) -> Self:
        if self.dead_man_s is not None and self.channel != 1:
            raise ValueError(
                "dead_man_s needs bursts, which only channel 1 has; use channel 1, or leave dead_man_s out"
            )
        return self

    @property
    def shown_fraction(self) -> float:
        """Displayed voltage for the declared load, relative to the open-circuit voltage."""
        ohm = inf if self.load_ohm == HIGH_Z else self.load_ohm
        return 1.0 if ohm == inf else ohm / (ohm + SOURCE_OHM)

    def terminal_factor(self) -> float:
        """Return volts at the terminal per displayed volt: 2 for a setting of 50 ohm without a load."""
        return self.connected_ohm / (self.connected_ohm + SOURCE_OHM) / self.shown_fraction


class AmplifierConfig(FrozenModel):
    """The power amplifier. Its settings cannot be read: the operator confirms them."""

    model: str
    serial: str = ""
    gain_db: float = Field(ge=-60, le=60)
    """Voltage gain at the position of the knob [dB]."""
    clip_v: PositiveFloat
    """Largest output voltage, peak [V]."""
    current_limit_a: Sourced
    """Setting of the current limiter, rms [A]."""
    low_cut_hz: NonNegativeFloat = 0.0
    """Lower -3 dB frequency, first order [Hz]; 0 for a direct-coupled amplifier."""
    high_cut_hz: PositiveFloat
    """Upper -3 dB frequency, first order [Hz]."""

    @model_validator(mode="after")
    def _has_a_band(self) -> Self:
        if self.low_cut_hz < self.high_cut_hz:
            return self
        raise ValueError(
            f"low_cut_hz = {self.low_cut_hz:g} must lie below high_cut_hz = {self.high_cut_hz:g}; correct one"
        )

    @property
    def gain(self) -> float:
        """Output volts per input volt."""
        return float(10 ** (self.gain_db / 20))


class ShakerLimits(FrozenModel):
    """Limits of the shaker; all are peak values of a sine."""

    stroke_m: Sourced
    velocity_m_per_s: Sourced
    acceleration_m_per_s2: Sourced
    force_n: Sourced
    current_a: Sourced


class ShakerConfig(FrozenModel):
    """An electrodynamic shaker as a coil and a suspended mass, with its fixture."""

    model: str
    serial: str = ""
    moving_mass_kg: PositiveFloat
    fixture_mass_kg: NonNegativeFloat
    """All rigid masses on the table except the specimen [kg]."""
    suspension_stiffness_n_per_m: PositiveFloat
    suspension_damping_ns_per_m: PositiveFloat
    force_constant_n_per_a: PositiveFloat
    coil_resistance_ohm: PositiveFloat
    """Coil and cable [ohm]."""
    coil_inductance_h: PositiveFloat
    source: str = Field(min_length=1)
    limits: ShakerLimits

    @model_validator(mode="after")
    def _can_be_computed_with(self) -> Self:
        for name, value in self.model_dump().items():
            if isinstance(value, float) and value > _LARGEST:
                raise ValueError(f"{name} = {value:g} is too large to be computed with; correct it")
        return self


class ChannelConfig(FrozenModel):
    """One input of the converter."""

    role: Role
    physical: str
    """Name on the device: ``"ai0"``."""
    range_v: PositiveFloat
    coupling: Literal["AC", "DC"]
    terminal: Literal["default", "pseudo_differential", "differential", "single_ended"] = "default"
    iepe_current_a: NonNegativeFloat = 0.0
    attenuation: PositiveFloat = 1.0
    """Voltage divider in front of the input: volts at the source per volt at the input."""
    sensor: str | None = None
    """Name of an entry point of ``vibench.sensors``; absent: the default of the role."""
    options: Options = Field(default_factory=dict)
    """Further settings of the sensor."""
    calibrated: date
    """Date of the converter's last calibration."""
    uncertainty: StatedUncertainty | None = None
    """Uncertainty of the voltage, divider included; absent: not stated."""


class DaqConfig(FrozenModel):
    """The converter."""

    driver: str = "daqmx"
    """Name of an entry point of ``vibench.digitizers``; also of ``vibench.outputs`` for an output."""
    options: Options = Field(default_factory=dict)
    """Further settings of the driver."""
    product: str
    device: str
    """Device name in the driver: ``"cDAQ1Mod1"``."""
    server: str | None = None
    """Address of a gRPC device server, ``"host:port"``; absent: a converter on this computer."""
    sample_rate_hz: PositiveFloat
    """Requested rate; the actual rate is read back and stored as well."""
    buffer_s: PositiveFloat = 10.0
    clock_ppm: Sourced | None = None
    """Largest error of the sample clock [parts per million]; absent: not stated."""
    channels: tuple[ChannelConfig, ...] = Field(min_length=1)
    output: OutputConfig | None = None
    """Analogue output for streamed noise; optional."""

    @property
    def output_channel(self) -> str | None:
        """Full name of the analogue output: ``"Dev1/ao0"``; None if there is none."""
        if self.output is None:
            return None
        return f"{self.output.device or self.device}/{self.output.physical}"

    @model_validator(mode="after")
    def _channels_differ(self) -> Self:
        for what, values in (
            ("role", [channel.role.value for channel in self.channels]),
            ("physical", [channel.physical for channel in self.channels]),
        ):
            twice = sorted({value for value in values if values.count(value) > 1})
            if twice:
                raise ValueError(f"{what} {', '.join(twice)} is given twice: every channel needs its own")
        return self


class SpecimenConfig(SpecimenTable):
    """The specimen on the shaker: a named one, and the values that differ from it."""

    amplitude_limit_m: Sourced
    """Largest displacement of a mass that the springs survive."""


class LoopInput(StrEnum):
    """Channels that a controller samples, in the order of its inputs."""

    BASE = "base_acceleration"
    M0 = "m0_velocity"


class ControllerConfig(FrozenModel):
    """A real-time controller: sensors of base and m0 at its inputs, its output at the amplifier's input.

    While it plays, its output replaces the generator's.
    """

    driver: str = "lines"
    """Name of an entry point of ``vibench.controllers``."""
    resource: str = Field(default="", pattern=r"^$|^TCPIP.*::SOCKET$")
    """VISA resource name of its socket; empty on a virtual rig."""
    visa_library: str = "@py"
    """``"@py"`` for pyvisa-py, empty for the system's VISA."""
    options: Options = Field(default_factory=dict)
    """Further settings of the driver."""
    rate_hz: float = Field(ge=1_000, le=25_600)
    """Samples per second; 1 to 20 kHz are usual."""
    latency_s: float = Field(ge=0, le=5e-3)
    """Measured time from a sample to the resulting voltage [s]."""
    limit_v: PositiveFloat
    """Largest output, peak [V]."""
    watchdog_s: float = Field(default=1.0, ge=0.3, le=10.0)
    """Time without a message after which it ramps down by itself [s]."""
    pd_of: LoopInput | None = None
    """Only input of a law that is limited to proportional and derivative parts; absent: any linear law."""
    source: str = Field(min_length=1)
    """Source of rate, latency and limit."""

    @property
    def loop_time_s(self) -> float:
        """Time from a motion to the resulting drive [s]."""
        # Averaging over a sample delays by half a sample, and holding the voltage by one.
        return self.latency_s + 1.5 / self.rate_hz


class Rig(FrozenModel):
    """A whole bench, from its configuration file."""

    name: str = Field(min_length=1)
    generator: GeneratorConfig
    amplifier: AmplifierConfig
    shaker: ShakerConfig
    vibrometer: VibrometerConfig | None = None
    """Sensor of the channel ``m0_velocity``, in a scan of another mass; absent if another sensor shows m0."""
    accelerometer: AccelerometerConfig
    """Sensor of the channel ``base_acceleration``."""
    sensors: dict[Role, TransducerConfig] = Field(default_factory=dict)
    """Sensors of all other channels, by role."""
    daq: DaqConfig
    specimen: SpecimenConfig
    controller: ControllerConfig | None = None
    """Real-time controller that can replace the generator; optional."""
    calibration_valid_days: PositiveInt = 730
    check_valid_h: PositiveFloat = 12.0
    """Time after a passed bench check during which the bench can be armed [h]."""
    virtual: VirtualConfig | None = None
    """Present if all instruments are simulated."""

    @model_validator(mode="after")
    def _has_sensors(self) -> Self:
        for role, sensor in self.sensors.items():
            if role.quantity == "voltage":
                raise ValueError(f"sensors.{role}: a voltage comes by wire; leave the table out")
            if sensor_table(role) != f"sensors.{role}":
                raise ValueError(f"sensors.{role}: describe it in the table [{sensor_table(role)}]")
            try:
                sensor.units_per_volt(role.unit)
            except ValueError as error:
                raise ValueError(f"sensors.{role}.sensitivity: {error}") from error
        for channel in self.daq.channels:
            role = channel.role
            is_described = role.quantity == "voltage" or self.sensor(role) is not None
            if not is_described and (channel.sensor is None or self.virtual is not None):
                raise ValueError(
                    f"the channel {role} has no sensor; add the table [{sensor_table(role)}] "
                    "(docs/sensor-units.md)"
                )
        if self.controller is not None and self.vibrometer is None:
            raise ValueError("a controller samples the velocity of m0; add the table [vibrometer]")
        return self

    def sensor(self, role: Role) -> SensorConfig | None:
        """Return the sensor of a channel; None for a voltage, or if none is described."""
        described = {Role.BASE_ACCELERATION: self.accelerometer, Role.M0_VELOCITY: self.vibrometer}
        is_scanned = role in SCANNED_ROLES and Role.M0_VELOCITY not in self._roles
        return described.get(role, self.sensors.get(role, self.vibrometer if is_scanned else None))

    def aimed(self, role: Role) -> Self:
        """Return the rig with the vibrometer's beam on the mass of ``role``, such as ``m2_velocity``.

        Raises ConfigurationError when no channel records the vibrometer, or another one records that mass.
        """
        if Role.M0_VELOCITY not in self._roles:
            raise ConfigurationError(
                f"a scan moves the vibrometer, and the rig {self.name!r} has no channel m0_velocity. Nothing "
                "was played; add it to daq.channels, or leave the scan out"
            )
        if role is not Role.M0_VELOCITY and role in self._roles:
            raise ConfigurationError(
                f"the scan has a point on {role.place}, and the rig {self.name!r} records {role.value} with "
                "another sensor. Nothing was played; leave out that point or that channel"
            )
        channels = tuple(
            each.model_copy(update={"role": role}) if each.role is Role.M0_VELOCITY else each
            for each in self.daq.channels
        )
        return self.model_copy(update={"daq": self.daq.model_copy(update={"channels": channels})})

    @property
    def _roles(self) -> tuple[Role, ...]:
        return tuple(channel.role for channel in self.daq.channels)

    @property
    def response(self) -> Role | None:
        """Channel that shows the motion of m0, the first of RESPONSE_ROLES; None if there is none."""
        return next((role for role in RESPONSE_ROLES if role in self._roles), None)

    @model_validator(mode="after")
    def _grid_carries_the_sample_rate(self) -> Self:
        fastest_hz = None if self.virtual is None else fastest_sample_rate_hz(self.virtual.grid_rate_hz)
        if self.virtual is None or fastest_hz is None or self.daq.sample_rate_hz <= fastest_hz:
            return self
        raise ValueError(
            f"virtual.grid_rate_hz = {self.virtual.grid_rate_hz:g} carries {fastest_hz:g} samples a second "
            f"at most, and daq.sample_rate_hz is {self.daq.sample_rate_hz:g}; lower that, or "
            "make the grid finer"
        )

    @model_validator(mode="after")
    def _grid_carries_the_controller(self) -> Self:
        if self.virtual is None or self.controller is None:
            return self
        steps = self.virtual.grid_rate_hz / self.controller.rate_hz
        if steps == round(steps):
            return self
        raise ValueError(
            f"controller.rate_hz = {self.controller.rate_hz:g} takes {steps:.4g} of the "
            f"{self.virtual.grid_rate_hz:g} steps a second of the virtual rig from sample to sample; give a "
            f"rate that takes a whole number of them, {self.virtual.grid_rate_hz / max(round(steps), 1):g} "
            "for example"
        )

    @property
    def plays_back(self) -> bool:
        """Whether a recording replaces the instruments."""
        return self.daq.driver == "file"

    @property
    def knobs(self) -> tuple[Knob, ...]:
        """All manual settings."""
        amplifier, vibrometer = self.amplifier, self.vibrometer
        knobs = (
            Knob(instrument=amplifier.model, setting="gain", value=f"{amplifier.gain_db:g} dB"),
            Knob(
                instrument=amplifier.model,
                setting="current limit",
                value=f"{amplifier.current_limit_a.value:g} A rms",
            ),
        )
        if vibrometer is None:
            return knobs
        return (
            *knobs,
            Knob(
                instrument=vibrometer.model,
                setting="velocity range",
                value=f"{vibrometer.range_mm_per_s_per_v:g} mm/s/V",
            ),
            Knob(instrument=vibrometer.model, setting="tracking filter", value=vibrometer.tracking_filter),
        )
