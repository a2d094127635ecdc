"""A simulated DAQmx task: its channels, its states, and the terminals of its clock and trigger."""

from enum import IntEnum
from typing import Protocol

from nidaqmx.constants import SampleTimingType, TaskMode
from nidaqmx.error_codes import DAQmxErrors

from vibench.acquisition import AcquisitionError

from ._acquisition import Acquisition
from ._channels import Channel, InputChannel, OutputChannel
from ._devices import AnalogInputs, AnalogOutputs, Device
from ._errors import DaqmxRefusal
from ._generation import Generation, OutputBuffer
from ._names import expand
from ._rig import Rig
from ._timing import InputSettings, OutputSettings, Timing, actual_rate, input_buffer_size, kind_of

START_TRIGGER = "StartTrigger"
SAMPLE_CLOCK = "SampleClock"
_OWN_CLOCKS = ("", "onboardclock")


def terminal(device: Device, side: str, signal: str) -> str:
    """Name the terminal of a device's timing engine, ``"/Dev1/ai/StartTrigger"`` for example."""
    return f"/{device.clock_name}/{side}/{signal}"


def awaited_terminal(timing: Timing, own_clock: str) -> str:
    """Name the terminal whose edge makes a task begin; empty: its own start.

    Another task's sample clock begins to tick with that task, so waiting for it is waiting for its start.
    """
    if timing.trigger_source:
        return timing.trigger_source
    source = timing.clock_source.lower()
    is_own = source in _OWN_CLOCKS or source == own_clock.lower()
    return "" if is_own else timing.clock_source.replace(SAMPLE_CLOCK, START_TRIGGER)


INPUT_SIDE = "ai"
OUTPUT_SIDE = "ao"


class TaskState(IntEnum):
    """The DAQmx task state model (NI-DAQmx Help, "Task State Model"); each state includes the ones before."""

    UNVERIFIED = 0
    VERIFIED = 1
    RESERVED = 2
    COMMITTED = 3
    RUNNING = 4


class Reservations(Protocol):
    """Who holds which side of which device."""

    def reserve(self, resource: str, holder: "Task") -> None:
        """Take it, or refuse (-50103)."""

    def release(self, holder: "Task") -> None:
        """Give back everything that task holds."""


