"""A simulated HELIC-DAQ board between the sensors and the amplifier of a virtual rig.

It follows docs/protocol.md (version 3), docs/standard_control_and_pll.md and docs/user_guide.md of the
project, release 0.3.0: one TCP client, a registry of parameters, at most two commands per tick, one master
phase, a PID of one input, a safety gate that closes with the connection, samples over UDP every 5 ms. Its
signal is computed by the compiled sample of the simulated controller.
"""

import binascii
import math
import socket
import struct
import threading
from collections import deque
from contextlib import contextmanager

import numpy as np

from vibench.sim.engine.run import native_engine
from vibench.virtual_rig import VirtualRig
from vibench.virtual_rig.world.world import World
from vibench_fast_loop.virtual_controller import LoopCables

MAGIC = b"HL"
HARMONICS = 16
QUEUE, PER_TICK = 32, 2
SENT_EVERY_S = 5e-3
LONGEST_PACKET = 1472
MOST_PAYLOAD = 1024
TURN = 2**32
BAD_TYPE, BAD_INDEX, BAD_LENGTH, READ_ONLY, BAD_VALUE, BUSY = 2, 3, 4, 5, 6, 7

READ, WRITE = False, True
REGISTRY = (
    ("firmware", "c", 16, READ),
    ("experiment", "c", 16, READ),
    ("sample_freq", "f", 1, READ),
    *((name, "I", 1, READ) for name in ("ticks", "loop_time_last", "loop_time_max", "clock_jitter")),
    *((name, "I", 1, READ) for name in ("overruns", "tick_timeouts", "records_dropped")),
    ("freq", "f", 1, WRITE),
    ("target_coeffs", "f", 1 + 2 * HARMONICS, WRITE),
    ("forcing_coeffs", "f", 1 + 2 * HARMONICS, WRITE),
    ("table", "f", 4096, READ),
    ("table_len", "H", 1, READ),
    ("table_freq", "f", 1, WRITE),
    ("table_gain", "f", 1, WRITE),
    *((name, "I", 1, WRITE) for name in ("table_interp", "table_mode", "table_mult")),
    ("table_phase", "f", 1, WRITE),
    ("table_trigger", "I", 1, WRITE),
    *(
        (name, "I", 1, READ)
        for name in ("wake_phase_min", "wake_phase_max", "t_measure_max", "t_actuate_max")
    ),
    ("t_rest_max", "I", 1, READ),
    ("diag_reset", "I", 1, WRITE),
    ("cmd_backlog_max", "I", 1, READ),
    ("arm", "I", 1, WRITE),
    ("safety", "I", 1, READ),
    ("mcu_reboot", "I", 1, WRITE),
    *((name, "f", 1, WRITE) for name in ("ctrl_kp", "ctrl_ki", "ctrl_kd", "ctrl_tau_d")),
)
SOURCES = {
    "adc0": "V",
    "adc1": "V",
    "error": "V",
    "target": "V",
    "forcing": "V",
    "table": "V",
    "phase": "turn",
}
SOURCES |= {"out": "V", "cmd_epoch": "count"}
QUEUED = {"freq", "target_coeffs", "forcing_coeffs", "ctrl_kp", "ctrl_ki", "ctrl_kd", "ctrl_tau_d"}


class RefusedByBoard(Exception):
    """The board answers with this error code."""


