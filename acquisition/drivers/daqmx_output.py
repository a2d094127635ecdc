"""An analogue output that streams samples ahead of time, never repeats old ones, and ends at zero."""

from contextlib import ExitStack
from dataclasses import dataclass
from typing import Self

import numpy as np
from nidaqmx import Task
from nidaqmx.constants import AcquisitionType, RegenerationMode
from nidaqmx.stream_writers import AnalogSingleChannelWriter

from ..errors import InstrumentError, LimitExceeded, SettingRefused
from ..instruments import Samples
from .daqmx import DaqmxDigitizer
from .daqmx_errors import daqmx_call

_WRITE_TIMEOUT_S = 10.0
# The last of them is what the output holds; some devices want more than one.
_ZERO_SAMPLES = 64
# Two oscillators of one device differ by nothing; a rate that is off by more is another rate.
_SAME_RATE = 1e-6


@dataclass(frozen=True)
class OutputConfig:
    """An analogue output that drives the amplifier in the generator's place."""

    physical: str
    """Full name: ``"Dev1/ao0"``."""
    limit_v: float
    """Largest voltage that this bench allows, plus and minus [V]."""
    sample_rate_hz: float
    ahead_s: float = 1.0
    """How much is written ahead: what a pause of this computer may last [s]."""


class DaqmxOutput:
    """A streamed output, started by the same trigger as the inputs.

    ``open``, ``write`` the first stretch, ``arm``, then start the digitizer: both begin with sample
    0. Go on writing while `space` allows. End with a stretch that fades to zero, wait until it has
    been played (`unplayed`), and `stop`, which goes to zero volts at once.
    """

    def __init__(self, config: OutputConfig, digitizer: DaqmxDigitizer) -> None:
        self._config = config
        self._digitizer = digitizer
        self._resources = ExitStack()
        self._task: Task | None = None
        self._written = 0
        self._is_armed = False

    @classmethod
    def open(cls, config: OutputConfig, digitizer: DaqmxDigitizer) -> Self:
        """Reserve the output on the digitizer's driver; nothing is played yet.

        Raises
        ------
        SettingRefused
            When the device takes another sample rate than the one asked for.
        InstrumentError
            As `daqmx_errors` tells them apart; nothing stays reserved then.

        """
        output = cls(config, digitizer)
        with ExitStack() as undo:
            undo.callback(output._resources.close)
            trigger = digitizer.start_trigger()
            with daqmx_call(f"opening {config.physical}"):
                output._reserve(trigger)
            undo.pop_all()
        return output

    @property
    def ahead_samples(self) -> int:
        """How many samples fit in front of what is being played."""
        return int(self._config.ahead_s * self._config.sample_rate_hz)

    @property
    def space(self) -> int:
        """How many samples can be written now without waiting."""
        task = self._open_task()
        if not self._is_armed:
            return self.ahead_samples - self._written
        with daqmx_call(f"asking {self._config.physical} for space"):
            played = int(task.out_stream.total_samp_per_chan_generated)
        return self.ahead_samples - (self._written - played)

    @property
    def unplayed(self) -> int:
        """How many written samples are still to be played."""
        return self.ahead_samples - self.space

    def write(self, volts: Samples) -> None:
        """Put samples behind those that are still to be played; wait for room when there is none.

        Raises
        ------
        LimitExceeded
            When a sample is past the limit of the bench, or no number. Nothing was written.
        DataLost
            When the output ran dry before: it has stopped.

        """
        peak_v = float(np.max(np.abs(volts), initial=0.0))
        if not peak_v <= self._config.limit_v:  # so that a NaN does not pass
            raise LimitExceeded(
                f"{self._config.physical} was to play a peak of {peak_v:g} V; {self._config.limit_v:g} V are "
                "allowed here. Nothing was written; lower the amplitude"
            )
        task = self._open_task()
        with daqmx_call(f"writing {volts.size} samples to {self._config.physical}"):
            writer = AnalogSingleChannelWriter(task.out_stream, auto_start=False)
            writer.write_many_sample(np.ascontiguousarray(volts), _WRITE_TIMEOUT_S)
        self._written += volts.size

    def arm(self) -> None:
        """Wait for the inputs to start: call it before the digitizer's ``start``."""
        task = self._open_task()
        if self._written == 0:
            raise InstrumentError(
                f"{self._config.physical} has nothing to play; write the first stretch, then arm"
            )
        with daqmx_call(f"arming {self._config.physical}"):
            task.start()
        self._is_armed = True

    def stop(self) -> None:
        """Stop playing and go to zero volts at once. Legal at any time."""
        if self._task is None:
            return
        task, self._task, self._is_armed = self._task, None, False
        with ExitStack() as last:
            last.callback(self._to_zero)  # also when stopping fails: devices may hold their last value
            last.callback(self._resources.close)
            with daqmx_call(f"stopping {self._config.physical}"):
                task.stop()

    def close(self) -> None:
        """Release the output, at zero volts. Legal at any time."""
        self.stop()

    def _reserve(self, trigger: str) -> None:
        config = self._config
        self._task = task = self._resources.enter_context(Task(grpc_options=self._digitizer.session.options))
        self._add_channel(task)
        task.timing.cfg_samp_clk_timing(
            config.sample_rate_hz, sample_mode=AcquisitionType.CONTINUOUS, samps_per_chan=self.ahead_samples
        )
        rate_hz = float(task.timing.samp_clk_rate)
        if abs(rate_hz - config.sample_rate_hz) > _SAME_RATE * config.sample_rate_hz:
            raise SettingRefused(
                f"{config.physical} was asked for {config.sample_rate_hz:g} samples a second and takes "
                f"{rate_hz:g}: every frequency would be off. It was released; ask for a rate that it has"
            )
        task.out_stream.regen_mode = RegenerationMode.DONT_ALLOW_REGENERATION
        task.out_stream.output_buf_size = self.ahead_samples
        task.triggers.start_trigger.cfg_dig_edge_start_trig(trigger)

    def _to_zero(self) -> None:
        with (
            daqmx_call(f"setting {self._config.physical} to zero"),
            Task(grpc_options=self._digitizer.session.options) as task,
        ):
            self._add_channel(task)
            # Clocked, since delta-sigma outputs know no other way.
            zeros = np.zeros(_ZERO_SAMPLES)
            task.timing.cfg_samp_clk_timing(
                self._config.sample_rate_hz, sample_mode=AcquisitionType.FINITE, samps_per_chan=zeros.size
            )
            task.write(zeros, auto_start=True)
            task.wait_until_done(_WRITE_TIMEOUT_S)

    def _add_channel(self, task: Task) -> None:
        limit_v = self._config.limit_v
        task.ao_channels.add_ao_voltage_chan(self._config.physical, min_val=-limit_v, max_val=limit_v)

    def _open_task(self) -> Task:
        if self._task is None:
            raise InstrumentError(f"{self._config.physical} is stopped; open it again for the next run")
        return self._task
