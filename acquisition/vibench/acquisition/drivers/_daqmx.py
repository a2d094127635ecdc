"""Digitizer on NI-DAQmx: continuous hardware-timed sampling without gaps; the device is always released."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from typing import Any, Self

import grpc
import numpy as np
from nidaqmx import DaqError, GrpcSessionOptions, Task
from nidaqmx.constants import (
    AcquisitionType,
    Coupling,
    ExcitationSource,
    ExcitationVoltageOrCurrent,
    TaskMode,
    TerminalConfiguration,
)
from nidaqmx.stream_readers import AnalogMultiChannelReader, AnalogUnscaledReader
from nidaqmx.system import System
from nidaqmx.task.channels import AIChannel
from numpy.typing import NDArray

from ..errors import ConfigurationError, InstrumentError, SettingRefused
from ..instruments import Block, Counts, FoundDevice, Identity, Overload, Samples
from ..rig import TOKEN_KEY, Channel, ChannelConfig, DaqConfig, Rig, channels_of, token_from_env
from ._daqmx_errors import NOT_OFFERED, daqmx_call
from ._limits import overload_ranges

# This time is longer than any read (`LONGEST_READ_S` plus margin). A server that is silent for this time
# counts as lost, even if the connection still exists.
CALL_DEADLINE_S = 20.0
LOST_DEADLINE_S = 1.0
"""Time limit of every call that follows a call without a reply [s], so that a run ends in a bounded time."""
# At the highest rate, one second of four channels exceeds gRPC's default limit of 4 MB per message.
_NO_LIMIT = -1
_CHANNEL_OPTIONS = (
    ("grpc.max_receive_message_length", _NO_LIMIT),
    ("grpc.max_send_message_length", _NO_LIMIT),
)


class _Deadline(grpc.UnaryUnaryClientInterceptor):  # type: ignore[misc] # grpc ships without types
    """Interceptor: limits the time of every gRPC call and adds the token; the DAQmx client does neither."""

    def __init__(self) -> None:
        self._is_lost = False

    def intercept_unary_unary(self, continuation: Callable[..., Any], details: Any, request: Any) -> Any:
        # The method _replace of a namedtuple is public in spite of the underscore.
        carried = ((TOKEN_KEY, token_from_env()),) if token_from_env() else ()
        metadata = (*(details.metadata or ()), *carried)
        deadline_s = LOST_DEADLINE_S if self._is_lost else CALL_DEADLINE_S
        answer = continuation(details._replace(timeout=deadline_s, metadata=metadata), request)
        self._is_lost = answer.code() is grpc.StatusCode.DEADLINE_EXCEEDED
        return answer


@dataclass(frozen=True)
class DaqmxSession:
    """Connection to a DAQmx driver; close it after all devices that were opened through it."""

    server: str | None
    """Address of the driver, ``"host:port"``; None for the driver on this computer."""
    options: GrpcSessionOptions | None
    _channel: grpc.Channel | None

    @property
    def place(self) -> str:
        """Location of the driver, as named in errors."""
        return "this computer" if self.server is None else f"the device server at {self.server}"

    def system(self) -> System:
        """Return an object that lists the devices and the driver version."""
        return System.local() if self.options is None else System.remote(self.options)

    def close(self) -> None:
        """Close the connection. May be called at any time."""
        if self._channel is not None:
            self._channel.close()


def daqmx_session(server: str | None) -> DaqmxSession:
    """Return a connection to a driver; a server is first contacted at the first call."""
    if server is None:
        return DaqmxSession(None, None, None)
    channel = grpc.insecure_channel(server, options=_CHANNEL_OPTIONS)
    options = GrpcSessionOptions(grpc.intercept_channel(channel, _Deadline()), "")
    return DaqmxSession(server, options, channel)


def list_daqmx_devices(server: str | None) -> tuple[FoundDevice, ...]:
    """Return the devices of the driver on this computer, or of a device server at ``"host:port"``.

    Raises InstrumentLost when the server does not answer, and InstrumentError when this computer has no
    driver.
    """
    with closing(daqmx_session(server)) as session, daqmx_call(f"listing the devices of {session.place}"):
        return tuple(
            FoundDevice(
                name=device.name,
                product=device.product_type,
                serial=f"{device.serial_num:08X}",
                inputs=tuple(channel.name for channel in device.ai_physical_chans),
                outputs=tuple(channel.name for channel in device.ao_physical_chans),
            )
            for device in session.system().devices
        )


_TERMINALS = {
    "default": TerminalConfiguration.DEFAULT,
    "pseudo_differential": TerminalConfiguration.PSEUDO_DIFF,
    "differential": TerminalConfiguration.DIFF,
    "single_ended": TerminalConfiguration.RSE,
}
_COUPLINGS = {"AC": Coupling.AC, "DC": Coupling.DC}
_SAME = 1e-6
# A larger deviation from a straight line is not a rounding error: the scaling is then not linear.
_LINEAR = 1e-9
# Recordings mark a lost sample by one int32 count, which a 32-bit converter may return for a voltage.
_MOST_COUNTS = 2**29


def add_input(task: Task, config: ChannelConfig, channel: Channel) -> float | None:
    """Add one input to a task under the name of its role; return the volts per count (None if not linear).

    Raises SettingRefused when coupling or sensor current read back differently, and DaqError when the device
    refuses a setting.
    """
    task.ai_channels.add_ai_voltage_chan(
        channel.physical,
        name_to_assign_to_channel=channel.role.value,
        terminal_config=_TERMINALS[config.terminal],
        min_val=-channel.range_v,
        max_val=channel.range_v,
    )
    made = task.ai_channels[channel.role.value]
    _excite(made, channel)
    _couple(made, channel)
    try:
        return linear_step_v([float(each) for each in made.ai_dev_scaling_coeff], channel.range_v)
    except DaqError as error:
        if error.error_type in NOT_OFFERED:
            return None
        raise


def _excite(made: AIChannel, channel: Channel) -> None:
    if channel.iepe_current_a > 0:
        made.ai_excit_src = ExcitationSource.INTERNAL
        made.ai_excit_voltage_or_current = ExcitationVoltageOrCurrent.USE_CURRENT
        made.ai_excit_val = channel.iepe_current_a
        held_a = made.ai_excit_val
        if not abs(held_a - channel.iepe_current_a) <= _SAME * channel.iepe_current_a:  # refuses NaN too
            raise _refusal(channel, "sensor current", f"{channel.iepe_current_a:g} A", f"{held_a:g} A")
        return
    try:
        # A current left on by an earlier program would shift the vibrometer's output.
        made.ai_excit_src = ExcitationSource.NONE
    except DaqError as error:
        if error.error_type not in NOT_OFFERED:
            raise


def _couple(made: AIChannel, channel: Channel) -> None:
    wanted = _COUPLINGS[channel.coupling]
    try:
        made.ai_coupling = wanted
        held = made.ai_coupling
    except DaqError as error:
        # A device without selectable coupling is DC coupled.
        if error.error_type in NOT_OFFERED and wanted is Coupling.DC:
            return
        raise
    if held is not wanted:
        raise _refusal(channel, "coupling", wanted.name, held.name)


def linear_step_v(coefficients: Sequence[float], range_v: float) -> float | None:
    """Return the step of a converter [V]; None if volts are not multiples of one step.

    A calibrated device may scale counts with an offset or a curve; its volts are then recorded as they are
    read. ``coefficients`` define the polynomial from counts to volts, constant term first.
    """
    if len(coefficients) < 2 or not coefficients[1] * _MOST_COUNTS > range_v:
        return None
    step = coefficients[1]
    rest_v = [abs(each) * (range_v / step) ** power for power, each in enumerate(coefficients) if power != 1]
    return step if all(each <= _LINEAR * range_v for each in rest_v) else None


def _refusal(channel: Channel, what: str, sent: str, got: str) -> SettingRefused:
    return SettingRefused(
        f"{channel.physical}: {what} was set to {sent}, but {got} was read back. The device was released; "
        f"correct the input of {channel.role.value} in the hardware configuration"
    )


def daqmx_identity(session: DaqmxSession, device_name: str) -> Identity:
    """Return the driver's report on a device, such as ``"cDAQ1Mod1"``; raises errors of the DAQmx client."""
    system = session.system()
    device = system.devices[device_name]
    product, serial = str(device.product_type), f"{device.serial_num:08X}"
    version = system.driver_version
    driver = f"NI-DAQmx {version.major_version}.{version.minor_version}.{version.update_version}"
    reply = f"{device_name}: {product}, {serial}, {driver}"
    return Identity("National Instruments", product, serial, driver, reply)


