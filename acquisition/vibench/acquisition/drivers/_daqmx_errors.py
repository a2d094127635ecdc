"""Table of DAQmx errors: what each error means for a measurement, and advice.

Numbers and names: ``nidaqmx.error_codes.DAQmxErrors``; meanings: NI-DAQmx help and hardware reference 5.3.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import grpc
from nidaqmx.error_codes import DAQmxErrors as Code
from nidaqmx.errors import DaqError, Error, RpcError

from ..errors import (
    AcquisitionError,
    ConfigurationError,
    DataLost,
    InstrumentBusy,
    InstrumentError,
    InstrumentLost,
)


@dataclass(frozen=True)
class Meaning:
    """Explanation of one DAQmx error code for the operator."""

    kind: type[AcquisitionError]
    happened: str
    advice: str


_LOST = "samples were overwritten before they were read, so samples are missing and the recording ends here"
_SLOWER = "read more often, lower the sample rate, or close other programs that load this computer"
_BUSY = "the device is in use by another program, or by a task that was never closed"
_RELEASE = "close that program (or restart the device server, or reset the device), then open the bench again"
_GONE = "the device cannot be reached"
_RECONNECT = "check the device's cable and power, then open the bench again"
_UNDERFLOW = "the output ran out of samples and stopped; some devices then hold the last value"
_FEED = "write further ahead, or lower the output's sample rate"
_CONFIGURE = "correct [daq] in the hardware configuration; `vibench bench list` shows the connected devices"

MEANINGS: dict[Code, Meaning] = {
    Code.SAMPLES_NO_LONGER_AVAILABLE: Meaning(DataLost, _LOST, _SLOWER),
    Code.INPUT_FIFO_OVERFLOW_2: Meaning(DataLost, "the memory of the device overflowed: " + _LOST, _SLOWER),
    Code.INPUT_FIFO_OVERFLOW: Meaning(DataLost, "the memory of the device overflowed: " + _LOST, _SLOWER),
    Code.ACQ_STOPPED_DRIVER_CANT_XFER_DATA_FAST_ENOUGH: Meaning(
        DataLost,
        "the bus was too slow: " + _LOST,
        "give the device its own USB port, or lower the sample rate",
    ),
    Code.SAMPLES_NOT_YET_AVAILABLE: Meaning(
        InstrumentError,
        "the samples did not come in time",
        "check that the sample clock runs and that the device is connected, then start the run again",
    ),
    Code.SAMPLES_WILL_NEVER_BE_AVAILABLE: Meaning(
        InstrumentError, "samples were requested past the end of the acquisition", "start the run again"
    ),
    Code.PAL_RESOURCE_RESERVED: Meaning(InstrumentBusy, _BUSY, _RELEASE),
    Code.RESOURCE_ALREADY_RESERVED: Meaning(InstrumentBusy, _BUSY, _RELEASE),
    Code.INVALID_ATTRIBUTE_VALUE: Meaning(
        ConfigurationError, "the requested rate, range, coupling or current is not supported", _CONFIGURE
    ),
    Code.INVALID_DEVICE_ID: Meaning(
        ConfigurationError, "the driver knows no device with this name", _CONFIGURE
    ),
    Code.PHYSICAL_CHAN_DOES_NOT_EXIST: Meaning(
        ConfigurationError, "the device has no such channel", _CONFIGURE
    ),
    Code.DEV_CANNOT_BE_ACCESSED: Meaning(InstrumentLost, _GONE, _RECONNECT),
    Code.DRIVER_DEVICE_GUID_NOT_FOUND_ROUTING: Meaning(InstrumentLost, _GONE, _RECONNECT),
    Code.RESOURCE_NOT_IN_POOL_ROUTING: Meaning(InstrumentLost, _GONE, _RECONNECT),
    Code.RUNTIME_ABORTING_ROUTING: Meaning(
        InstrumentLost,
        "the device was reset while it ran",
        "find out which program reset the device, then open the bench again",
    ),
    Code.PAL_TRANSFER_ABORTED: Meaning(
        InstrumentLost, "the transfer from the device was interrupted", _RECONNECT
    ),
    Code.GEN_STOPPED_TO_PREVENT_REGEN_OF_OLD_SAMPLES: Meaning(DataLost, _UNDERFLOW, _FEED),
    Code.DAC_UNDERFLOW: Meaning(DataLost, _UNDERFLOW, _FEED),
    Code.OUTPUT_FIFO_UNDERFLOW_2: Meaning(DataLost, _UNDERFLOW, _FEED),
    Code.OUTPUT_FIFO_UNDERFLOW: Meaning(DataLost, _UNDERFLOW, _FEED),
    Code.SAMPLES_CAN_NOT_YET_BE_WRITTEN: Meaning(
        InstrumentError,
        "the output did not accept the next samples in time",
        "check that the sample clock runs: the input that triggers the output must be started first",
    ),
    Code.WAIT_UNTIL_DONE_DOES_NOT_INDICATE_DONE: Meaning(
        InstrumentError, "the output had not finished in time", "check that the sample clock runs"
    ),
    Code.CANNOT_GET_PROPERTY_WHEN_TASK_NOT_RESERVED_COMMITTED_OR_RUNNING: Meaning(
        InstrumentError,
        "a property was read before the device was reserved",
        "report this error: it is a fault of the driver",
    ),
    Code.INVALID_TASK: Meaning(
        InstrumentLost,
        "the driver no longer knows the task: the driver or its server was restarted",
        "open the bench again",
    ),
    Code.CAN_NOT_PERFORM_OP_WHILE_TASK_RUNNING: Meaning(
        InstrumentError, "the task is running", "stop the task before changing it"
    ),
}

# Errors for a property that this device does not have, or that this type of task does not have.
NOT_OFFERED = frozenset({Code.ATTR_NOT_SUPPORTED, Code.ATTRIBUTE_NOT_SUPPORTED_IN_TASK_CONTEXT})

_SERVER_LOST = frozenset({grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.DEADLINE_EXCEEDED})


@contextmanager
def daqmx_call(doing: str) -> Iterator[None]:
    """Turn any failure of the DAQmx client into an error with advice, whose text begins with ``doing``."""
    try:
        yield
    except AcquisitionError:
        raise
    except DaqError as error:
        raise from_code(error, doing) from error
    except RpcError as error:
        raise _from_server(error, doing) from error
    except Error as error:
        raise InstrumentError(
            f"{doing} failed: this computer has no NI-DAQmx driver ({error}). Install the driver, or set "
            "daq.server to the address of a device server"
        ) from error
    except (AssertionError, ArithmeticError, LookupError, NameError, TypeError, ValueError) as error:
        # The client assumes that a reply has the requested size, known values, and a code for every error.
        raise InstrumentError(
            f"{doing} failed: the driver's reply cannot be used ({type(error).__name__}: {error}). Use "
            "matching versions of client, driver and device server, then open the bench again"
        ) from error


def from_code(error: DaqError, doing: str) -> AcquisitionError:
    """Return vibench's error for a DAQmx error; an error that is not in the table keeps its text."""
    text = " ".join(str(error).split())
    meaning = MEANINGS.get(error.error_type)
    if meaning is None:
        return InstrumentError(f"{doing} failed: {text}. Look up the error number in the NI-DAQmx help")
    name = f"{error.error_type.name}, {error.error_code}"
    return meaning.kind(f"{doing} failed: {meaning.happened} ({name}: {text}). To do: {meaning.advice}")


def _from_server(error: RpcError, doing: str) -> InstrumentError:
    if error.rpc_code in _SERVER_LOST:
        return InstrumentLost(
            f"{doing} failed: the device server does not answer ({error}). Start the server or "
            "correct daq.server, then open the bench again"
        )
    return InstrumentError(f"{doing} failed: the device server reported an error ({error}); read its log")
