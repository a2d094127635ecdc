"""The analogue world between the generator's terminal and the samples of the converter."""

import heapq
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import count
from typing import Protocol

import numpy as np

from vibench.acquisition import AcquisitionError, ConfigurationError
from vibench.acquisition.rig import (
    RESPONSE_ROLES,
    Rig,
    Role,
    VirtualConfig,
    amplifier_of,
    fastest_sample_rate_hz,
    shaker_of,
    specimen_of,
)
from vibench.sim import Specimen
from vibench.sim.shaker.loaded_shaker import MOTION_COLUMNS, LoadedShaker, MotionFailed, ShakenMotion

from .conversion import (
    OPEN_INPUT,
    SECOND_DEVICE,
    Conversion,
    ConverterInput,
    Input,
    InputStage,
    Signal,
    cables_of,
    history_steps,
    signal_rows,
)
from .sensors import (
    LONGEST_DELAY_S,
    Disturbance,
    MotionSensor,
    NoiseStream,
    RandomDropouts,
    SensorParts,
)
from .time_grid import PPM, USUAL_GRID, FloatArray, TimeGrid


class AnalogueOutput:
    """Analogue output with a queue of samples, played at their own rate; zero when the queue is empty.

    The mean voltage over each step is exact at any sample rate. The images of this zero-order hold are
    stronger than those of real converters with an interpolation filter.
    """

    def __init__(self, grid: TimeGrid = USUAL_GRID) -> None:
        self._grid = grid
        self._queue = np.empty(0)
        self._steps_per_sample = 1.0
        self._begin_step = 0.0
        """Start of the first queued sample in steps, including fractions."""

    def queue(self, volts: FloatArray, sample_rate_hz: float, now_step: int) -> None:
        """Append samples, which start now if no other samples are waiting to be played.

        If the rate differs, samples that are still to be played also change to the new rate.
        """
        left = self.queued_samples(now_step)
        if left == 0:
            self._queue = np.empty(0)
            self._begin_step = max(float(now_step), self._begin_step)
        steps_per_sample = self._grid.rate_hz / sample_rate_hz
        if left and steps_per_sample != self._steps_per_sample:
            self._begin_step = float(now_step)
        self._steps_per_sample = steps_per_sample
        self._queue = np.concatenate([self._queue, np.asarray(volts, dtype=np.float64)])

    def queued_samples(self, now_step: int) -> int:
        """Return the number of samples in the queue that have not been played completely."""
        ended = int(max(now_step - self._begin_step, 0.0) / self._steps_per_sample + _ROUNDING)
        return max(len(self._queue) - ended, 0)

    def drop(self) -> None:
        """Clear the queue of samples; the output returns to zero."""
        self._queue = np.empty(0)

    def render(self, first_step: int, steps: int) -> FloatArray:
        """Return the mean voltage over each of the next steps, shape (steps,), and discard played samples."""
        if not len(self._queue):
            return np.zeros(steps)
        edges = (first_step + np.arange(steps + 1) - self._begin_step) / self._steps_per_sample
        touched = self._queue[: max(int(np.ceil(edges[-1])), 0)]
        integral = np.concatenate([[0.0], np.cumsum(touched)])
        means = np.diff(np.interp(edges, np.arange(len(integral)), integral)) * self._steps_per_sample
        played = min(int(max(edges[-1], 0.0) + _ROUNDING), len(self._queue))
        self._queue = self._queue[played:]
        self._begin_step += played * self._steps_per_sample
        return np.asarray(means)


_ROUNDING = 1e-6
"""Tolerance that covers samples that end exactly at the end of a step [samples]."""


LOWEST_RATE_HZ = 500.0
"""Lowest sample rate of a conversion [Hz]; at this rate, its filter needs 0.1 s of history."""
HIGHEST_RATE_HZ = 250e3
"""Highest sample rate of a conversion [Hz]; samples at rates above the grid's rate are interpolated."""

_STRETCH_STEPS = 8192
"""Time steps per block: enough to make the cost of a call small, and few enough for the processor's cache."""


class TerminalVoltage(Protocol):
    """The generator's voltage at the amplifier's input."""

    def render(self, start_s: float, interval_s: float, count: int) -> FloatArray:
        """Return the mean terminal voltage over each of ``count`` intervals [V]; times must not decrease."""


class ClosedLoop(Protocol):
    """A simulated instrument that computes an amplifier voltage from its sensor samples."""

    @property
    def is_on(self) -> bool:
        """Whether the loop or its delayed output drives the amplifier; `move` is called only in this case."""

    def move(
        self,
        first: int,
        step_s: float,
        shaker: LoadedShaker,
        noise: FloatArray,
        sensors: tuple[SensorParts, SensorParts],
        motion: ShakenMotion,
        signals: FloatArray,
    ) -> int:
        """Advance the shaker from a step of the world with the loop closed; return the number of steps.

        ``noise`` is the amplifier's noise [V]; ``sensors`` describes the sensors of base and m0. On entry,
        ``signals`` contains the amplifier input from other sources; on return, all signals.
        """


