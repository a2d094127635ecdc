"""Calls that transfer samples between a program and a task, with their protobuf encoding."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from ni.protobuf.types.waveform_pb2 import DoubleAnalogWaveform
from nidaqmx.constants import AcquisitionType, FillMode, SampleTimingType
from nidaqmx.error_codes import DAQmxErrors
from numpy.typing import NDArray

from .calls import Fields, TaskCall, deadline, pick
from .errors import DaqmxRefusal, unsupported_value
from .rig import QUESTION_S
from .streams import Acquisition, Stream, check_memory
from .tasks import Task


@dataclass(frozen=True)
class Reading:
    """Result of a read from a task."""

    volts: NDArray[np.float64]
    """Samples of all channels of the task, shape (channels, samples) [V]."""
    status: int = 0
    """DAQmx status: 0, or the reason for fewer samples than requested."""
    began_s: float = 0.0
    """Rig time of the first sample [s]."""

    @property
    def samples(self) -> int:
        """Number of samples per channel."""
        return int(self.volts.shape[1])


def read(task: Task, samples: int, deadline_s: float) -> Reading:
    """Read ``samples`` samples per channel, and start the task if necessary; a negative number reads all.

    Raises DaqmxRefusal: -200279 for lost samples, -200278 past the end, -200284 if no sample arrived in time.
    """
    if not task.inputs:
        task.require_channels()
        raise task.refusal(DAQmxErrors.READ_NO_INPUT_CHANS_IN_TASK)
    check_memory(samples, len(task.inputs))
    has_to_start = not task.is_running
    if has_to_start:
        task.start()
    if task.kind is SampleTimingType.ON_DEMAND:
        reading = _read_on_demand(task, max(1, samples))
    else:
        wanted = default_samples(task) if samples < 0 else samples
        reading = _read_buffered(task, wanted, deadline_s)
    acquisition = task.acquisition
    is_used_up = acquisition is not None and acquisition.is_done and acquisition.available == 0
    if has_to_start and (is_used_up or task.kind is SampleTimingType.ON_DEMAND):
        task.stop()
    return reading


def default_samples(task: Task) -> int:
    """Return how many samples "all" means: a finite task's total, or a continuous task's unread samples."""
    if task.inputs and task.kind is SampleTimingType.ON_DEMAND:
        return 1
    if task.timing.mode is AcquisitionType.FINITE:
        return task.timing.samples
    return available(task)


def available(task: Task) -> int:
    """Return the number of unread samples per channel; if there are none, advance time on demand."""
    if task.acquisition is None:
        return 0
    if task.acquisition.available == 0 and not task.acquisition.is_done:
        task.rig.pace.pass_time(task.rig, QUESTION_S)
    return task.acquisition.available


def count_available(task: Task) -> int:
    """Return the number of unread samples; if none was read since the last query, advance time on demand."""
    acquisition = task.acquisition
    if acquisition is None or acquisition.queried_at == acquisition.position:
        return available(task)
    acquisition.queried_at = acquisition.position
    return acquisition.available


def _read_on_demand(task: Task, samples: int) -> Reading:
    rate_hz = task.side.rates.maximum_hz / len(task.inputs)
    sampler = task.rig.world.sample(tuple(channel.wiring() for channel in task.inputs), rate_hz)
    volts = sampler.read(samples)
    sampler.close()
    return Reading(volts, began_s=task.rig.now_s - samples / rate_hz)


def _read_buffered(task: Task, wanted: int, deadline_s: float) -> Reading:
    def has_begun() -> bool:
        return task.acquisition is not None or not task.is_running

    if not task.rig.pace.ask(task.rig, math.inf, has_begun, deadline_s):
        status = int(DAQmxErrors.SAMPLES_NOT_YET_AVAILABLE) if wanted else 0
        return Reading(np.empty((len(task.inputs), 0)), status)
    acquisition = task.acquisition
    if acquisition is None:
        raise task.refusal(DAQmxErrors.RUNTIME_ABORTED_ROUTING, samples_read=0)
    first = acquisition.position
    count = int(min(wanted, max(0, acquisition.total - first)))
    status = 0 if count == wanted else int(DAQmxErrors.SAMPLES_WILL_NEVER_BE_AVAILABLE)
    if status and not count:
        raise task.refusal(status, samples_read=0)
    blocks, taken = [], 0
    while taken < count:
        piece = min(count - taken, acquisition.buffer_size)
        end = first + taken + piece
        is_there = partial(acquisition.reaches, end)
        has_come = _await(task, acquisition, acquisition.time_of(end), is_there, deadline_s)
        if not has_come:
            piece = max(0, min(piece, acquisition.transferred - first - taken))
            status = int(DAQmxErrors.SAMPLES_NOT_YET_AVAILABLE)
        blocks.append(acquisition.read(piece))
        taken += piece
        task.rig.changed.notify_all()
        if not has_come:
            break
    volts = np.concatenate(blocks, axis=1) if blocks else np.empty((len(task.inputs), 0))
    began_s = acquisition.began_s + first / acquisition.rate_hz
    if task.log is not None and volts.size:
        task.log.write(task, volts, began_s)
    return Reading(volts, status, began_s)


def _await(
    task: Task, stream: Stream, until_s: float, is_there: Callable[[], bool], deadline_s: float
) -> bool:
    """Wait for samples of a run; return whether they came in time. Refuse a stopped run (-88709)."""

    def has_ended() -> bool:
        return stream.failure is not None or task.stream is not stream

    has_come = task.rig.pace.ask(task.rig, until_s, lambda: is_there() or has_ended(), deadline_s)
    if task.stream is not stream:
        transferred = "samples_read" if isinstance(stream, Acquisition) else "samples_written"
        raise task.refusal(DAQmxErrors.RUNTIME_ABORTED_ROUTING, **{transferred: 0})
    return has_come


def write(task: Task, volts: NDArray[np.float64], request: Any) -> Fields:
    """Write samples, shape (channels, samples) [V]; return samples per channel written.

    ``request`` contains the timeout, and whether to start a stopped task.
    Raises DaqmxRefusal: -200561 for values beyond a channel's limits (nothing is clipped), -200292 for a full
    buffer, -200290 after an underflow.
    """
    for row, channel in enumerate(task.outputs):
        channel.check(volts[row])
    if task.kind is SampleTimingType.ON_DEMAND:
        _write_on_demand(task, volts, starts_task=request.auto_start)
    elif task.is_running:
        _write_running(task, volts, deadline(request.timeout))
    else:
        buffer, count = task.output_buffer, volts.shape[1]
        missing = buffer.written + count - buffer.size
        if missing > 0 and not buffer.is_sized:
            check_memory(buffer.size + missing, len(task.outputs))
            buffer.grow(missing)
        elif missing > 0:
            detail = (
                f"Buffer: {buffer.size} samples per channel; already written {buffer.written}, "
                f"now {count} more"
            )
            raise DaqmxRefusal(DAQmxErrors.NO_MORE_SPACE, detail, samples_written=0)
        buffer.write(volts)
        if request.auto_start:
            task.start()
    return {"samps_per_chan_written": volts.shape[1]}


def _write_on_demand(task: Task, volts: NDArray[np.float64], *, starts_task: bool) -> None:
    if not task.is_running:
        if not starts_task:
            code = DAQmxErrors.CANNOT_WRITE_WHEN_AUTO_START_FALSE_AND_TASK_NOT_RUNNING
            raise task.refusal(code, samples_written=0)
        task.start()
    for channel, row in zip(task.outputs, volts, strict=True):
        task.rig.world.silence(channel.physical)
        task.rig.world.play(channel.physical, row, channel.side.rates.maximum_hz)


def _write_running(task: Task, volts: NDArray[np.float64], deadline_s: float) -> None:
    count, written = volts.shape[1], 0
    while written < count:
        piece = min(count - written, task.output_buffer.size)
        if (generation := task.generation) is not None:
            is_there, until_s = partial(generation.has_room, piece), generation.time_of_room(piece)
            has_come = _await(task, generation, until_s, is_there, deadline_s)
            if generation.failure is not None:
                raise generation.failure
            if not has_come:
                raise task.refusal(DAQmxErrors.SAMPLES_CAN_NOT_YET_BE_WRITTEN, samples_written=written)
        task.output_buffer.write(volts[:, written : written + piece])
        written += piece


_SECONDS_1904_TO_1970 = 2_082_844_800
"""Seconds from 1904, the origin of NI's time stamps, to 1970."""


