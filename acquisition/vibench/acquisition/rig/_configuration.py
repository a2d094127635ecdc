"""Hardware configuration: the chain from generator to converter, with limits and manual settings."""

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
"""Environment variable for the token; on a command line, other users could see the token."""


def token_from_env() -> str:
    """Return the token from the environment; empty if no token is set."""
    return os.environ.get(TOKEN_VARIABLE, "")


USUAL_GRID_RATE_HZ = 102_400.0
"""Default number of computed time steps per second on the virtual rig (its grid)."""
COARSEST_GRID_RATE_HZ = 12_800.0
"""Smallest number of time steps per second; the base motion at `WATCHED_HZ` is then 0.8 % too small."""
WATCHED_HZ = 500.0
"""Frequency at which a grid's error is judged: highest specimen resonance and end of the paper's range."""
_MEASURED = 0.55
"""Factor in `level_error`, from a comparison with 409,600 time steps per second, at 60 Hz to 1 kHz."""
LARGEST_LEVEL_ERROR = 0.01
"""Largest allowed level error of a plan on a grid coarser than the default."""
STEPS_PER_SAMPLE = 2
"""Smallest number of time steps per sample on a coarse grid, for the converter filter's transition band."""


class VirtualConfig(FrozenModel):
    """Properties that a configuration needs only for a virtual rig."""

    seed: int = Field(ge=0)
    pace: Literal["free", "wall"] = "free"
    """Pace of rig time: ``"free"`` is as fast as possible, ``"wall"`` is ``speed`` times real time."""
    speed: PositiveFloat = 1.0
    grid_rate_hz: float = USUAL_GRID_RATE_HZ
    """Number of computed steps per second: 12,800 to 102,400, and at least twice the sample rate. Fewer steps
    are faster but less accurate (docs/decisions/0006-virtual-rig.md)."""
    generator_clock_ppm: float = Field(ge=-200, le=200)
    converter_clock_ppm: float = Field(ge=-200, le=200)
    generator_noise_v: NonNegativeFloat
    """White noise at the terminal while the output is on, rms in the band 0 to 25.6 kHz [V]."""
    amplifier_noise_v: NonNegativeFloat
    """White noise at the amplifier's output, rms in the band 0 to 25.6 kHz [V]."""
    accelerometer_noise_m_per_s2: NonNegativeFloat
    """White noise of the accelerometer, rms in the band 0 to 25.6 kHz [m/s2]."""
    vibrometer_noise_m_per_s_per_rthz: NonNegativeFloat
    vibrometer_dropouts_per_s: NonNegativeFloat
    faults: str | None = None
    """Path of a fault script, relative to the folder of this file; see docs/campaigns.md."""
    converter_noise_v: NonNegativeFloat
    """Rms noise of each converter input, the same at any sample rate [V]."""

    @field_validator("grid_rate_hz")
    @classmethod
    def _is_fine_enough(cls, rate_hz: float) -> float:
        if not COARSEST_GRID_RATE_HZ <= rate_hz <= USUAL_GRID_RATE_HZ:
            raise ValueError(
                f"the virtual rig needs {COARSEST_GRID_RATE_HZ:g} to {USUAL_GRID_RATE_HZ:g} steps a second: "
                f"with fewer, the base motion would be more than "
                f"{level_error(WATCHED_HZ, COARSEST_GRID_RATE_HZ):.1%} too small at {WATCHED_HZ:g} Hz; give "
                "a rate in this range, or leave the rate out"
            )
        return rate_hz


def level_error(frequency_hz: float, grid_rate_hz: float) -> float:
    """Return the largest relative amount by which the base motion of a sine is too small.

    Averaging and holding the drive over a step h contribute (pi f h)^2 / 3. The remaining part comes from the
    extrapolation of the specimen's force on the table over the step. The specimen's response is exact.
    """
    return _MEASURED * (pi * frequency_hz / grid_rate_hz) ** 2


