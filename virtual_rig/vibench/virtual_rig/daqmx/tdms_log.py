"""Logging what is read to TDMS, as the driver does it, written by this process."""

from collections.abc import Callable
from importlib.util import find_spec

import numpy as np
from nidaqmx.error_codes import DAQmxErrors
from numpy.typing import NDArray

from vibench.acquisition import ConfigurationError

from .channels import InputChannel
from .errors import DaqmxRefusal
from .timing import LogSettings


class TdmsLog:
    """The file of one run of a task; needs npTDMS."""

    def __init__(
        self,
        settings: LogSettings,
        inputs: list[InputChannel],
        rate_hz: float,
        wall_s: Callable[[float], float],
    ) -> None:
        """Make the file, in the place of one that is there."""
        if find_spec("nptdms") is None:
            raise ConfigurationError(
                "Logging needs npTDMS where the virtual rig runs: pip install 'vibench[exchange]'"
            )
        self._settings = settings
        self._inputs = inputs
        self._interval_s = 1 / rate_hz
        self._wall_s = wall_s
        self._began: np.datetime64 | None = None
        try:
            settings.path.write_bytes(b"")
        except OSError as error:
            raise DaqmxRefusal(DAQmxErrors.GENERIC_FILE_IO, f"File: {settings.path}\n{error}") from error

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
