"""A simulated DAQmx task: channels, states, and the terminals of clock and trigger."""

import math
from enum import IntEnum
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from nidaqmx.constants import AcquisitionType, RegenerationMode, SampleTimingType, TaskMode
from nidaqmx.error_codes import DAQmxErrors
from numpy.typing import NDArray

from vibench.acquisition import AcquisitionError, ConfigurationError

from .devices import AnalogInputs, AnalogOutputs, Channel, Device, InputChannel, OutputChannel, expand
from .errors import DaqmxRefusal, unsupported_value
from .rig import Rig
from .streams import Acquisition, Generation, OutputBuffer, Timing, check_memory


class TdmsLog:
    """TDMS file of a task; each run of the task replaces it. Needs npTDMS."""

    def __init__(self, path: Path, group: str) -> None:
        if find_spec("nptdms") is None:
            raise ConfigurationError(
                "Logging needs npTDMS on the computer of the virtual rig: pip install 'vibench[exchange]'"
            )
        self._path = path
        self._group = group
        self._began: np.datetime64 | None = None

    def begin(self) -> None:
        """Create the TDMS file of a run."""
        self._began = None
        try:
            self._path.write_bytes(b"")
        except OSError as error:
            raise DaqmxRefusal(DAQmxErrors.GENERIC_FILE_IO, f"File: {self._path}\n{error}") from error

    def write(self, task: "Task", volts: NDArray[np.float64], began_s: float) -> None:
        """Append samples, shape (channels, samples) [V]; ``began_s`` is the rig time of the first sample."""
        from nptdms import ChannelObject, TdmsWriter  # noqa: PLC0415 - an extra; few programs log

        self._began = self._began or np.datetime64(round(task.rig.wall_s(began_s) * 1e6), "us")
        about = {
            "wf_start_time": self._began,
            "wf_increment": 1 / task.rate_hz,
            "unit_string": "Volts",
        }
        with TdmsWriter(self._path, mode="a") as file:
            file.write_segment(
                [
                    ChannelObject(self._group, channel.name, row, about)
                    for channel, row in zip(task.inputs, volts, strict=True)
                ]
            )


_OWN_CLOCKS = ("", "onboardclock")
_DEFAULT_BUFFERS = ((100.0, 1_000), (10_000.0, 10_000), (1_000_000.0, 100_000), (math.inf, 1_000_000))
"""Upper rate limits [Hz] with buffer sizes [samples] (NI-DAQmx Help, "How is buffer size determined?")."""


class TaskState(IntEnum):
    """States of a task (NI-DAQmx Help, "Task State Model"); each state includes all previous states."""

    UNVERIFIED = 0
    RESERVED = 1
    RUNNING = 2