def highest_carried_hz(grid_rate_hz: float) -> float | None:
    """Return the highest frequency with correct levels on a grid [Hz]; None (no limit) for the default."""
    if grid_rate_hz >= USUAL_GRID_RATE_HZ:
        return None
    return grid_rate_hz / pi * sqrt(LARGEST_LEVEL_ERROR / _MEASURED)


def fastest_sample_rate_hz(grid_rate_hz: float) -> float | None:
    """Return the highest sample rate on a time grid [samples/s]; None (no limit) for the default."""
    return None if grid_rate_hz >= USUAL_GRID_RATE_HZ else grid_rate_hz / STEPS_PER_SAMPLE


class OutputUse(StrEnum):
    """Excitations that an analogue output plays; the function generator plays all other excitations."""

    STREAMS = "streams"
    """Only signals that do not fit into a generator's memory, because they do not repeat."""
    TONES_AND_STREAMS = "tones_and_streams"
    """Also sines (dwells, steps and sweeps), for a bench with a permanently connected output."""


class OutputConfig(FrozenModel):
    """An analogue output that drives the amplifier with signals too long for a function generator.

    The output plays the voltage that a generator's terminal has at the same setting, so ``amplitude_vpp`` has
    the same meaning for output and generator. Connect only the output or the generator to the amplifier: even
    at 0 V, an output of 50 ohm in parallel would halve the generator's voltage. The check at low level before
    every run detects a wrong connection.
    """

    physical: str = Field(pattern=r"^ao\d+$")
    """Name of the output on the device: ``"ao0"``."""
    plays: OutputUse = OutputUse.STREAMS
    device: str | None = None
    """Device name of the output's module, if it differs from the device name of the converter. Both devices
    must be able to share a start trigger, as modules in one chassis can."""
    limit_v: PositiveFloat = Field(le=10.0)
    """Largest allowed magnitude of the output voltage [V]."""
    sample_rate_hz: PositiveFloat
    """Sample rate of the output, which the hardware must support exactly [samples/s]."""
    # At least three blocks of a run: one is being played, one is ready, and one is being written.
    ahead_s: float = Field(default=0.5, ge=0.3, le=5.0)
    """Duration of the samples written in advance [s]. This is also the longest tolerated pause of this
    computer, and the delay of an early ramp down."""
    source: str = Field(min_length=1)
    """Source of the values ``limit_v`` and ``sample_rate_hz``."""


_LARGEST = 1e250
"""Largest value of a shaker parameter, in SI units; products of several parameters must not overflow."""
HIGH_Z: Literal["high-z"] = "high-z"
SOURCE_OHM = 50.0
"""Output impedance of a function generator [ohm]."""


Options = dict[str, str | int | float]
"""Settings of a plug-in, which only the plug-in checks."""


class GeneratorConfig(FrozenModel):
    """The function generator and the load on its output."""

    driver: str = "afg1022x"
    """Name of the driver: an entry point of ``vibench.generators``."""
    resource: str = Field(default="", pattern=r"^$|^(USB|TCPIP|GPIB|ASRL).*::(INSTR|SOCKET)$")
    """VISA resource name; empty for a generator without VISA."""
    options: Options = Field(default_factory=dict)
    """Further settings of the driver; the drivers of this package have no further settings."""
    visa_library: str = "@py"
    """VISA library: ``"@py"`` for pyvisa-py, empty for the system's VISA."""
    channel: Literal[1, 2] = 1
    load_ohm: Literal["high-z"] | PositiveFloat = HIGH_Z
    """Load setting of the generator [ohm]; its display shows the voltage for this load."""
    connected_ohm: PositiveFloat
    """Impedance connected to the output: the input impedance of the amplifier [ohm]."""
    amplitude_limit_vpp: PositiveFloat
    """Largest allowed amplitude setting, peak to peak [V]."""
    settle_s: NonNegativeFloat = 0.0
    """Pause that the generator needs after each command [s]."""
    dead_man_s: float | None = Field(default=None, ge=0.2, le=60.0)
    """Length of a burst [s]. A sine is played in bursts that the run must trigger; if this computer hangs,
    the drive ends with the burst. docs/safety.md describes the effect on the signal."""

    @model_validator(mode="after")
    def _has_bursts(self) -> Self:
        if self.dead_man_s is not None and self.channel != 1:
            raise ValueError(
                "dead_man_s needs bursts, which only channel 1 has; use channel 1, or leave dead_man_s out"
            )
        return self

    @property
    def shown_fraction(self) -> float:
        """Ratio of displayed voltage to open-circuit voltage, from the load setting."""
        ohm = inf if self.load_ohm == HIGH_Z else self.load_ohm
        return 1.0 if ohm == inf else ohm / (ohm + SOURCE_OHM)

    def terminal_factor(self) -> float:
        """Return the terminal voltage per displayed volt: 2 for a load setting of 50 ohm without a load."""
        return self.connected_ohm / (self.connected_ohm + SOURCE_OHM) / self.shown_fraction


