"""Broken messages to the simulated instruments, as `vibench serve-rig` serves them to any program.

SCPI on the generator's socket, USB frames and DAQmx calls over gRPC, with clients that leave early.
"""

import random
import re
import socket
import struct
import time
from collections.abc import Callable
from contextlib import closing, suppress
from typing import Any

import grpc
from google.protobuf.descriptor import FieldDescriptor
from nidaqmx._stubs import nidaqmx_pb2

from .byte_mutants import EDGES, mutate_bytes
from .limits import LONGEST_S
from .served_process import ServedProcess
from .tally import Finding, Shard, Tally
from .text_mutants import NUMBERS, TEXTS

NAME = "instruments"
DESCRIPTORS_MORE = 40

# --- SCPI ---------------------------------------------------------------------------------

COMMANDS = (
    "*IDN?", "*RST", "*CLS", "*STB?", "*ESR?", "*OPC?", "*SAV 1", "*RCL 1", "*TRG", "*WAI", "*TST?",
    "SYST:ERR?", "SOUR1:FREQ 260", "SOUR1:FREQ?", "SOUR1:VOLT 1.5VPP", "SOUR1:VOLT:OFFS 0",
    "SOUR1:VOLT:UNIT VRMS", "SOUR1:FUNC SIN", "SOUR1:FUNC:SHAP EMEM", "SOUR1:PHAS 1.57", "OUTP1 ON",
    "OUTP1 OFF", "OUTP1:IMP 50", "SOUR1:BURS:STAT ON", "SOUR1:BURS:NCYC 3", "SOUR1:AM:STAT ON",
    "SOUR1:FM:DEV 10", "SOUR1:SWE:TIME 2", "SOUR1:FREQ:MODE SWE", "TRAC:DATA EMEM,#216" + "a" * 16,
    "TRAC:DEF EMEM,8192", "TRAC:DATA? EMEM", "TRAC:POIN EMEM,100", "DATA:DATA:VAL EMEM1,3,100",
    "SOUR1:PULS:DCYC 20", "SYST:BEEP", "TRAC:COPY USER0,EMEM",
)  # fmt: skip
"""Commands of every chapter of the generator's manual."""
_NUMBER = re.compile(r"\d+(?:\.\d+)?")


def broken_scpi(chance: random.Random) -> bytes:
    """Return one line for the generator; it may contain several commands, and its end may be missing."""
    units = []
    for _ in range(chance.choice((1, 1, 1, 2, 5))):
        unit = chance.choice(COMMANDS)
        match chance.randrange(6):
            case 0:
                unit = _NUMBER.sub(lambda _: chance.choice(NUMBERS), unit, count=1)
            case 1:
                unit = f"{unit.split(' ')[0]} {chance.choice((*TEXTS, *NUMBERS))}"
            case 2:
                digits = chance.choice(("9", "9" * 9, "0", "x"))
                unit = f"TRAC:DATA EMEM,#{len(digits)}{digits}{'a' * chance.choice((0, 3, 500))}"
            case 3:
                unit = unit.lower().replace(":", chance.choice((":", "::", ":" * 40)))
        units.append(unit)
    line = chance.choice((";", ";:", ";;")).join(units).encode("utf-8", errors="replace")
    line = line[:300_000] + b"\n"
    return mutate_bytes(line, chance) if chance.random() < 0.3 else line


# --- USB ----------------------------------------------------------------------------------

USB = "/vibench.virtual.UsbDevice/"
USB_METHODS = ("Identify", "BulkOut", "BulkIn", "Control")


def broken_usb(chance: random.Random) -> tuple[str, bytes]:
    """Return a method of the served USB device, and a nearly valid frame for it."""
    method = chance.choice(USB_METHODS)
    tag = chance.randrange(1, 256)
    header = struct.pack("<BBBBIBBH", chance.choice((1, 2, 128, 7)), tag, ~tag & 255, 0, 0, 1, 10, 0)
    match method:
        case "BulkOut":
            line = broken_scpi(chance)
            size = chance.choice((len(line), chance.choice(EDGES))) % 2**32
            frame = header[:4] + struct.pack("<I", size) + header[8:] + line
        case "BulkIn":
            frame = struct.pack(">II", chance.choice(EDGES) % 2**32, chance.choice((0, 1, 2000, 2**32 - 1)))
        case "Control":
            numbers = (chance.choice(EDGES) % 2**16 for _ in range(2))
            frame = struct.pack(">BHH", chance.choice((1, 2, 3, 4, 5, 6, 7, 64, 128, 160)), *numbers)
        case _:
            frame = bytes([chance.choice((0x81, 0x02, 0x83, 0))])
    return USB + method, mutate_bytes(frame, chance) if chance.random() < 0.4 else frame


