"""Logging to TDMS, as the driver does it: what is read, or all that is acquired, written by this process."""

from collections.abc import Callable
from importlib.util import find_spec

import numpy as np
from nidaqmx.constants import LoggingMode, LoggingOperation
from nidaqmx.error_codes import DAQmxErrors
from numpy.typing import NDArray

from vibench.acquisition import ConfigurationError

from ._channels import InputChannel
from ._errors import DaqmxRefusal
from ._timing import LogSettings

_MUST_EXIST = {LoggingOperation.OPEN: True, LoggingOperation.CREATE: False}


class TdmsLog:
    """The file of one run of a task; needs npTDMS."""

    def __init__(
        self,
        settings: LogSettings,
        inputs: list[InputChannel],
        rate_hz: float,
        wall_s: Callable[[float], float],
    ) -> None:
        """Make or open the file (-201310, -201309 where that is not possible)."""
        if find_spec("nptdms") is None:
            raise ConfigurationError(
                "Logging needs npTDMS where the virtual rig runs: pip install 'vibench[exchange]'"
            )
        self._settings = settings
        self._inputs = inputs
        self._interval_s = 1 / rate_hz
        self._wall_s = wall_s
        self._began: np.datetime64 | None = None
        if _MUST_EXIST.get(settings.operation, settings.path.exists()) is not settings.path.exists():
            is_missing = settings.operation is LoggingOperation.OPEN
            code = DAQmxErrors.TDMS_NOT_FOUND if is_missing else DAQmxErrors.GENERIC_FILE_IO
            raise DaqmxRefusal(code, f"File: {settings.path}\nOperation: {settings.operation.name}")
        try:
            with settings.path.open(
                "wb" if settings.operation is LoggingOperation.CREATE_OR_REPLACE else "ab"
            ):
                pass
        except OSError as error:
            raise DaqmxRefusal(DAQmxErrors.GENERIC_FILE_IO, f"File: {settings.path}\n{error}") from error

    @property
    def is_read(self) -> bool:
        """Whether what is logged is what the program reads; else it is all that is acquired."""
        return self._settings.mode is LoggingMode.LOG_AND_READ

    def write(self, volts: NDArray[np.float64], began_s: float) -> None:
        """Append samples, shape (channels, samples) [V]; the first of them at rig time ``began_s``."""
        from nptdms import ChannelObject, TdmsWriter  # noqa: PLC0415 - an extra; few programs log

        self._began = self._began or np.datetime64(round(self._wall_s(began_s) * 1e6), "us")
        with TdmsWriter(self._settings.path, mode="a") as file:
            file.write_segment(
                [
                    ChannelObject(
                        self._settings.group,
                        channel.name,
                        row,
                        {
                            "wf_start_time": self._began,
                            "wf_increment": self._interval_s,
                            "unit_string": "Volts",
                        },
                    )
                    for channel, row in zip(self._inputs, volts, strict=True)
                ]
            )