class HelicBoard:
    """The board; `on_rig` connects it to a virtual rig."""

    def __init__(self, rate_hz, grid_rate_hz, latency_s=1e-4, clamp_v=5.0):
        self.rate_hz = rate_hz
        self.steps_per_sample = round(grid_rate_hz / rate_hz)
        self.latency_steps = round(latency_s * grid_rate_hz)
        self.version, self.is_gated, self.is_mute = 3, True, False
        self.refuses = {}
        """Error codes for writing parameters, by parameter name."""
        self.trips = False
        """Whether the safety gate has tripped."""
        self._values = {name: (0,) * count for name, kind, count, _ in REGISTRY if kind != "c"}
        self._values |= {
            "firmware": (b"sim 0000000",),
            "experiment": (b"virtual-rig",),
            "sample_freq": (rate_hz,),
        }
        self._turn = threading.RLock()
        self._commands = deque()
        self._armed = self._was_enabled = False
        self._phase = self._epoch = 0
        self._stream, self._to, self._number = (), None, 0
        self._records = []
        # A block ends after each sample, so that its mean is that sample.
        self._now = native_engine().new(
            "Controller",
            is_on=1,
            glide=1.0,
            omega_from=1.0,
            omega_to=1.0,
            limit=clamp_v,
            most_unheard=math.inf,
            most_at_limit=math.inf,
            block=1e-9,
            turns=0.5e-9,
            harmonics=HARMONICS,
            remembered=3,
        )
        self._closing = threading.Event()
        self._client = None
        self.is_left = threading.Event()
        """Set when a client has disconnected."""
        self._server, self._samples = listening()
        threading.Thread(target=self._serve, name="helic board", daemon=True).start()

    @property
    def resource(self):
        return f"TCPIP0::127.0.0.1::{self._server.getsockname()[1]}::SOCKET"

    @property
    def is_armed(self):
        return self._armed

    def drop(self):
        """Close the connection, as a pulled cable does."""
        if self._client is not None:
            self._client.shutdown(socket.SHUT_RDWR)

    def close(self):
        self._closing.set()
        self.drop()
        self._server.close()
        self._samples.close()

    # Interface to the simulated world.

    @property
    def is_on(self):
        return self._client is not None or self._was_enabled

    @contextmanager
    def hold_state(self):
        with self._turn:
            yield self._now

    def attend(self, time_s):
        with self._turn:
            if self._now["done"]:
                self._now["done"] = 0
                self._tick(*self._now["coefficients"][:, 0].real.tolist())

    def _tick(self, out, base, m0):
        """Record a sample, and prepare the next sample."""
        ticks = self._values["ticks"][0]
        if self._to is not None:
            record = {
                "adc0": base,
                "adc1": m0,
                "out": out,
                "phase": self._phase / TURN,
                "cmd_epoch": self._epoch,
            }
            self._records.append([record.get(each, 0.0) for each in self._stream])
            if len(self._records) * (per_second := 1 / self.rate_hz) >= SENT_EVERY_S - 0.5 * per_second:
                self._send(ticks + 1 - len(self._records))
        self._values["ticks"] = (ticks + 1,)
        for _ in range(min(len(self._commands), PER_TICK)):
            name, values = self._commands.popleft()
            self._values[name] = values
            self._epoch = (self._epoch + 1) % 2**24
            self._take(name)
        enabled = (self._armed and not self.trips) or not self.is_gated
        if enabled and not self._was_enabled:
            self._now["memory"][:3] = 0.0, 0.0, -m0
        self._was_enabled = enabled
        self._now["fade"] = float(enabled)
        self._phase = (self._phase + round(self._values["freq"][0] / self.rate_hz * TURN)) % TURN
        self._now["theta"] = 2 * math.pi * self._phase / TURN
        self._now["turns"] = 0.5e-9

    def _take(self, name):
        if name == "forcing_coeffs":
            _, *both = self._values[name]
            self._now["reference"][:, :HARMONICS] = np.array(both[:HARMONICS]) - 1j * np.array(
                both[HARMONICS:]
            )
        elif name.startswith("ctrl"):
            kp, ki, kd, tau = (self._values[f"ctrl_{each}"][0] for each in ("kp", "ki", "kd", "tau_d"))
            step = 1 / self.rate_hz
            share = step / (tau + step)
            # Integral, filtered rate, and previous error; the error is the target (zero) minus adc1.
            self._now["step"][:3, :3] = (1, 0, 0), (0, 1 - share, -share / step), (0, 0, 0)
            self._now["inlet"][:3, 1] = -ki * step, -share / step, -1
            self._now["output"][:3] = 1, kd * (1 - share), -kd * share / step
            self._now["direct"] = 0, -kp - kd * share / step

    def _send(self, first):
        records, self._records = self._records, []
        if self.is_mute:
            return
        most = (LONGEST_PACKET - 20) // (4 * len(self._stream))
        for begin in range(0, len(records), most):
            part = records[begin : begin + most]
            head = struct.pack(
                "<2sBBIIIHH", MAGIC, 3, len(self._stream), self._number, first + begin, 0, 1, len(part)
            )
            self._samples.sendto(head + np.array(part, dtype="<f4").tobytes(), self._to)
            self._number += 1

    # Interface to the client.

    def _serve(self):
        while not self._closing.is_set():
            try:
                client, address = self._server.accept()
            except OSError:
                return
            self._client = client
            with client:
                try:
                    while self._answer(client, address[0]):
                        pass
                except OSError:
                    pass
            with self._turn:
                # The connection is closed: the gate closes and the stream ends.
                self._armed, self._to, self._client = False, None, None
            self.is_left.set()

    def _answer(self, client, host):
        head = receive(client, 6)
        if head is None:
            return False
        magic, kind, sequence, length = struct.unpack("<2sBBH", head)
        rest = receive(client, length + 2)
        if rest is None or magic != MAGIC or rest[-2:] != crc(head[2:] + rest[:-2]):
            return False
        try:
            with self._turn:
                told = self._reply(kind, rest[:-2], host)
        except RefusedByBoard as refused:
            kind, told = 255, bytes([refused.args[0], kind])
        body = struct.pack("<BBH", kind, sequence, len(told)) + told
        client.sendall(MAGIC + body + crc(body))
        return True

    def _reply(self, kind, payload, host):  # noqa: C901 - one case a message
        match kind:
            case 1:
                return self._page(*struct.unpack("<H", payload))
            case 2:
                return b"".join(f"{name}\0{unit}\0".encode() for name, unit in SOURCES.items())
            case 3:
                return b"".join(self._value(index) for (index,) in struct.iter_unpack("<H", payload))
            case 4:
                return self._set(struct.unpack_from("<H", payload)[0], payload[2:])
            case 7:
                decimation, count, width = struct.unpack_from("<HIB", payload)
                if self._to is not None:
                    raise RefusedByBoard(BUSY)
                if decimation != 1 or count or width != len(payload) - 7 or max(payload[7:]) >= len(SOURCES):
                    raise RefusedByBoard(BAD_VALUE)
                self._stream = tuple(list(SOURCES)[each] for each in payload[7:])
                return b""
            case 8:
                (port,) = struct.unpack("<H", payload)
                self._records, self._number, self._to = [], 0, (host, port)
                return b""
            case 9:
                self._to = None
                return b""
            case 10:
                uptime_ms = int(self._values["ticks"][0] / self.rate_hz * 1000)
                return struct.pack(
                    "<BHBfI", self.version, len(REGISTRY), len(SOURCES), self.rate_hz, uptime_ms
                )
        raise RefusedByBoard(BAD_TYPE)

    def _page(self, start):
        if start > len(REGISTRY):
            raise RefusedByBoard(BAD_INDEX)
        told, end = b"", start
        for name, kind, count, access in REGISTRY[start:]:
            entry = name.encode() + b"\0" + struct.pack("<cHB", kind.encode(), count, access)
            if len(told) + len(entry) + 4 > MOST_PAYLOAD:
                break
            told, end = told + entry, end + 1
        return struct.pack("<HH", start, end) + told

    def _value(self, index):
        name, kind, count, _ = self._entry(index)
        if name == "table":
            raise RefusedByBoard(BAD_LENGTH)
        values = self._values[name]
        if name == "arm":
            values = (int(self._armed and self.is_gated),)
        elif name == "safety":
            values = ((self._armed and not self.trips) | self.trips << 1 if self.is_gated else 0,)
        return struct.pack(layout(kind, count), *values)

    def _set(self, index, data):
        name, kind, count, access = self._entry(index)
        if access is not WRITE:
            raise RefusedByBoard(READ_ONLY)
        if name in self.refuses:
            raise RefusedByBoard(self.refuses[name])
        if len(data) != struct.calcsize(layout(kind, count)):
            raise RefusedByBoard(BAD_LENGTH)
        values = struct.unpack(layout(kind, count), data)
        if not all(map(math.isfinite, values)) or (name == "ctrl_tau_d" and values[0] < 0):
            raise RefusedByBoard(BAD_VALUE)
        if name == "arm":
            self._armed = bool(values[0])
        elif name not in QUEUED:
            self._values[name] = values
        elif len(self._commands) == QUEUE:
            raise RefusedByBoard(BUSY)
        else:
            self._commands.append((name, values))
        return b""

    def _entry(self, index):
        if index >= len(REGISTRY):
            raise RefusedByBoard(BAD_INDEX)
        return REGISTRY[index]