# --- DAQmx --------------------------------------------------------------------------------

SERVICE = nidaqmx_pb2.DESCRIPTOR.services_by_name["NiDAQmx"]
USUAL: dict[str, tuple[Any, ...]] = {
    "session_name": ("t", "u", ""),
    "name": ("t", "u"),
    "physical_channel": ("cDAQ1Mod1/ai0", "cDAQ1Mod1/ai0:3", "Dev1/ao0", "Dev1/ai0"),
    "name_to_assign_to_channel": ("", "a"),
    "min_val": (-5.0,),
    "max_val": (5.0,),
    "rate": (51200.0, 1000.0),
    "timeout": (0.0, 1.0, -1.0),
    "sampling_mode_raw": (10178, 10123, 10200),
    "samps_per_chan": (1000,),
    "num_samps_per_chan": (10, 100, -1),
    "array_size_in_samps": (100, 400),
    "fill_mode_raw": (0, 1),
    "active_edge_raw": (10280,),
    "units_raw": (10348,),
    "terminal_config_raw": (10106, 10529, -1),
    "action_raw": (0, 1, 2, 3, 4, 5, 6),
    "time_to_wait": (0.0, 0.5),
    "device_name": ("cDAQ1", "cDAQ1Mod1", "Dev1"),
    "channel": ("", "a"),
    "write_array": (0.0, 0.5),
}
"""Values that a client would send, by field name."""
CALLS = (
    "CreateTask", "CreateAIVoltageChan", "CreateAOVoltageChan", "CfgSampClkTiming", "StartTask",
    "ReadAnalogF64", "WriteAnalogF64", "ReadBinaryI32", "StopTask", "ClearTask", "TaskControl",
    "WaitUntilTaskDone", "CfgInputBuffer",
)  # fmt: skip
"""Calls that clients use most."""
SMALL = tuple(edge for edge in EDGES if edge < 2**31)


def broken_call(chance: random.Random) -> tuple[str, bytes]:
    """Return a method of the driver, and a nearly valid request for it."""
    name = chance.choice(CALLS) if chance.random() < 0.6 else chance.choice(SERVICE.methods).name
    method = SERVICE.methods_by_name[name]
    request = getattr(nidaqmx_pb2, method.input_type.name)()
    # Half of the requests are valid as far as is known, so that tasks can run.
    _fill(request, chance, 0 if chance.random() < 0.5 else STRANGE)
    content = request.SerializeToString()
    path = f"/{SERVICE.full_name}/{name}"
    return path, mutate_bytes(content, chance) if chance.random() < 0.1 else content


STRANGE = 0.25
"""Fraction of the fields of an invalid request that are omitted or have any value."""


def _fill(message: Any, chance: random.Random, strange: float) -> None:
    for field in message.DESCRIPTOR.fields:
        is_known = field.name in USUAL
        is_strange = chance.random() < strange
        if field.message_type is not None:
            if field.default_value != []:  # a field that is not repeated
                _fill(getattr(message, field.name), chance, strange)
                getattr(message, field.name).SetInParent()
            continue
        if not is_known and not is_strange:
            continue
        give = _any_value if is_strange else _usual_value
        with suppress(ValueError, TypeError, UnicodeEncodeError):  # impossible in a message
            if field.default_value == []:
                count = chance.choice((0, 1, 3, 1000))
                getattr(message, field.name).extend(give(field, chance) for _ in range(count))
            else:
                setattr(message, field.name, give(field, chance))


def _usual_value(field: FieldDescriptor, chance: random.Random) -> Any:
    return chance.choice(USUAL[field.name])


def _any_value(field: FieldDescriptor, chance: random.Random) -> Any:
    match field.cpp_type:
        case FieldDescriptor.CPPTYPE_STRING:
            text = chance.choice((*TEXTS, "t", "Dev1/ai0", "Dev1/ai0:99999999", "cDAQ1Mod1/ai3:0", ",,,"))
            return text.encode() if field.type == FieldDescriptor.TYPE_BYTES else text
        case FieldDescriptor.CPPTYPE_DOUBLE | FieldDescriptor.CPPTYPE_FLOAT:
            return chance.choice(
                (0.0, 1.0, -1.0, 1e-300, 1e300, float("nan"), float("inf"), -float("inf"), 1e9)
            )
        case FieldDescriptor.CPPTYPE_BOOL:
            return chance.random() < 0.5
        case FieldDescriptor.CPPTYPE_ENUM:
            return chance.choice(field.enum_type.values).number
        case _:
            return chance.choice((*SMALL, -1, -(2**31)))