class World:
    """The simulated rig; its time advances only on request.

    Rig time is counted by the converter's clock (see `TimeGrid`). Two worlds with the same configuration
    agree bit for bit, for any block sizes. The class is thread-safe. `time_s` takes no lock, so an instrument
    may read it while its output is rendered.
    """

    def __init__(
        self,
        rig: Rig,
        terminal: TerminalVoltage,
        specimen: Specimen | None = None,
        loop: ClosedLoop | None = None,
    ) -> None:
        """Create a world; ``specimen`` replaces the rig's specimen; ``loop`` is an additional controller."""
        virtual = virtual_section(rig)
        self._grid = grid = TimeGrid(virtual.grid_rate_hz)
        noise = partial(NoiseStream, virtual.seed)
        self._sensors = dict(_sensors_of(rig, virtual, grid))
        self._rows = signal_rows(rig)
        self._fixture_mass_kg = rig.shaker.fixture_mass_kg
        step_s = grid.physical_step_s(virtual.converter_clock_ppm)
        self._specimen = specimen or specimen_of(rig)
        self.plant = LoadedShaker(amplifier_of(rig), shaker_of(rig), self._specimen, step_s)
        self._terminal = terminal
        self.configured_gain_db = rig.amplifier.gain_db
        self._amplifier_noise = noise("amplifier")
        self._amplifier_noise_v = grid.rms_per_step(virtual.amplifier_noise_v)
        self._noise = noise
        self._converter_noise_v = virtual.converter_noise_v
        self._plan = cables_of(rig, {role: each.delay_steps for role, each in self._sensors.items()})
        self._cables = dict(self._plan)
        # At the amplifier's input, the voltage of this analogue output is added to the generator's voltage.
        self._amplifier_input = rig.daq.output_channel or f"{SECOND_DEVICE}/ao0"
        self._outputs: dict[str, AnalogueOutput] = {}
        self._loop = loop
        self._conversions: list[Conversion] = []
        slowest = history_steps(grid.rate_hz / LOWEST_RATE_HZ, LONGEST_DELAY_S * grid.rate_hz)
        self._history = np.zeros((len(self._rows), slowest + 2))
        self._due: list[tuple[int, int, Callable[[], None]]] = []
        """Scheduled actions with the step at which each is due; actions at one step keep their order."""
        self._scheduled = count()
        self._step = 0
        self._unspent_steps = 0.0
        self._last_end = np.zeros((1, len(MOTION_COLUMNS)))
        self._beam = Role.M0_VELOCITY
        self._truth: list[FloatArray] | None = None
        self._turn = threading.RLock()

    @property
    def time_s(self) -> float:
        """Rig time that the world has simulated so far [s]."""
        return self._step * self._grid.step_s

    def advance(self, duration_s: float) -> None:
        """Advance rig time; fractions of a step are carried over to the next call."""
        with self._turn:
            wanted = self._unspent_steps + duration_s * self._grid.rate_hz
            steps = max(round(wanted), 0)
            self._unspent_steps = wanted - steps
            self._compute_to(self._step + steps)

    def at(self, time_s: float, action: Callable[[], None]) -> None:
        """Schedule an action at a rig time, rounded to steps; for a past time, the next step is used."""
        with self._turn:
            heapq.heappush(self._due, (self._grid.step_at(time_s), next(self._scheduled), action))

    def sample(self, inputs: tuple[Input, ...], sample_rate_hz: float) -> Conversion:
        """Start a conversion now.

        Rates from 500 Hz to 250 kHz are possible, or up to half the rate of a coarser grid; integer fractions
        of the grid's rate are faster. All inputs share the delay of a delta-sigma converter: 40 samples, or
        40 grid steps if these are longer. Raises ConfigurationError for other rates.
        """
        fastest_hz = fastest_sample_rate_hz(self._grid.rate_hz) or HIGHEST_RATE_HZ
        if not LOWEST_RATE_HZ <= sample_rate_hz <= fastest_hz:
            raise ConfigurationError(
                f"A sample rate of {sample_rate_hz:g} Hz is not possible on this virtual rig, which takes "
                f"{self._grid.rate_hz:g} steps a second; nothing was started. Choose a rate from "
                f"{LOWEST_RATE_HZ:g} to {fastest_hz:g} Hz"
            )
        with self._turn:
            ratio = self._grid.rate_hz / sample_rate_hz
            ratio = round(ratio) if abs(ratio - round(ratio)) < PPM else ratio
            channels = tuple(
                ConverterInput(
                    InputStage(configured, self._cables, self._grid),
                    ratio,
                    self._step,
                    self._history,
                    self._converter_noise_v,
                    self._noise(f"{configured.physical_channel} from step {self._step}"),
                )
                for configured in inputs
            )
            conversion = Conversion(channels, ratio, self._step, self._compute_to, self._end)
            self._conversions.append(conversion)
            return conversion

    def play(self, physical_channel: str, volts: FloatArray, sample_rate_hz: float) -> None:
        """Append samples to the queue of an analogue output; an idle output starts now."""
        with self._turn:
            self._output(physical_channel).queue(volts, sample_rate_hz, self._step)

    def silence(self, physical_channel: str) -> None:
        """Clear the output's queue of samples and hold the output at zero."""
        with self._turn:
            self._output(physical_channel).drop()

    def set_amplifier_gain_db(self, gain_db: float) -> None:
        """Set the amplifier's voltage gain [dB]."""
        with self._turn:
            self.plant.gain = 10 ** (gain_db / 20)

    def widen_gaps(self, by_m: float) -> None:
        """Set both gaps of the stops to their initial size plus ``by_m`` [m]."""
        began = self._specimen
        lower, upper = began.gaps_m
        with self._turn:
            self.plant.change_specimen(replace(began, gap_m=upper + by_m, lower_gap_m=lower + by_m))

    def aim(self, role: Role) -> None:
        """Move the vibrometer's beam to the mass of ``role``, whose velocity replaces the velocity of m0."""
        with self._turn:
            self._beam = role
            self._compute_to(self._step + 1)  # a step's mean velocity also needs the state before the step

    def disturb_response(self, duration_s: float, level: float) -> None:
        """Hold the output of the m0 sensor at ``level`` (fraction of full scale) for a while."""
        with self._turn:
            stop = self._step + self._grid.step_at(duration_s)
            for role in RESPONSE_ROLES:
                if role in self._sensors:
                    self._sensors[role].disturb(Disturbance(self._step, stop, level))

    def connect(self, physical_channel: str) -> None:
        """Connect an input of the converter as the rig's configuration describes."""
        with self._turn:
            self._cables[physical_channel] = self._plan.get(physical_channel, OPEN_INPUT)

    def disconnect(self, physical_channel: str) -> None:
        """Disconnect an input, which then measures zero, or the voltage of its sensor supply."""
        with self._turn:
            self._cables[physical_channel] = OPEN_INPUT

    def reverse(self, physical_channel: str) -> None:
        """Swap the two wires of an input, and so invert the input's sign."""
        cable = self._plan.get(physical_channel, OPEN_INPUT)
        with self._turn:
            self._cables[physical_channel] = replace(cable, attenuation=-cable.attenuation)

    def keep_truth(self) -> None:
        """Start recording the true motion: 72 bytes per step, 7.4 MB per second."""
        with self._turn:
            self._truth = []

    def truth(self) -> FloatArray:
        """Return and clear the recorded true motion, shape (steps, 9).

        Columns are as in ``MOTION_COLUMNS`` of `vibench.sim.shaker`; each row belongs to the end of a step.
        """
        with self._turn:
            kept, self._truth = self._truth or [], []
            return np.concatenate(kept) if kept else np.empty((0, len(MOTION_COLUMNS)))

    def _output(self, physical_channel: str) -> AnalogueOutput:
        return self._outputs.setdefault(physical_channel, AnalogueOutput(self._grid))

    def _end(self, conversion: Conversion) -> None:
        with self._turn:
            self._conversions = [other for other in self._conversions if other is not conversion]

    def _compute_to(self, step: int) -> None:
        with self._turn:
            while self._step < step:
                while self._due and self._due[0][0] <= self._step:
                    heapq.heappop(self._due)[2]()
                stop = min(step, self._due[0][0]) if self._due else step
                self._compute(min(stop - self._step, _STRETCH_STEPS))

    def _compute(self, steps: int) -> None:
        first, step_s = self._step, self._grid.step_s
        drive = np.array(self._terminal.render(first * step_s, step_s, steps), dtype=np.float64)
        for channel, output in self._outputs.items():
            played = output.render(first, steps)
            if channel == self._amplifier_input:
                drive += played
        signals = np.zeros((len(self._rows), steps))
        signals[Signal.DRIVE] = drive
        self._move(first, signals)
        self._step = first + steps
        self._history = np.concatenate([self._history, signals], axis=1)[:, -self._history.shape[1] :]
        for conversion in self._conversions:
            conversion.take(signals, first)

    def _move(self, first: int, signals: FloatArray) -> None:
        """Compute the rows of amplifier and sensors from the drive in ``signals``, in place."""
        steps = signals.shape[1]
        noise = self._amplifier_noise_v * self._amplifier_noise.draw(first, steps)
        others = [role for role in self._sensors if role not in _LOOP_ROLES]
        if self._beam is not Role.M0_VELOCITY and Role.M0_VELOCITY in self._sensors:
            others.append(Role.M0_VELOCITY)
        motion = ShakenMotion.of(steps, steps if others or self._truth is not None else 0)
        try:
            if self._loop is not None and self._loop.is_on:
                base, m0 = (self._sensors[role].parts(first, steps) for role in _LOOP_ROLES)
                good = self._loop.move(
                    first, self._grid.step_s, self.plant, noise, (base, m0), motion, signals
                )
                self.plant.account(good, steps)
            else:
                self.plant.move_into(motion, signals[Signal.DRIVE], noise)
                signals[Signal.AMPLIFIER] = motion.amplifier_voltage
                for role, means in zip(
                    _LOOP_ROLES, (motion.base_acceleration, motion.m0_velocity), strict=True
                ):
                    if role in self._sensors and role not in others:
                        signals[self._rows[role]] = self._sensors[role].volts(means, first)
        except MotionFailed as error:
            raise AcquisitionError(f"{error}. The virtual rig has stopped: restart the rig") from error
        if others:
            ends = np.concatenate([self._last_end, motion.ends])
            self._last_end = ends[-1:]
            for role in others:
                shown = self._beam if role is Role.M0_VELOCITY else role
                signals[self._rows[role]] = self._sensors[role].volts(self._means(shown, ends), first)
        if self._truth is not None:
            self._truth.append(motion.ends)

    def _means(self, role: Role, ends: FloatArray) -> FloatArray:
        """Return a sensor's quantity as means over steps, from the states at step ends, shape (steps,)."""
        h, column = self.plant.step_s, dict(zip(MOTION_COLUMNS, ends.T, strict=True))
        place, velocity = (column[name] for name in _STATES[role.place])
        match role.quantity:
            case "acceleration":
                means = np.diff(velocity) / h
            case "velocity":
                means = np.diff(place) / h
            case "displacement":
                # The mean of the cubic Hermite polynomial through the states at both ends of the step.
                means = 0.5 * (place[:-1] + place[1:]) - h / 12 * np.diff(velocity)
            case _:
                pull = self._specimen.stiffnesses[0] * (column["x"] - place)
                pull += self._specimen.dampings[0] * (column["vx"] - velocity)
                means = self._fixture_mass_kg * np.diff(velocity) / h - 0.5 * (pull[:-1] + pull[1:])
        return np.asarray(means)


