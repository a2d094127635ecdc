"""Samples that the simulated driver logs to TDMS, read back with npTDMS."""

from datetime import UTC, datetime

import numpy as np
import pytest
from nidaqmx.constants import AcquisitionType, LoggingMode, LoggingOperation
from nidaqmx.error_codes import DAQmxErrors
from nptdms import TdmsFile

from tests.virtual_rig.conftest import daq_error

RATE_HZ = 2000.0


@pytest.fixture
def task(daq):
    task = daq.task("shaken")
    task.ai_channels.add_ai_voltage_chan("Dev1/ai1")
    task.ai_channels.add_ai_voltage_chan("Dev1/ai2")
    task.timing.cfg_samp_clk_timing(RATE_HZ, sample_mode=AcquisitionType.CONTINUOUS)
    return task


def logging(task, path, mode=LoggingMode.LOG_AND_READ, operation=LoggingOperation.CREATE_OR_REPLACE, **more):
    task.in_stream.configure_logging(str(path), mode, operation=operation, **more)


def read_log(path, group="shaken"):
    with TdmsFile.open(path) as file:
        return {channel.name: (channel[:], dict(channel.properties)) for channel in file[group].channels()}


def test_the_log_file_contains_the_samples_the_units_the_interval_and_the_start(task, tmp_path):
    logging(task, tmp_path / "read.tdms")
    task.start()
    before = datetime.now(UTC)
    read = np.hstack([task.read(700), task.read(64)])
    task.stop()
    found = read_log(tmp_path / "read.tdms")
    assert list(found) == ["Dev1/ai1", "Dev1/ai2"]
    for (volts, properties), row in zip(found.values(), read, strict=True):
        np.testing.assert_array_equal(volts, row)
        assert (properties["unit_string"], properties["wf_increment"]) == ("Volts", 1 / RATE_HZ)
        began = properties["wf_start_time"].astype(datetime).replace(tzinfo=UTC)
        assert abs((began - before).total_seconds()) < 60


def test_log_files_are_replaced_and_other_logging_modes_are_refused(task, tmp_path):
    path = tmp_path / "some.tdms"
    for samples in (100, 64):
        logging(task, path)
        task.start()
        task.read(samples)
        task.stop()
        assert len(read_log(path)["Dev1/ai1"][0]) == samples
    for refusal in (
        lambda: logging(task, path, LoggingMode.LOG),
        lambda: logging(task, path, operation=LoggingOperation.OPEN),
    ):
        with daq_error(DAQmxErrors.INVALID_ATTRIBUTE_VALUE):
            refusal()
    logging(task, tmp_path / "no_folder" / "x.tdms")
    with daq_error(DAQmxErrors.GENERIC_FILE_IO):
        task.start()
    logging(task, path, LoggingMode.OFF)
    task.start()
    assert len(task.read(10)) == 2


def test_the_logging_of_outputs_is_refused(daq, tmp_path):
    output = daq.outputs("Dev1/ao0", 1)
    with daq_error(DAQmxErrors.LOGGING_NOT_SUPPORT_ON_OUTPUT_TASKS):
        logging(output, tmp_path / "x")
