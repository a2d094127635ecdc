"""The reference trigger of a simulated task: what it may be, and the edge among the samples."""

import math
from collections.abc import Callable, Sequence

import numpy as np
from nidaqmx.constants import AcquisitionType, Slope
from nidaqmx.error_codes import DAQmxErrors
from numpy.typing import NDArray

from ._channels import InputChannel
from ._errors import DaqmxRefusal, unsupported_value
from ._timing import ReferenceTrigger, Timing

_LEAST_PRETRIGGER = 2


def verify_reference(
    timing: Timing, inputs: Sequence[InputChannel], require_terminal: Callable[[str], None]
) -> None:
    """Refuse a reference trigger that the device cannot wait for, or a task that cannot have one."""
    reference = timing.reference
    if reference is None:
        return
    if timing.mode is not AcquisitionType.FINITE:
        raise DaqmxRefusal(DAQmxErrors.REF_TRIG_WHEN_CONTINUOUS)
    most = timing.samples - _LEAST_PRETRIGGER
    if not _LEAST_PRETRIGGER <= reference.pretrigger <= most:
        allowed = f"{_LEAST_PRETRIGGER} to {most} of {timing.samples} samples"
        raise unsupported_value("RefTrig_PretrigSamples", reference.pretrigger, allowed)
    if reference.level is None:
        require_terminal(reference.source)
    elif not all(channel.inputs.has_analog_trigger for channel in inputs):
        product = inputs[0].device.product_type
        raise unsupported_value("RefTrig_Type", "ANALOG_EDGE", f"NONE, DIGITAL_EDGE on the {product}")


class TriggerWatch:
    """Looks for a reference trigger among the samples of a task."""

    def __init__(self, trigger: ReferenceTrigger, samples: int, inputs: Sequence[InputChannel]) -> None:
        """Keep ``samples`` around ``trigger``; an analogue one is an edge of the input that it names."""
        self.trigger = trigger
        self.samples = samples
        self._sign = 1.0 if trigger.slope is Slope.RISING else -1.0
        self._last = math.nan
        if trigger.level is not None:
            self._row = [channel.name.lower() for channel in inputs].index(trigger.source.lower())
            self._level_v = float(inputs[self._row].to_volts(np.array([trigger.level]))[0])

    def edges(self, block: NDArray[np.float64]) -> NDArray[np.intp]:
        """Give the samples of the next block, counted in it, that are the first past the level."""
        if self.trigger.level is None:
            return np.empty(0, dtype=np.intp)
        above = self._sign * (np.concatenate([[self._last], block[self._row]]) - self._level_v)
        self._last = float(block[self._row, -1])
        return np.flatnonzero((above[:-1] < 0) & (above[1:] >= 0))