# Reads are divided into pieces of this length: no call then waits long or needs the whole buffer.
LONGEST_READ_S = 2.0
# A read fails if it takes longer than the duration of its samples plus this time [s].
_READ_MARGIN_S = 10.0
# Sigma-delta modules use the next higher rate of a list, which is below this multiple of the request.
_MOST_COERCED = 2.0


class DaqmxDigitizer:
    """A `Digitizer` on NI-DAQmx, on this computer or behind a gRPC device server.

    `open` creates the digitizer, reserves the device, and checks all settings before any run starts.
    """

    def __init__(self, session: DaqmxSession, config: DaqConfig, channels: tuple[Channel, ...]) -> None:
        self.session = session
        """Connection to the driver; an output of the same driver uses this connection, too."""
        self._config = config
        self._channels = channels
        self.roles = tuple(channel.role.value for channel in channels)
        """Roles of the channels, in the row order of a block."""
        self._resources = ExitStack()
        self._task: Task | None = None
        self._reader: AnalogUnscaledReader | AnalogMultiChannelReader | None = None
        self.volts_per_count: tuple[float | None, ...] = ()
        """Step of the converter for each channel [V]; None where volts are not multiples of one step."""
        self._identity: Identity | None = None
        self.sample_rate_hz = 0.0
        """Actual sample rate, read back from the hardware [1/s]."""
        self._next_sample = 0
        self._is_running = False
        self._tells_overloads = True

    @classmethod
    def open(cls, rig: Rig) -> Self:
        """Reserve the converter of a rig with all its inputs, read back its rate, and return the digitizer.

        Raises InstrumentBusy, InstrumentLost, InstrumentError, ConfigurationError or SettingRefused as
        `_daqmx_errors` assigns them. After an error, nothing stays reserved.
        """
        digitizer = cls(daqmx_session(rig.daq.server), rig.daq, channels_of(rig))
        with ExitStack() as undo:
            undo.callback(digitizer._release)
            with daqmx_call(f"opening {rig.daq.device} on {digitizer.session.place}"):
                digitizer._reserve()
            undo.pop_all()
        return digitizer

    @property
    def identity(self) -> Identity:
        """Product and serial number of the device, and version of the driver."""
        if self._identity is None:
            raise InstrumentError(f"{self._config.device} is not open; open it with DaqmxDigitizer.open")
        return self._identity

    def start_trigger(self) -> str:
        """Terminal of this task's start trigger; other tasks must be armed with it before `start`."""
        with daqmx_call(f"reading the start trigger of {self._config.device}"):
            return str(self._open_task().triggers.start_trigger.term)

    def start(self) -> None:
        """Begin sampling; the first sample of the run is sample 0."""
        task = self._open_task()
        if self._is_running:
            raise InstrumentError(f"{self._config.device} is sampling already; stop it before the next run")
        with daqmx_call(f"starting {self._config.device}"):
            task.start()
        self._is_running = True
        self._next_sample = 0

    def read(self, samples: int) -> Block:
        """Wait for the next ``samples`` of every channel and return them.

        After a failure the run cannot continue, because its sample numbers are lost: stop and start again.

        Raises DataLost when samples were overwritten before they were read; InstrumentLost when the device or
        its server is gone; InstrumentError when the samples do not come in time, or when nothing is running.
        """
        if not self._is_running:
            raise InstrumentError(f"{self._config.device} is not sampling; start it before reading")
        if samples < 1:
            raise InstrumentError(
                f"{samples} samples were requested from {self._config.device}; request 1 or more"
            )
        first_sample = self._next_sample
        with daqmx_call(
            f"reading samples {first_sample} to {first_sample + samples - 1} of {self._config.device}"
        ):
            self._is_running = False  # the run counts as failed until the block is complete
            volts, counts = self._next_samples(samples)
            overloaded_roles = self._overloaded_roles()
            self._is_running = True
        self._next_sample += samples
        return Block(first_sample, volts, self._overloads(volts, first_sample, overloaded_roles), counts)

    @property
    def waiting_samples(self) -> int:
        """Number of samples per channel that were converted but not yet read."""
        if not self._is_running:
            return 0
        with daqmx_call(f"reading the number of waiting samples of {self._config.device}"):
            return int(self._open_task().in_stream.avail_samp_per_chan)

    def stop(self) -> None:
        """End sampling. May be called at any time."""
        self._is_running = False
        if self._task is not None:
            with daqmx_call(f"stopping {self._config.device}"):
                self._task.stop()

    def close(self) -> None:
        """Release the device and close the connection, even after an error. May be called at any time."""
        with daqmx_call(f"releasing {self._config.device}"):
            self._release()

    def _release(self) -> None:
        self._is_running = False
        self._task = None
        self._reader = None
        self._resources.close()

    def _reserve(self) -> None:
        self._resources.callback(self.session.close)
        identity = daqmx_identity(self.session, self._config.device)
        if _plain(identity.model) != _plain(self._config.product):
            raise ConfigurationError(
                f"{self._config.device} on {self.session.place} is a {identity.model}, but daq.product is "
                f"{self._config.product!r}. Nothing was reserved; correct daq.device or daq.product"
            )
        self._identity = identity
        self._task = task = self._resources.enter_context(Task(grpc_options=self.session.options))
        pairs = zip(self._config.channels, self._channels, strict=True)
        self.volts_per_count = tuple(add_input(task, config, channel) for config, channel in pairs)
        rate_hz = self._config.sample_rate_hz
        task.timing.cfg_samp_clk_timing(
            rate_hz,
            sample_mode=AcquisitionType.CONTINUOUS,
            samps_per_chan=int(self._config.buffer_s * rate_hz),
        )
        self.sample_rate_hz = float(task.timing.samp_clk_rate)
        if not rate_hz * (1 - 1e-6) <= self.sample_rate_hz < _MOST_COERCED * rate_hz:
            raise SettingRefused(
                f"{self._config.device} was set to {rate_hz:g} samples a second, but uses "
                f"{self.sample_rate_hz:g}; the next higher rate was expected. The device was released; "
                "set daq.sample_rate_hz to a rate that the device supports"
            )
        task.control(TaskMode.TASK_RESERVE)
        if None in self.volts_per_count:
            self._reader = AnalogMultiChannelReader(task.in_stream)
        else:
            self._reader = AnalogUnscaledReader(task.in_stream)
            self._steps_v = np.array(self.volts_per_count)[:, np.newaxis]
        # This class makes every array for the channels of this task, so the client's check is not needed.
        self._reader.verify_array_shape = False

    def _open_task(self) -> Task:
        if self._task is None:
            raise InstrumentError(f"{self._config.device} is closed; open the bench again")
        return self._task

    def _next_samples(self, samples: int) -> tuple[Samples, Counts | None]:
        """Return the next samples [V], and their counts if the converter scales linearly."""
        shape = len(self._channels), samples
        if isinstance(self._reader, AnalogUnscaledReader):
            counts = np.empty(shape, np.int32)
            self._fill(counts, self._reader.read_int32)
            return counts * self._steps_v, counts
        assert self._reader is not None, "a running task has a reader"
        volts = np.empty(shape)
        self._fill(volts, self._reader.read_many_sample)
        return volts, None

    def _fill(self, rows: NDArray[Any], read: Callable[[NDArray[Any], int, float], int]) -> None:
        piece = max(1, int(min(LONGEST_READ_S, self._config.buffer_s / 2) * self.sample_rate_hz))
        for first in range(0, rows.shape[1], piece):
            count = min(piece, rows.shape[1] - first)
            # The reader needs C order, which a slice of columns does not have: read pieces into a copy.
            target = rows if count == rows.shape[1] else np.empty((rows.shape[0], count), rows.dtype)
            # If the reply is too short, this marker remains; no converter returns such a value.
            target[-1, -1] = missing = -np.inf if target.dtype.kind == "f" else np.iinfo(target.dtype).min
            came = read(target, count, count / self.sample_rate_hz + _READ_MARGIN_S)
            if came != count or target[-1, -1] == missing:
                raise InstrumentError(
                    f"{self._config.device} reported {came} samples when {count} were requested, or sent "
                    "fewer than it reported. They were discarded; restart the driver or the device server"
                )
            if target is not rows:
                rows[:, first : first + count] = target

    def _overloaded_roles(self) -> frozenset[str]:
        """Return the channels that the device reports as overloaded during the run, if it can report them."""
        if not self._tells_overloads:
            return frozenset()
        stream = self._open_task().in_stream
        try:
            return frozenset(stream.overloaded_chans) if stream.overloaded_chans_exist else frozenset()
        except DaqError as error:
            if error.error_type not in NOT_OFFERED:
                raise
            self._tells_overloads = False
            return frozenset()

    def _overloads(
        self, volts: Samples, first_sample: int, overloaded_roles: frozenset[str]
    ) -> tuple[Overload, ...]:
        scales_v = tuple(channel.full_scale_v for channel in self._channels)
        seen = overload_ranges(volts, self.roles, scales_v, first_sample)
        unseen = overloaded_roles - {overload.channel for overload in seen}
        # The samples do not show such a short overload; only the block that contains the overload is known.
        last_sample = first_sample + volts.shape[1] - 1
        return (*seen, *(Overload(role, first_sample, last_sample) for role in sorted(unseen)))


def _plain(product: str) -> str:
    return product.upper().removeprefix("NI").strip(" -")