def _read_array(task: Task, request: Any, convert: Callable[[Task, Reading], NDArray[Any]]) -> Fields:
    """Read and convert samples in the caller's layout; "all" means as many as fit into the caller's array."""
    channels = max(1, len(task.channels))
    room = request.array_size_in_samps // channels
    wanted = request.num_samps_per_chan
    if wanted < 0:
        wanted = room if not task.is_running else min(room, default_samples(task))
    if wanted > room:
        detail = f"Room for {room} samples per channel, {wanted} requested"
        raise DaqmxRefusal(DAQmxErrors.READ_BUFFER_TOO_SMALL, detail, samples_read=0)
    reading = read(task, wanted, deadline(request.timeout))
    values = convert(task, reading)
    if pick(request, "fill_mode") == FillMode.GROUP_BY_SCAN_NUMBER.value:
        values = values.T
    elif reading.samples < room and channels > 1:  # pad the rows to the spacing of the caller's array
        values = np.pad(values, ((0, 0), (0, room - reading.samples)))
    return {
        "status": reading.status,
        "read_array": values.ravel().tolist(),
        "samps_per_chan_read": reading.samples,
    }


def _read_waveforms(task: Task, request: Any) -> Fields:
    reading = read(task, request.num_samps_per_chan, deadline(request.timeout))
    waveforms = [_waveform(task, row, reading) for row in range(len(task.inputs))]
    return {"status": reading.status, "waveforms": waveforms, "samps_per_chan_read": reading.samples}