# --- the attack -----------------------------------------------------------------------------

UNEXPECTED = (
    "Exception calling application",
    "Exception iterating",
    "Exception serializing",
    "Error in service",
)
"""Messages of gRPC about an exception in the server."""


class Trial:
    """Simulated instruments under attack."""

    def __init__(self, process: ServedProcess) -> None:
        said = process.until(lambda text: "::SOCKET" in text)
        self._channel = grpc.insecure_channel(re.search(r'insecure_channel\("([^"]+)"\)', said)[1])
        host, port = re.search(r"TCPIP0::([\d.]+)::(\d+)::SOCKET", said).groups()
        self._scpi = (host, int(port))
        self._line = socket.create_connection(self._scpi, LONGEST_S)

    def send(self, chance: random.Random) -> str:
        """Send one broken message and return how it was answered; raise TimeoutError without an answer."""
        match chance.randrange(4):
            case 0:
                return "scpi: " + self._send_line(chance)
            case 1:
                return "usb: " + self._call(*broken_usb(chance), chance)
            case _:
                return "daqmx: " + self._call(*broken_call(chance), chance)

    def close(self) -> None:
        """Close the connections."""
        self._line.close()
        self._channel.close()

    def require_answers(self) -> None:
        """Ask the generator for a setting on a new connection, and the driver for its version."""
        with socket.create_connection(self._scpi, LONGEST_S) as line:
            line.sendall(b"SOUR1:FREQ?\n")
            answer = line.recv(1000)
            if not re.fullmatch(rb"\d\.\d+E[+-]\d+\n", answer):
                raise ConnectionError(f"the generator's frequency was {answer!r}")
        version = self._channel.unary_unary(f"/{SERVICE.full_name}/GetSystemInfoAttributeUInt32")
        request = nidaqmx_pb2.GetSystemInfoAttributeUInt32Request(attribute_raw=0x1272)
        version(request.SerializeToString(), timeout=LONGEST_S)

    def _send_line(self, chance: random.Random) -> str:
        if chance.random() < 0.2:  # a client that leaves without reading
            self._line.close()
            self._line = socket.create_connection(self._scpi, LONGEST_S)
        try:
            self._line.sendall(broken_scpi(chance))
        except ConnectionError:
            self._line.close()
            self._line = socket.create_connection(self._scpi, LONGEST_S)
            return "hung up"
        self._line.settimeout(0.002)
        with suppress(TimeoutError):
            self._line.recv(1 << 16)
        self._line.settimeout(LONGEST_S)
        return "said"

    def _call(self, path: str, request: bytes, chance: random.Random) -> str:
        if "Register" in path:
            stream = self._channel.unary_stream(path)(request, timeout=LONGEST_S)
            with suppress(grpc.RpcError):
                stream.initial_metadata()
            stream.cancel()
            return "listened"
        call: Callable[..., Any] = self._channel.unary_unary(path)
        if chance.random() < 0.1:
            call.future(request, timeout=LONGEST_S).cancel()
            return "left early"
        try:
            call(request, timeout=LONGEST_S)
        except grpc.RpcError as error:
            told = f"{error.code().name}: {error.details()}"
            if error.code() is grpc.StatusCode.DEADLINE_EXCEEDED or any(each in told for each in UNEXPECTED):
                raise ConnectionError(f"{path}: {told}") from None
            return error.code().name
        return "answered"


LOOK_EVERY = 50
"""Messages between two checks that all servers answer."""


def attack(shard: Shard) -> Tally:
    """Send broken messages to the virtual rig's instruments."""
    tally = shard.tally(NAME)
    with (
        ServedProcess("vibench.cli", "serve-rig", "--address", "127.0.0.1:0") as process,
        closing(Trial(process)) as trial,
    ):
        before, known = process.descriptors, ""
        for number, chance in shard.chances(tally):
            began_s, found = time.monotonic(), ()
            try:
                taken = trial.send(chance)
                if number // shard.of % LOOK_EVERY == 0:
                    trial.require_answers()
            except (OSError, grpc.RpcError) as error:
                taken, found = "lost", (f"{type(error).__name__}: {error}",)
            if not process.is_alive:
                tally.findings.append(
                    Finding(NAME, shard.seed, number, ("it has ended",), process.err[-600:])
                )
                break
            told, known = process.err.removeprefix(known), process.err
            tally.count(taken, time.monotonic() - began_s, process.peak_bytes)
            if found or told:
                found = (*found, *process.faults(before + DESCRIPTORS_MORE))
                tally.findings.append(Finding(NAME, shard.seed, number, found, told[-900:]))
    return tally
