"""Reading from a simulated task: which samples, how long to wait for them, what if they do not come."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from nidaqmx.constants import AcquisitionType, SampleTimingType
from nidaqmx.error_codes import DAQmxErrors
from numpy.typing import NDArray

from .acquisition import Acquisition
from .errors import DaqmxRefusal
from .tasks import Task
from .timing import check_memory

READ_ALL = -1


@dataclass(frozen=True)
class Reading:
    """What a read brought."""

    volts: NDArray[np.float64]
    """Shape (channels, samples), of all channels of the task [V]."""
    status: int = 0
    """0, or why there are fewer samples than requested."""
    began_s: float = 0.0
    """Rig time of the first of them [s]."""

    @property
    def samples(self) -> int:
        """Samples per channel."""
        return int(self.volts.shape[1])


def read(task: Task, samples: int, timeout_s: float) -> Reading:
    """Read ``samples`` per channel, starting the task if need be; negative ``samples``: all there are.

    Raises
    ------
    DaqmxRefusal
        -200279 for lost samples, -200278 past the end, -200284 if nothing at all came in time.

    """
    require_inputs(task)
    check_memory(samples, len(task.inputs))
    has_to_start = not task.is_running
    if has_to_start:
        task.start()
    if task.kind is SampleTimingType.ON_DEMAND:
        reading = _read_on_demand(task, max(1, samples))
    else:
        wanted = default_samples(task) if samples < 0 else samples
        reading = _read_buffered(task, wanted, timeout_s)
    if has_to_start and _is_used_up(task):
        task.stop()
    return reading


def require_inputs(task: Task) -> None:
    """Refuse to read from a task without inputs."""
    if not task.inputs:
        task.require_channels()
        raise DaqmxRefusal(DAQmxErrors.READ_NO_INPUT_CHANS_IN_TASK, f"Task Name: {task.name}")


def _is_used_up(task: Task) -> bool:
    if task.kind is SampleTimingType.ON_DEMAND:
        return True
    acquisition = task.acquisition
    return acquisition is not None and acquisition.is_done and acquisition.available == 0


def default_samples(task: Task) -> int:
    """How many samples "all" are: a finite task's whole number, a continuous one's unread samples."""
    if task.inputs and task.kind is SampleTimingType.ON_DEMAND:
        return 1
    if task.timing.mode is AcquisitionType.FINITE:
        return task.timing.samples
    return available(task)


def available(task: Task) -> int:
    """Unread samples per channel, as of now; a rig at its own pace lets some come where there are none."""
    if task.acquisition is None:
        return 0
    if task.acquisition.available == 0 and not task.acquisition.is_done:
        task.rig.pace.answer_progress(task.rig)
    return min(task.acquisition.available, task.acquisition.buffer_size)


def newest(task: Task) -> int:
    """Return how many samples per channel have been acquired so far."""
    available(task)
    return task.acquisition.acquired if task.acquisition else 0


def asked_available(task: Task) -> int:
    """Answer how many wait: who asks again without reading polls, and only then a rig lets some come."""
    acquisition = task.acquisition
    if acquisition is None or acquisition.asked_at == acquisition.position:
        return available(task)
    acquisition.asked_at = acquisition.position
    return min(acquisition.available, acquisition.buffer_size)


def _read_on_demand(task: Task, samples: int) -> Reading:
    rate_hz = task.side.rates.maximum_hz / len(task.inputs)
    sampler = task.rig.world.sample(tuple(channel.wiring() for channel in task.inputs), rate_hz)
    volts = sampler.read(samples)
    sampler.close()
    return Reading(volts, began_s=task.rig.now_s - samples / rate_hz)


def _read_buffered(task: Task, wanted: int, timeout_s: float) -> Reading:
    deadline_s = math.inf if timeout_s < 0 else time.monotonic() + timeout_s
    if not _await(task, math.inf, lambda: task.acquisition is not None or not task.is_running, deadline_s):
        return _nothing_in_time(task, wanted)
    acquisition = task.acquisition
    if acquisition is None:
        raise DaqmxRefusal(DAQmxErrors.RUNTIME_ABORTED_ROUTING, f"Task Name: {task.name}", samples_read=0)
    if not task.await_reference(deadline_s):
        return _nothing_in_time(task, wanted)
    first = acquisition.position
    count = int(min(wanted, max(0, acquisition.total - first)))
    status = 0 if count == wanted else int(DAQmxErrors.SAMPLES_WILL_NEVER_BE_AVAILABLE)
    if status and not count:
        raise DaqmxRefusal(status, f"Task Name: {task.name}", samples_read=0)
    blocks, taken = [], 0
    while taken < count:
        piece = min(count - taken, acquisition.buffer_size)
        has_come = _await_samples(task, acquisition, first + taken + piece, deadline_s)
        if not has_come:
            piece = max(0, min(piece, acquisition.acquired - first - taken))
            status = int(DAQmxErrors.SAMPLES_NOT_YET_AVAILABLE)
        blocks.append(acquisition.read_at(first + taken, piece))
        taken += piece
        task.rig.changed.notify_all()
        if not has_come:
            break
    volts = np.concatenate(blocks, axis=1) if blocks else np.empty((len(task.inputs), 0))
    began_s = acquisition.began_s + first / acquisition.rate_hz
    if task.log is not None and volts.size:
        task.log.write(volts, began_s)
    return Reading(volts, status, began_s)


def _nothing_in_time(task: Task, wanted: int) -> Reading:
    status = int(DAQmxErrors.SAMPLES_NOT_YET_AVAILABLE) if wanted else 0
    return Reading(np.empty((len(task.inputs), 0)), status)


def _await_samples(task: Task, acquisition: Acquisition, end: int, deadline_s: float) -> bool:
    def is_there() -> bool:
        return (
            acquisition.acquired >= end
            or acquisition.failure is not None
            or task.acquisition is not acquisition
        )

    has_come = _await(task, acquisition.time_of(end), is_there, deadline_s)
    if task.acquisition is not acquisition:
        raise DaqmxRefusal(DAQmxErrors.RUNTIME_ABORTED_ROUTING, f"Task Name: {task.name}", samples_read=0)
    return has_come


def _await(task: Task, until_s: float, is_there: Callable[[], bool], deadline_s: float) -> bool:
    left_s = -1.0 if math.isinf(deadline_s) else max(0.0, deadline_s - time.monotonic())
    return task.rig.pace.ask(task.rig, until_s, is_there, left_s)
