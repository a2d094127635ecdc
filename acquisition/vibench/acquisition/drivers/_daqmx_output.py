"""Analogue output that plays samples written ahead of time, never repeats them, and ends at zero volts."""

from contextlib import ExitStack, suppress
from dataclasses import replace
from typing import Self

import numpy as np
from nidaqmx import Task
from nidaqmx.constants import AcquisitionType, AOIdleOutputBehavior, RegenerationMode, TaskMode
from nidaqmx.errors import DaqError
from nidaqmx.stream_writers import AnalogSingleChannelWriter
from nidaqmx.task.channels import AOChannel

from ..errors import DataLost, InstrumentError, InstrumentLost, SettingRefused
from ..instruments import Identity, IdleOutput, Samples
from ..rig import OutputConfig
from ._daqmx import DaqmxDigitizer, daqmx_identity
from ._daqmx_errors import daqmx_call
from ._limits import require_playable

_WRITE_TIMEOUT_S = 10.0
# The output holds the last value, so zeros are written at the end. Some devices need more than one zero.
_ZERO_SAMPLES = 64
# Largest rounding error of the rate read back; a larger deviation means a different rate.
_SAME_RATE = 1e-6


class DaqmxOutput:
    """An `AnalogOutput` on NI-DAQmx, started by the same trigger as the inputs.

    ``open`` it, ``write`` the first samples, ``arm`` it, then start the digitizer: both begin with sample 0.
    Then keep writing as fast as samples are played. `stop` goes to zero volts at once; the next ``write``
    begins a new stream. If the program dies, the output runs out of samples within ``ahead_s`` and stops.
    """

    def __init__(self, physical: str, config: OutputConfig, digitizer: DaqmxDigitizer) -> None:
        self._physical = physical
        self._config = config
        self.sample_rate_hz = config.sample_rate_hz
        """Sample rate, which was requested and which the device accepted."""
        self.ahead_samples = int(config.ahead_s * config.sample_rate_hz)
        """Largest number of samples that can be written ahead of the sample being played."""
        self._digitizer = digitizer
        self._resources = ExitStack()
        self._task: Task | None = None
        self._written = 0
        self._is_zero = True
        """Whether the output is at zero volts and nothing is reserved; if not, `stop` sets it to zero."""
        self._is_open = True
        self.idle = IdleOutput.HELD
        """Voltage of the output after its last sample, as read back: zero if the device can do this."""

    @classmethod
    def open(cls, physical: str, config: OutputConfig, digitizer: DaqmxDigitizer) -> Self:
        """Set an output to zero volts, reserve it on the digitizer's driver, and return it.

        Parameters
        ----------
        physical
            Full name: ``"Dev1/ao0"``.

        Raises
        ------
        SettingRefused
            When the device uses a sample rate other than the requested rate.
        InstrumentError
            As listed in `_daqmx_errors`; afterwards, nothing stays reserved.
        """
        output = cls(physical, config, digitizer)
        output._to_zero()
        output._reserve()
        return output

    @property
    def identity(self) -> Identity:
        """Identity of the output's module; its reply contains the name of the output."""
        device, _, _ = self._physical.rpartition("/")
        with daqmx_call(f"identifying {self._physical}"):
            module = daqmx_identity(self._digitizer.session, device)
        return replace(module, reply=f"{self._physical} of {module.reply}")

    def write(self, volts: Samples) -> None:
        """Add samples after those still to be played; wait if the buffer is full.

        Raises
        ------
        LimitExceeded
            When a sample is beyond the limit of the bench, or NaN. Nothing was written.
        DataLost
            When the output has run out of samples and stopped.
        """
        require_playable(volts, self._physical, self._config.limit_v, is_open=self._is_open)
        task = self._task or self._reserve()
        with daqmx_call(f"writing {volts.size} samples to {self._physical}"):
            writer = AnalogSingleChannelWriter(task.out_stream, auto_start=False)
            writer.write_many_sample(np.ascontiguousarray(volts), _WRITE_TIMEOUT_S)
        self._written += volts.size

    def arm(self) -> None:
        """Let the output start together with the inputs; call this before the digitizer's ``start``."""
        if self._task is None or self._written == 0:
            raise InstrumentError(f"{self._physical} has nothing to play; write the first samples, then arm")
        with daqmx_call(f"arming {self._physical}"):
            self._task.start()

    def stop(self) -> None:
        """Stop playing and go to zero volts at once. May be called at any time.

        Raises InstrumentLost when the device or its server is gone: samples already written still play.
        """
        if self._is_zero:
            return
        task, self._task, self._written = self._task, None, 0
        try:
            with ExitStack() as last:
                last.callback(self._to_zero)  # even if stopping fails: devices may hold the last value
                last.callback(self._release)
                # Ignore this error, which an output without samples raises again although it has stopped.
                last.enter_context(suppress(DataLost))
                if task is not None:
                    with daqmx_call(f"stopping {self._physical}"):
                        task.stop()
            self._is_zero = True
        except InstrumentLost as error:
            raise InstrumentLost(
                f"{error}. {self._physical} MAY STILL BE PLAYING the samples that were written ahead, at "
                f"most {self._config.ahead_s:g} s; some devices then hold the last value: switch the "
                "amplifier off"
            ) from error

    def close(self) -> None:
        """Set the output to zero volts and release it. May be called at any time."""
        self._is_open = False
        if self._task is not None:  # no task means that `stop` has succeeded or raised an error
            self.stop()

    def _reserve(self) -> Task:
        config, physical = self._config, self._physical
        trigger = self._digitizer.start_trigger()
        with ExitStack() as undo, daqmx_call(f"opening {physical}"):
            undo.callback(self._resources.close)
            task = self._resources.enter_context(Task(grpc_options=self._digitizer.session.options))
            self.idle = _set_idle_output(self._add_channel(task))
            task.timing.cfg_samp_clk_timing(
                config.sample_rate_hz,
                sample_mode=AcquisitionType.CONTINUOUS,
                samps_per_chan=self.ahead_samples,
            )
            rate_hz = float(task.timing.samp_clk_rate)
            if not abs(rate_hz - config.sample_rate_hz) <= _SAME_RATE * config.sample_rate_hz:
                raise SettingRefused(
                    f"{physical} was set to {config.sample_rate_hz:g} samples a second, but uses "
                    f"{rate_hz:g}: every frequency would be wrong. The output was released; set "
                    "daq.output.sample_rate_hz to a rate that the device supports"
                )
            task.out_stream.regen_mode = RegenerationMode.DONT_ALLOW_REGENERATION
            task.out_stream.output_buf_size = self.ahead_samples
            task.triggers.start_trigger.cfg_dig_edge_start_trig(trigger)
            task.control(TaskMode.TASK_RESERVE)
            undo.pop_all()
        self._task, self._is_zero = task, False
        return task

    def _release(self) -> None:
        with daqmx_call(f"releasing {self._physical}"):
            self._resources.close()

    def _to_zero(self) -> None:
        with (
            daqmx_call(f"setting {self._physical} to zero"),
            Task(grpc_options=self._digitizer.session.options) as task,
        ):
            self._add_channel(task)
            # Delta-sigma outputs need a clock.
            zeros = np.zeros(_ZERO_SAMPLES)
            task.timing.cfg_samp_clk_timing(
                self._config.sample_rate_hz, sample_mode=AcquisitionType.FINITE, samps_per_chan=zeros.size
            )
            task.write(zeros, auto_start=True)
            task.wait_until_done(_WRITE_TIMEOUT_S)

    def _add_channel(self, task: Task) -> AOChannel:
        limit_v = self._config.limit_v
        return task.ao_channels.add_ao_voltage_chan(self._physical, min_val=-limit_v, max_val=limit_v)


def _set_idle_output(channel: AOChannel) -> IdleOutput:
    """Set the idle output to zero volts (many devices hold the last value); return the value read back."""
    # A device that cannot hold zero refuses the setting; a device without this setting refuses the query.
    with suppress(DaqError):
        channel.ao_idle_output_behavior = AOIdleOutputBehavior.ZERO_VOLTS
        if channel.ao_idle_output_behavior is AOIdleOutputBehavior.ZERO_VOLTS:
            return IdleOutput.ZERO
    return IdleOutput.HELD