class AmplifierConfig(FrozenModel):
    """The power amplifier. Its settings cannot be read back, so the operator confirms the settings."""

    model: str
    serial: str = ""
    gain_db: float = Field(ge=-60, le=60)
    """Voltage gain of the amplifier at the present position of its knob [dB]."""
    clip_v: PositiveFloat
    """Largest output voltage of the amplifier, peak [V]."""
    current_limit_a: Sourced
    """Setting of the amplifier's current limiter, rms [A]."""
    low_cut_hz: NonNegativeFloat = 0.0
    """Lower -3 dB frequency, first order [Hz]; 0 for a direct-coupled amplifier."""
    high_cut_hz: PositiveFloat
    """Upper -3 dB frequency of the amplifier, first order [Hz]."""

    @model_validator(mode="after")
    def _has_a_band(self) -> Self:
        if self.low_cut_hz < self.high_cut_hz:
            return self
        raise ValueError(
            f"low_cut_hz = {self.low_cut_hz:g} must be below high_cut_hz = {self.high_cut_hz:g}; correct them"
        )

    @property
    def gain(self) -> float:
        """Voltage gain: output voltage per input voltage [V/V]."""
        return float(10 ** (self.gain_db / 20))


class ShakerLimits(FrozenModel):
    """Limits of the shaker, as peak values of a sine."""

    stroke_m: Sourced
    velocity_m_per_s: Sourced
    acceleration_m_per_s2: Sourced
    force_n: Sourced
    current_a: Sourced


class ShakerConfig(FrozenModel):
    """An electrodynamic shaker with its fixture, modelled as a coil and a suspended mass."""

    model: str
    serial: str = ""
    moving_mass_kg: PositiveFloat
    fixture_mass_kg: NonNegativeFloat
    """Total rigid mass on the table, without the specimen [kg]."""
    suspension_stiffness_n_per_m: PositiveFloat
    suspension_damping_ns_per_m: PositiveFloat
    force_constant_n_per_a: PositiveFloat
    coil_resistance_ohm: PositiveFloat
    """Resistance of coil and cable [ohm]."""
    coil_inductance_h: PositiveFloat
    source: str = Field(min_length=1)
    limits: ShakerLimits

    @model_validator(mode="after")
    def _can_be_computed_with(self) -> Self:
        for name, value in self.model_dump().items():
            if isinstance(value, float) and value > _LARGEST:
                raise ValueError(f"{name} = {value:g} is too large to compute with; correct this value")
        return self


class ChannelConfig(FrozenModel):
    """One input of the converter."""

    role: Role
    physical: str
    """Name of the input on the device: ``"ai0"``."""
    range_v: PositiveFloat
    coupling: Literal["AC", "DC"]
    terminal: Literal["default", "pseudo_differential", "differential", "single_ended"] = "default"
    iepe_current_a: NonNegativeFloat = 0.0
    attenuation: PositiveFloat = 1.0
    """Voltage divider in front of the input: source voltage per input voltage [V/V]."""
    sensor: str | None = None
    """Name of an entry point of ``vibench.sensors``; if absent, the default of the channel's role."""
    options: Options = Field(default_factory=dict)
    """Further settings of the sensor's plug-in."""
    calibrated: date
    """Date of the converter's last calibration."""
    uncertainty: StatedUncertainty | None = None
    """Uncertainty of the voltage, including the divider; absent if not stated."""