def layout(kind, count):
    return f"<{count}{'s' if kind == 'c' else kind}"


def crc(body):
    return struct.pack("<H", binascii.crc_hqx(body, 0xFFFF))


def receive(client, count):
    parts = b""
    while len(parts) < count:
        part = client.recv(count - len(parts))
        if not part:
            return None
        parts += part
    return parts


def listening():
    """Open a port for commands, and the next port for samples."""
    while True:
        server = socket.create_server(("127.0.0.1", 0))
        samples = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            samples.bind(("127.0.0.1", server.getsockname()[1] + 1))
        except OSError:
            server.close()
            samples.close()
        else:
            return server, samples


@contextmanager
def on_rig(rig):
    """Yield a board at the amplifier of a virtual rig, and the configuration of this rig as a real one."""
    board = HelicBoard(rig.controller.rate_hz, rig.virtual.grid_rate_hz, rig.controller.latency_s)
    virtual = VirtualRig(rig.model_copy(update={"controller": None}))
    virtual.world = World(virtual.rig, virtual.generator, loop=LoopCables(board))
    try:
        with virtual:
            found = {
                "virtual": None,
                "daq": rig.daq.model_copy(update={"server": virtual.daq_address}),
                "generator": rig.generator.model_copy(update={"resource": virtual.socket_resource}),
                "controller": rig.controller.model_copy(update={"resource": board.resource}),
            }
            yield board, rig.model_copy(update=found)
    finally:
        board.close()