_LOOP_ROLES = (Role.BASE_ACCELERATION, Role.M0_VELOCITY)
"""Channels that a controller can sample: the channels whose means the native engine computes."""
_STATES = {
    "base": ("base_displacement", "base_velocity"),
    "m0": ("x", "vx"),
    "m1": ("y", "vy"),
    "m2": ("z", "vz"),
}
"""Columns of the motion, displacement and velocity, for each place of a sensor."""


def _sensors_of(rig: Rig, virtual: VirtualConfig, grid: TimeGrid) -> Iterator[tuple[Role, MotionSensor]]:
    """Yield the simulation of each sensor of a rig, with the configured noise."""
    noise = partial(NoiseStream, virtual.seed)
    per_rthz = np.sqrt(grid.rate_hz / 2)
    rms = grid.rms_per_step(virtual.accelerometer_noise_m_per_s2)
    role = Role.BASE_ACCELERATION
    yield role, MotionSensor(rig.accelerometer, role, rms, noise("accelerometer"), grid)
    if rig.vibrometer is not None:
        dropouts = RandomDropouts(virtual.vibrometer_dropouts_per_s, noise("laser dropouts"), grid)
        rms, role = virtual.vibrometer_noise_m_per_s_per_rthz * per_rthz, Role.M0_VELOCITY
        yield role, MotionSensor(rig.vibrometer, role, rms, noise("vibrometer"), grid, dropouts)
    for role, sensor in rig.sensors.items():
        density = 0.0 if sensor.noise_per_rthz is None else sensor.noise_per_rthz.value
        yield role, MotionSensor(sensor, role, density * per_rthz, noise(role.value), grid)


def virtual_section(rig: Rig) -> VirtualConfig:
    """Return the rig's [virtual] section; raises ConfigurationError if the instruments are real."""
    if rig.virtual is None:
        raise ConfigurationError(
            f"The rig {rig.name!r} has no [virtual] section, so its instruments are real and nothing was "
            "simulated; add the section, or open the bench with the real instruments"
        )
    return rig.virtual