class DaqConfig(FrozenModel):
    """The analogue-to-digital converter with its channels."""

    driver: str = "daqmx"
    """Name of an entry point of ``vibench.digitizers``, and of ``vibench.outputs`` for an output."""
    options: Options = Field(default_factory=dict)
    """Further settings of the converter's driver."""
    product: str
    device: str
    """Name of the device in its driver: ``"cDAQ1Mod1"``."""
    server: str | None = None
    """Address of a gRPC device server, ``"host:port"``; if absent, the converter is on this computer."""
    sample_rate_hz: PositiveFloat
    """Requested sample rate [samples/s]; the actual rate is read back and stored too."""
    buffer_s: PositiveFloat = 10.0
    clock_ppm: Sourced | None = None
    """Largest error of the sample clock [parts per million]; absent if not stated."""
    channels: tuple[ChannelConfig, ...] = Field(min_length=1)
    output: OutputConfig | None = None
    """Analogue output that plays streamed noise; optional."""

    @property
    def output_channel(self) -> str | None:
        """Full name of the analogue output: ``"Dev1/ao0"``; None if the rig has no output."""
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
                raise ValueError(f"{what} {', '.join(twice)} is given twice; channels must differ in {what}")
        return self


class SpecimenConfig(SpecimenTable):
    """The specimen on the shaker: a named specimen, and the values that differ from the named specimen."""

    amplitude_limit_m: Sourced
    """Largest displacement of any mass without damage to the springs [m]."""


class LoopInput(StrEnum):
    """Channels that a real-time controller samples, in the order of the controller's inputs."""

    BASE = "base_acceleration"
    M0 = "m0_velocity"


class ControllerConfig(FrozenModel):
    """A real-time controller with base and m0 sensors at its inputs and the amplifier at its output.

    While the controller plays, its output replaces the output of the generator.
    """

    driver: str = "lines"
    """Name of the driver: an entry point of ``vibench.controllers``."""
    resource: str = Field(default="", pattern=r"^$|^TCPIP.*::SOCKET$")
    """VISA resource name of the controller's socket; empty on a virtual rig."""
    visa_library: str = "@py"
    """VISA library: ``"@py"`` for pyvisa-py, empty for the system's VISA."""
    options: Options = Field(default_factory=dict)
    """Further settings of the controller's driver."""
    rate_hz: float = Field(ge=1_000, le=25_600)
    """Sample rate of the controller [samples/s]; 1 to 20 kHz are usual."""
    latency_s: float = Field(ge=0, le=5e-3)
    """Measured time from a sample to the resulting voltage [s]."""
    limit_v: PositiveFloat
    """Largest output voltage of the controller, peak [V]."""
    watchdog_s: float = Field(default=1.0, ge=0.3, le=10.0)
    """Time without a message after which the controller ramps down by itself [s]."""
    pd_of: LoopInput | None = None
    """The only input of a proportional-derivative law; absent if the controller accepts any linear law."""
    source: str = Field(min_length=1)
    """Source of the values for sample rate, latency and limit."""

    @property
    def loop_time_s(self) -> float:
        """Total delay from a motion to the resulting drive voltage [s]."""
        # Averaging over a sample adds a delay of half a sample; holding the voltage adds one sample.
        return self.latency_s + 1.5 / self.rate_hz