class Task:
    """One task; every method is called with the rig's lock held."""

    def __init__(self, name: str, rig: Rig, reservations: Reservations) -> None:
        """Begin empty and unverified."""
        self.name = name
        self.rig = rig
        self.state = TaskState.UNVERIFIED
        self.timing = Timing()
        self.reading = InputSettings()
        self.writing = OutputSettings()
        self.inputs: list[InputChannel] = []
        self.outputs: list[OutputChannel] = []
        self.acquisition: Acquisition | None = None
        self.generation: Generation | None = None
        self.buffer: OutputBuffer | None = None
        self._reservations = reservations
        self._rests_in = TaskState.UNVERIFIED

    # --- what it consists of -------------------------------------------------------------

    @property
    def channels(self) -> list[Channel]:
        """All channels in the order they were added."""
        return [*self.inputs, *self.outputs]

    @property
    def channels_to_read(self) -> tuple[str, ...]:
        """Names of the channels that a read hands over."""
        return self.reading.channels or tuple(channel.name for channel in self.channels)

    @property
    def devices(self) -> tuple[Device, ...]:
        """The devices the channels lie on, each once."""
        return tuple({channel.device.name: channel.device for channel in self.channels}.values())

    @property
    def side(self) -> AnalogInputs | AnalogOutputs:
        """What the device can do on the side this task uses."""
        self.require_channels()
        return self.inputs[0].inputs if self.inputs else self.outputs[0].outputs

    @property
    def stream(self) -> Acquisition | Generation | None:
        """What runs, once it has been triggered."""
        return self.acquisition or self.generation

    @property
    def kind(self) -> SampleTimingType:
        """The timing in force."""
        return kind_of(self.timing, self.side)

    @property
    def rate_hz(self) -> float:
        """The rate the device really runs at [Hz]."""
        return actual_rate(self.timing, self.side, len(self.channels))

    @property
    def buffer_size(self) -> int:
        """Samples per channel of the input buffer."""
        if self.kind is SampleTimingType.ON_DEMAND:
            return 0
        return input_buffer_size(self.timing, self.reading, self.rate_hz)

    @property
    def is_running(self) -> bool:
        """Whether it has been started and not stopped."""
        return self.state is TaskState.RUNNING

    @property
    def is_on_chassis(self) -> bool:
        """Whether its timing engine is only known once it is reserved."""
        return any(device.chassis for device in self.devices)

    def _terminal(self, signal: str) -> str:
        self.require_channels()
        return terminal(self.devices[0], INPUT_SIDE if self.inputs else OUTPUT_SIDE, signal)

    @property
    def start_terminal(self) -> str:
        """Terminal of its own start trigger."""
        return self._terminal(START_TRIGGER)

    @property
    def clock_terminal(self) -> str:
        """Terminal of its own sample clock."""
        return self._terminal(SAMPLE_CLOCK)

    def find(self, names: str) -> list[Channel]:
        """Find the channels named; all of them for an empty list."""
        if not names:
            return self.channels
        by_name = {channel.name.lower(): channel for channel in self.channels}
        wanted = expand(names)
        for name in wanted:
            if name.lower() not in by_name:
                raise DaqmxRefusal(DAQmxErrors.INVALID_CHAN_NAME, f"Channel: {name}\nTask Name: {self.name}")
        return [by_name[name.lower()] for name in wanted]

    def require_channels(self) -> None:
        """Refuse to go on without channels (-200478)."""
        if not self.channels:
            code = DAQmxErrors.CAN_NOT_PERFORM_OP_WHEN_NO_CHANS_IN_TASK
            raise DaqmxRefusal(code, f"Task Name: {self.name}")

    def require_stopped(self) -> None:
        """Refuse to change what is running (-200479), and forget what was verified."""
        if self.is_running:
            raise DaqmxRefusal(DAQmxErrors.CAN_NOT_PERFORM_OP_WHILE_TASK_RUNNING, f"Task Name: {self.name}")
        if self.state is TaskState.VERIFIED:
            self.state = TaskState.UNVERIFIED

    def add(self, channel: Channel) -> None:
        """Add a channel; a task has one direction and, but for a chassis, one device."""
        self.require_stopped()
        if any(other.name.lower() == channel.name.lower() for other in self.channels):
            raise DaqmxRefusal(DAQmxErrors.VIRTUAL_CHAN_NAME_USED, f"Channel: {channel.name}")
        if any(device.clock_name != channel.device.clock_name for device in self.devices):
            raise DaqmxRefusal(DAQmxErrors.MULTI_DEVS_IN_TASK, f"Device: {channel.device.name}")
        match channel:
            case InputChannel() if not self.outputs:
                self.inputs.append(channel)
            case OutputChannel() if not self.inputs:
                self.outputs.append(channel)
            case _:
                raise DaqmxRefusal(DAQmxErrors.INCONSISTENT_CHANNEL_DIRECTIONS, f"Channel: {channel.name}")

    # --- its states ----------------------------------------------------------------------

    def control(self, action: TaskMode) -> None:
        """Go to the state an action names."""
        match action:
            case TaskMode.TASK_START:
                self.start()
            case TaskMode.TASK_STOP:
                self.stop()
            case TaskMode.TASK_VERIFY:
                self._rise(TaskState.VERIFIED)
            case TaskMode.TASK_RESERVE:
                self._rise(TaskState.RESERVED)
            case TaskMode.TASK_COMMIT:
                self._rise(TaskState.COMMITTED)
            case _:
                self.abort()

    def _rise(self, state: TaskState) -> None:
        self.require_channels()
        if self.state < state:
            self._verify()
            if state >= TaskState.RESERVED:
                self._reserve()
            self.state = state
        if not self.is_running:
            self._rests_in = self.state

    def _verify(self) -> None:
        for channel in self.channels:
            channel.verify()
        if self.kind is not SampleTimingType.ON_DEMAND:
            _ = self.rate_hz

    def _reserve(self) -> None:
        side = INPUT_SIDE if self.inputs else OUTPUT_SIDE
        for device in self.devices:
            try:
                self._reservations.reserve(f"{device.name}/{side}", self)
            except DaqmxRefusal:
                if self.state < TaskState.RESERVED:
                    self._reservations.release(self)
                raise

    def start(self) -> None:
        """Begin, or wait for the trigger."""
        self.require_channels()
        self.require_stopped()
        self._verify()
        if self.outputs and self.kind is not SampleTimingType.ON_DEMAND and not self.output_buffer.filled:
            raise DaqmxRefusal(DAQmxErrors.OUTPUT_BUFFER_EMPTY, f"Task Name: {self.name}")
        self._reserve()
        self.state = TaskState.RUNNING
        if self.kind is SampleTimingType.ON_DEMAND:
            return
        awaited = awaited_terminal(self.timing, self.clock_terminal)
        if awaited:
            self.rig.arm(awaited, self._begin)
            return
        try:
            self._begin()
        except AcquisitionError:  # what is wired to it cannot do what the device could
            self.stop()
            raise

    @property
    def output_buffer(self) -> OutputBuffer:
        """What has been written, made at the first need."""
        if self.buffer is None:
            self.buffer = OutputBuffer(len(self.outputs), self.writing.buffer_size)
        return self.buffer

    def _begin(self) -> None:
        if self.inputs:
            self.acquisition = self._acquire()
            self.rig.run_acquisition(self.acquisition)
        else:
            self.generation = self._generate()
            self.rig.run_generation(self.generation)
        self.rig.edge(self.start_terminal)

    def _acquire(self) -> Acquisition:
        sampler = self.rig.world.sample(tuple(channel.wiring() for channel in self.inputs), self.rate_hz)
        return Acquisition(
            sampler, len(self.inputs), self.rate_hz, self.rig.now_s, self.timing.total,
            self.buffer_size, self.rig.pace.overflow, self.reading.overwrite,
        )  # fmt: skip

    def _generate(self) -> Generation:
        physical = tuple(channel.physical for channel in self.outputs)
        return Generation(
            self.rig.world, physical, self.rate_hz, self.rig.now_s, self.timing.total,
            self.output_buffer, self.writing.regeneration, self.outputs[0].outputs.idle,
        )  # fmt: skip

    def is_done(self) -> bool:
        """Whether it has nothing left to do; raises what ended it, if it failed."""
        stream = self.stream
        if stream is None:
            return not self.is_running or self.kind is SampleTimingType.ON_DEMAND
        if stream.failure is not None:
            raise stream.failure
        return stream.is_done

    def wait_until_done(self, timeout_s: float) -> None:
        """Wait for the end of a finite task (-200560 if it does not come)."""
        until_s = self.stream.time_of(self.stream.total) if self.stream else float("inf")
        if not self.rig.pace.ask(self.rig, until_s, self.is_done, timeout_s):
            code = DAQmxErrors.WAIT_UNTIL_DONE_DOES_NOT_INDICATE_DONE
            raise DaqmxRefusal(code, f"Task Name: {self.name}")

    def stop(self) -> None:
        """End what runs and go back to the state before the start; legal in every state."""
        if not self.is_running:
            return
        self.rig.disarm(self._begin)
        if self.stream is not None:
            self.rig.end(self.stream)
        if self.generation is not None and self.generation.uses_up_its_buffer:
            self.buffer = None
        self.acquisition = self.generation = None
        self.state = self._rests_in
        if self.state < TaskState.RESERVED:
            self._reservations.release(self)
        self.rig.changed.notify_all()

    def abort(self) -> None:
        """End what runs and give everything back."""
        self.stop()
        self._reservations.release(self)
        self.state = self._rests_in = TaskState.UNVERIFIED