class Task:
    """A task of the driver; all its methods are called with the rig's lock held."""

    def __init__(self, name: str, rig: Rig) -> None:
        self.name = name
        self.rig = rig
        self.state = TaskState.UNVERIFIED
        self.timing = Timing()
        self.log: TdmsLog | None = None
        self.output_size = 0
        """Size of the output buffer in samples per channel; 0 to fit the samples written before the start."""
        self.regeneration = RegenerationMode.ALLOW_REGENERATION
        self.inputs: list[InputChannel] = []
        self.outputs: list[OutputChannel] = []
        self.acquisition: Acquisition | None = None
        self.generation: Generation | None = None
        self.buffer: OutputBuffer | None = None
        self._rests_in = TaskState.UNVERIFIED

    # --- configuration -------------------------------------------------------------------

    @property
    def channels(self) -> list[Channel]:
        """All channels of the task, in the order of their creation."""
        return [*self.inputs, *self.outputs]

    @property
    def devices(self) -> tuple[Device, ...]:
        """The devices of the task's channels, each listed once."""
        return tuple({channel.device.name: channel.device for channel in self.channels}.values())

    @property
    def side(self) -> AnalogInputs | AnalogOutputs:
        """Capabilities of the device's inputs or outputs, depending on which the task uses."""
        self.require_channels()
        return (self.inputs or self.outputs)[0].side

    @property
    def stream(self) -> Acquisition | Generation | None:
        """The running acquisition or generation; None before its trigger."""
        return self.acquisition or self.generation

    @property
    def kind(self) -> SampleTimingType:
        """Effective timing: the configured timing, or the device's default."""
        return self.timing.kind or self.side.untimed

    @property
    def rate_hz(self) -> float:
        """Effective rate [Hz]: the requested rate, rounded up to a possible rate; -200077 if out of range."""
        side, requested_hz = self.side, self.timing.requested_hz
        is_shared = isinstance(side, AnalogInputs) and side.is_multiplexed
        highest = side.rates.maximum_hz / (len(self.channels) if is_shared else 1)
        lowest = side.rates.minimum_hz
        requested_hz = max(requested_hz, lowest) if self.timing.kind is None else requested_hz
        if not lowest * (1 - 1e-9) <= requested_hz <= highest * (1 + 1e-9):
            allowed = f"{lowest:.6g} to {highest:.6g} samples per second"
            raise unsupported_value("SampClk_Rate", f"{requested_hz:g}", allowed)
        return min(highest, side.rates.next_up(requested_hz))

    @property
    def buffer_size(self) -> int:
        """Size of the input buffer in samples per channel."""
        if self.kind is SampleTimingType.ON_DEMAND:
            return 0
        if self.timing.mode is AcquisitionType.FINITE:
            return self.timing.samples
        usual = next(size for limit_hz, size in _DEFAULT_BUFFERS if self.rate_hz <= limit_hz)
        return max(usual, self.timing.samples)

    @property
    def is_running(self) -> bool:
        """Whether the task has been started."""
        return self.state is TaskState.RUNNING

    @property
    def _side_name(self) -> str:
        return "ai" if self.inputs else "ao"

    def full_terminal(self, name: str) -> str:
        """Return the name of a terminal with its device: ``"PFI0"`` becomes ``"/Dev1/PFI0"``."""
        self.require_channels()
        return name if name.startswith("/") else f"/{self.devices[0].clock_name}/{name}"

    @property
    def start_terminal(self) -> str:
        """Terminal of the task's start trigger."""
        return self.full_terminal(f"{self._side_name}/StartTrigger")

    @property
    def _awaited_terminal(self) -> str:
        """Terminal whose edge starts the task; empty if the task starts without a trigger.

        A task that uses another task's sample clock waits for the other task's start trigger instead.
        """
        if self.timing.trigger_source:
            return self.timing.trigger_source
        source = self.timing.clock_source
        own_clock = self.full_terminal(f"{self._side_name}/SampleClock")
        is_own = source.lower() in (*_OWN_CLOCKS, own_clock.lower())
        return "" if is_own else source.replace("SampleClock", "StartTrigger")

    def find(self, names: str) -> list[Channel]:
        """Return the channels in a list of names; all channels for an empty list."""
        if not names:
            return self.channels
        by_name = {channel.name.lower(): channel for channel in self.channels}
        wanted = [name.lower() for name in expand(names)]
        for name in wanted:
            if name not in by_name:
                raise DaqmxRefusal(DAQmxErrors.INVALID_CHAN_NAME, f"Channel: {name}\nTask Name: {self.name}")
        return [by_name[name] for name in wanted]

    def refusal(self, code: int, **transferred: int) -> DaqmxRefusal:
        """Return the error for a call on this task; ``transferred`` is as in `DaqmxRefusal`."""
        return DaqmxRefusal(code, f"Task Name: {self.name}", **transferred)

    def require_channels(self) -> None:
        """Refuse a task without channels (-200478)."""
        if not self.channels:
            raise self.refusal(DAQmxErrors.CAN_NOT_PERFORM_OP_WHEN_NO_CHANS_IN_TASK)

    def require_stopped(self) -> None:
        """Refuse changes of a running task (-200479)."""
        if self.is_running:
            raise self.refusal(DAQmxErrors.CAN_NOT_PERFORM_OP_WHILE_TASK_RUNNING)

    def add(self, channel: Channel) -> None:
        """Add a channel; all channels of a task have one direction and, except on a chassis, one device."""
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

    # --- states --------------------------------------------------------------------------

    def control(self, action: TaskMode) -> None:
        """Carry out an action that changes the state of the task."""
        match action:
            case TaskMode.TASK_RESERVE | TaskMode.TASK_COMMIT:
                self._verify()
                self._reserve()
                if not self.is_running:
                    self.state = self._rests_in = TaskState.RESERVED
            case TaskMode.TASK_UNRESERVE | TaskMode.TASK_ABORT:
                self.abort()
            case _:
                raise unsupported_value("task action", action.name, "RESERVE, COMMIT, UNRESERVE, ABORT")

    def _verify(self) -> None:
        self.require_channels()
        for channel in self.channels:
            channel.verify()
        if self.kind is not SampleTimingType.ON_DEMAND:
            _ = self.rate_hz
            if awaited := self._awaited_terminal:
                self.rig.require_terminal(awaited)
            if self.inputs:
                check_memory(self.buffer_size, len(self.inputs))

    def _reserve(self) -> None:
        for device in self.devices:
            try:
                self.rig.reserve(f"{device.name}/{self._side_name}", self)
            except DaqmxRefusal:
                if self.state < TaskState.RESERVED:
                    self.rig.release(self)
                raise

    def start(self) -> None:
        """Start the run, or wait for the start trigger."""
        self.require_stopped()
        self._verify()
        if self.outputs and self.kind is not SampleTimingType.ON_DEMAND and not self.output_buffer.buffered:
            raise self.refusal(DAQmxErrors.OUTPUT_BUFFER_EMPTY)
        self._reserve()
        self.state = TaskState.RUNNING
        if self.kind is SampleTimingType.ON_DEMAND:
            return
        if self._awaited_terminal:
            self.rig.arm(self._awaited_terminal, self._begin)
            return
        # Update rig time here, not in _begin, because tasks with a common trigger must start together.
        self.rig.pace.pass_time(self.rig, 0.0)
        try:
            self._begin()
        except AcquisitionError:  # the simulation does not support this capability
            self.stop()
            raise

    @property
    def output_buffer(self) -> OutputBuffer:
        """The output buffer, which is created at its first use."""
        if self.buffer is None:
            self.buffer = OutputBuffer(len(self.outputs), self.output_size)
        return self.buffer

    def _begin(self) -> None:
        if self.inputs:
            if self.log is not None:
                self.log.begin()
            self.acquisition = Acquisition(self)
            self.rig.run(self.acquisition)
        else:
            self.generation = Generation(self)
            self.rig.run(self.generation)
        self.rig.edge(self.start_terminal)

    def is_done(self) -> bool:
        """Return whether the task is finished; raise the error that ended it."""
        stream = self.stream
        if stream is None:
            return not self.is_running or self.kind is SampleTimingType.ON_DEMAND
        if stream.failure is not None:
            raise stream.failure
        return stream.is_done

    def wait_until_done(self, deadline_s: float) -> None:
        """Wait for the end of a finite task (-200560 after the deadline)."""
        until_s = self.stream.time_of(self.stream.total) if self.stream else math.inf
        if not self.rig.pace.ask(self.rig, until_s, self.is_done, deadline_s):
            raise self.refusal(DAQmxErrors.WAIT_UNTIL_DONE_DOES_NOT_INDICATE_DONE)

    def stop(self) -> None:
        """End the run, and return to the state before the start; allowed in every state."""
        if not self.is_running:
            return
        self.rig.disarm(self._begin)
        if self.stream is not None:
            self.rig.end(self.stream)
        if self.generation is not None and not self.generation.repeats:
            self.buffer = None
        self.acquisition = self.generation = None
        self.state = self._rests_in
        if self.state < TaskState.RESERVED:
            self.rig.release(self)
        self.rig.changed.notify_all()

    def abort(self) -> None:
        """End the run and release all reservations."""
        self.stop()
        self.rig.release(self)
        self.state = self._rests_in = TaskState.UNVERIFIED