class Rig(FrozenModel):
    """A whole bench, as described by its configuration file."""

    name: str = Field(min_length=1)
    generator: GeneratorConfig
    amplifier: AmplifierConfig
    shaker: ShakerConfig
    vibrometer: VibrometerConfig | None = None
    """Sensor of ``m0_velocity``, or of another mass during a scan; absent if another sensor measures m0."""
    accelerometer: AccelerometerConfig
    """Sensor of the channel ``base_acceleration``, on the base."""
    sensors: dict[Role, TransducerConfig] = Field(default_factory=dict)
    """Sensors of all other channels, by role."""
    daq: DaqConfig
    specimen: SpecimenConfig
    controller: ControllerConfig | None = None
    """Real-time controller that can replace the generator; optional."""
    calibration_valid_days: PositiveInt = 730
    check_valid_h: PositiveFloat = 12.0
    """Time after a passed bench check during which the bench may be armed [h]."""
    virtual: VirtualConfig | None = None
    """Settings of a virtual rig, whose instruments are all simulated; absent for a real rig."""

    @model_validator(mode="after")
    def _has_sensors(self) -> Self:
        for role, sensor in self.sensors.items():
            if role.quantity == "voltage":
                raise ValueError(f"sensors.{role}: a voltage channel has no sensor; remove the table")
            if sensor_table(role) != f"sensors.{role}":
                raise ValueError(f"sensors.{role}: describe this sensor in the table [{sensor_table(role)}]")
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
        """Return the sensor of a channel; None for a voltage, and if no sensor is described."""
        described = {Role.BASE_ACCELERATION: self.accelerometer, Role.M0_VELOCITY: self.vibrometer}
        is_scanned = role in SCANNED_ROLES and Role.M0_VELOCITY not in self._roles
        return described.get(role, self.sensors.get(role, self.vibrometer if is_scanned else None))

    def with_beam_on(self, role: Role) -> Self:
        """Return the rig with the vibrometer's beam on the mass of ``role``, such as ``m2_velocity``.

        Raises ConfigurationError when no channel records the vibrometer or another sensor measures that mass.
        """
        if Role.M0_VELOCITY not in self._roles:
            raise ConfigurationError(
                f"a scan needs the vibrometer, but the rig {self.name!r} has no channel m0_velocity. Nothing "
                "was played; add this channel to daq.channels, or leave the scan out"
            )
        if role is not Role.M0_VELOCITY and role in self._roles:
            raise ConfigurationError(
                f"the scan has a point on {role.place}, but the rig {self.name!r} records {role.value} with "
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
        """Channel that measures the motion of m0: the first of RESPONSE_ROLES on this rig, or None."""
        return next((role for role in RESPONSE_ROLES if role in self._roles), None)

    @model_validator(mode="after")
    def _grid_carries_the_sample_rate(self) -> Self:
        fastest_hz = None if self.virtual is None else fastest_sample_rate_hz(self.virtual.grid_rate_hz)
        if self.virtual is None or fastest_hz is None or self.daq.sample_rate_hz <= fastest_hz:
            return self
        raise ValueError(
            f"virtual.grid_rate_hz = {self.virtual.grid_rate_hz:g} allows at most {fastest_hz:g} samples a "
            f"second, but daq.sample_rate_hz is {self.daq.sample_rate_hz:g}; lower daq.sample_rate_hz, or "
            "raise virtual.grid_rate_hz"
        )

    @model_validator(mode="after")
    def _grid_carries_the_controller(self) -> Self:
        if self.virtual is None or self.controller is None:
            return self
        steps = self.virtual.grid_rate_hz / self.controller.rate_hz
        if steps == round(steps):
            return self
        raise ValueError(
            f"controller.rate_hz = {self.controller.rate_hz:g} would take {steps:.4g} steps of the virtual "
            f"rig ({self.virtual.grid_rate_hz:g} a second) between samples; give a rate with a whole "
            f"number of steps, for example {self.virtual.grid_rate_hz / max(round(steps), 1):g}"
        )

    @property
    def plays_back(self) -> bool:
        """Whether a recording is played back instead of using instruments."""
        return self.daq.driver == "file"

    @property
    def knobs(self) -> tuple[Knob, ...]:
        """All manual settings, which an operator must confirm."""
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