def _waveform(task: Task, row: int, reading: Reading) -> DoubleAnalogWaveform:
    """Return the samples of one channel with start time, interval, name and unit."""
    waveform = DoubleAnalogWaveform(y_data=reading.volts[row], dt=1 / task.rate_hz)
    part_s, whole_s = math.modf(task.rig.wall_s(reading.began_s))
    waveform.t0.seconds = int(whole_s) + _SECONDS_1904_TO_1970
    waveform.t0.fractional_seconds = int(part_s * 2**64)
    waveform.attributes["NI_ChannelName"].string_value = task.inputs[row].name
    waveform.attributes["NI_UnitDescription"].string_value = "Volts"
    return waveform


def _read_raw(task: Task, request: Any) -> Fields:
    reading = read(task, request.num_samps_per_chan, deadline(request.timeout))
    if reading.status:  # incomplete samples are of no use to the caller
        raise DaqmxRefusal(reading.status, samples_read=reading.samples)
    size = task.inputs[0].raw_bits // 8
    raw = np.ascontiguousarray(_counts(task, reading).T).astype(f"<i{size}").tobytes()
    return {"read_array": raw, "samps_read": reading.samples, "num_bytes_per_samp": size * len(task.inputs)}


def _write(task: Task, request: Any) -> Fields:
    values = np.array(request.write_array, dtype=np.float64)
    samples = request.num_samps_per_chan
    _check_size(task, values.size, samples)
    is_by_scan = pick(request, "data_layout") == FillMode.GROUP_BY_SCAN_NUMBER.value
    rows = values.reshape(samples, -1).T if is_by_scan else values.reshape(-1, samples)
    return write(task, rows, request)


def _write_waveforms(task: Task, request: Any) -> Fields:
    rows = [np.array(waveform.y_data) for waveform in request.waveforms]
    if len({row.size for row in rows}) != 1:
        raise unsupported_value("number of waveforms", len(rows), "one per channel, all of the same length")
    _check_size(task, sum(row.size for row in rows), rows[0].size)
    return write(task, np.stack(rows), request)


def _counts(task: Task, reading: Reading) -> NDArray[np.int64]:
    steps = np.array([[channel.volts_per_count] for channel in task.inputs])
    largest = 2 ** (task.inputs[0].side.bits - 1)
    counts = np.clip(np.rint(reading.volts / steps), -largest, largest - 1)
    return np.asarray(counts, dtype=np.int64)


def _check_size(task: Task, size: int, samples: int) -> None:
    """Refuse writes to a task without outputs, or with a number of values that does not fit the channels."""
    if not task.outputs:
        task.require_channels()
        raise task.refusal(DAQmxErrors.WRITE_NO_OUTPUT_CHANS_IN_TASK)
    if size != samples * len(task.outputs):
        detail = (
            f"{size} values for {len(task.outputs)} channels of {samples} samples\nTask Name: {task.name}"
        )
        raise DaqmxRefusal(DAQmxErrors.WRITE_NUM_CHANS_MISMATCH, detail, samples_written=0)


DATA_CALLS: Mapping[str, TaskCall] = {
    "ReadAnalogF64": lambda task, request: _read_array(task, request, lambda _, reading: reading.volts),
    "ReadAnalogWaveforms": _read_waveforms,
    "ReadRaw": _read_raw,
    "ReadBinaryI32": lambda task, request: _read_array(task, request, _counts),
    "WriteAnalogF64": _write,
    "WriteAnalogWaveforms": _write_waveforms,
}
