"""Writing to a simulated task: into the output buffer, or straight to the terminal."""

import math
import time

import numpy as np
from nidaqmx.constants import SampleTimingType
from nidaqmx.error_codes import DAQmxErrors
from numpy.typing import NDArray

from ._errors import DaqmxRefusal
from ._generation import LEAD_S, Generation
from ._tasks import Task
from ._timing import StartsItself


def write(task: Task, values: NDArray[np.float64], start: StartsItself, timeout_s: float) -> int:
    """Write ``values``, shape (channels, samples) in the channels' units; return samples per channel written.

    Raises
    ------
    DaqmxRefusal
        -200561 for values beyond a channel's limits (nothing is clipped), -200292 for a full buffer,
        -200290 after an underflow.

    """
    require_outputs(task)
    volts = np.empty_like(values)
    for row, channel in enumerate(task.outputs):
        channel.check(values[row])
        volts[row] = channel.to_volts(values[row])
    if task.kind is SampleTimingType.ON_DEMAND:
        return _write_on_demand(task, volts, start)
    if task.is_running:
        written = _write_running(task, volts, timeout_s)
    else:
        written = _write_stopped(task, volts)
        if start is StartsItself.YES:
            task.start()
    return written


def require_outputs(task: Task) -> None:
    """Refuse to write to a task without outputs."""
    if not task.outputs:
        task.require_channels()
        raise DaqmxRefusal(DAQmxErrors.WRITE_NO_OUTPUT_CHANS_IN_TASK, f"Task Name: {task.name}")


def _write_on_demand(task: Task, volts: NDArray[np.float64], start: StartsItself) -> int:
    if not task.is_running:
        if start is StartsItself.NO:
            code = DAQmxErrors.CANNOT_WRITE_WHEN_AUTO_START_FALSE_AND_TASK_NOT_RUNNING
            raise DaqmxRefusal(code, f"Task Name: {task.name}", samples_written=0)
        task.start()
    for channel, row in zip(task.outputs, volts, strict=True):
        task.rig.world.silence(channel.physical)
        task.rig.world.play(channel.physical, row, channel.outputs.rates.maximum_hz)
    return int(volts.shape[1])


def _write_stopped(task: Task, volts: NDArray[np.float64]) -> int:
    buffer, count = task.output_buffer, volts.shape[1]
    missing = buffer.written + count - buffer.size
    if missing > 0 and not buffer.is_sized:
        buffer.grow(missing)
    elif missing > 0:
        detail = (
            f"Buffer: {buffer.size} samples per channel; already written {buffer.written}, now {count} more"
        )
        raise DaqmxRefusal(DAQmxErrors.NO_MORE_SPACE, detail, samples_written=0)
    buffer.write(volts)
    return int(count)


def _write_running(task: Task, volts: NDArray[np.float64], timeout_s: float) -> int:
    deadline_s = math.inf if timeout_s < 0 else time.monotonic() + timeout_s
    count, written = volts.shape[1], 0
    while written < count:
        piece = min(count - written, task.output_buffer.size)
        if task.generation is not None and not _await_space(task, task.generation, piece, deadline_s):
            raise DaqmxRefusal(
                DAQmxErrors.SAMPLES_CAN_NOT_YET_BE_WRITTEN, f"Task Name: {task.name}", samples_written=written
            )
        task.output_buffer.write(volts[:, written : written + piece])
        written += piece
    return written


def _await_space(task: Task, generation: Generation, samples: int, deadline_s: float) -> bool:
    def is_there() -> bool:
        has_ended = generation.failure is not None or task.generation is not generation
        return generation.space >= samples or has_ended

    played = generation.buffer.written + samples - generation.buffer.size
    left_s = -1.0 if math.isinf(deadline_s) else max(0.0, deadline_s - time.monotonic())
    has_come = task.rig.pace.ask(task.rig, generation.time_of(played) - LEAD_S, is_there, left_s)
    if generation.failure is not None:
        raise generation.failure
    if task.generation is not generation:
        raise DaqmxRefusal(DAQmxErrors.RUNTIME_ABORTED_ROUTING, f"Task Name: {task.name}", samples_written=0)
    return has_come
