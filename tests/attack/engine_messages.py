"""Broken messages to a real engine: before and after the token, in frames and in requests."""

import json
import random
import socket
import time
from contextlib import closing, suppress
from typing import Any

from vibench.acquisition import load_campaign
from vibench.acquisition.engine import EngineClient
from vibench.acquisition.engine._client import EngineAddress
from vibench.acquisition.engine._wire import HEAD, MAGIC
from vibench.acquisition.rig import load_rig

from .byte_mutants import EDGES, mutate_bytes
from .command_runner import ROOT
from .json_mutants import mutate_json
from .limits import LONGEST_S
from .served_process import ServedProcess
from .tally import Finding, Shard, Tally

NAME = "engine"
DESCRIPTORS_MORE = 24
"""Allowed for the connected viewers and an open bench."""
CAMPAIGN = load_campaign(ROOT / "campaigns" / "quick.toml").model_dump(mode="json")
RIG = load_rig("virtual_rig").model_dump(mode="json")
REQUESTS: tuple[dict[str, Any], ...] = (
    {"ask": "open", "rig": RIG},
    {"ask": "close"},
    {"ask": "arm", "campaign_request": {"campaign": CAMPAIGN, "folder": "recordings", "check": "waived"}},
    {"ask": "disarm"},
    {"ask": "stop", "level": "abort", "reason": "a test"},
    {"ask": "resume"},
    {"ask": "mark", "text": "here"},
    {"ask": "status", "known_rows": -1},
    {"ask": "beat"},
    {"ask": "look", "since_sample": 0, "most": 100},
)
"""One valid request of every kind that neither plays a signal nor ends the engine."""


def frame(text: bytes, payload: bytes = b"") -> bytes:
    """Return a message with its frame header."""
    return HEAD.pack(MAGIC, len(text), len(payload)) + text + payload


def broken_frame(chance: random.Random) -> bytes:
    """Return data that begins like a message, and has a wrong header or ends too soon."""
    text = mutate_json(chance.choice(REQUESTS), chance)
    match chance.randrange(4):
        case 0:
            return HEAD.pack(MAGIC, chance.choice(EDGES) % 2**32, chance.choice(EDGES) % 2**32) + text
        case 1:
            return frame(text)[: chance.randrange(len(text) + HEAD.size)]
        case 2:
            return mutate_bytes(frame(text), chance)
        case _:
            return chance.randbytes(chance.choice((0, 1, 11, 12, 13, 2000)))


class Trial:
    """An engine under attack."""

    def __init__(self, process: ServedProcess) -> None:
        self._process = process
        self._address = EngineAddress.model_validate_json(process.until(lambda said: "\n" in said))
        self._hello = frame(json.dumps({"ask": "hello", "token": self._address.token}).encode())
        self._viewer: socket.socket | None = None
        self.descriptors = process.descriptors

    def send(self, chance: random.Random) -> str:
        """Send one broken message and return how it was answered; raise TimeoutError without an answer."""
        if chance.random() < 0.15:
            return self._send_without_token(chance)
        viewer = self._open_viewer()
        if chance.random() < 0.1:
            return self._send_and_end(viewer, broken_frame(chance))
        request = chance.choice(REQUESTS)
        # Valid requests bring the engine into other states.
        is_right = chance.random() < 0.15
        viewer.sendall(frame(json.dumps(request).encode() if is_right else mutate_json(request, chance)))
        taken = self._answer(viewer)
        if taken == "hung up":
            raise ConnectionError("a request in a whole frame was not answered")
        return taken

    def close(self) -> None:
        """Close the connection."""
        self.hang_up()

    def hang_up(self) -> None:
        """Close the viewer's connection; the next message opens a new one."""
        if self._viewer is not None:
            self._viewer.close()
            self._viewer = None

    def status_faults(self) -> tuple[str, ...]:
        """Request a status; return faults of the process: a traceback, too much memory or descriptors."""
        with EngineClient.attach(self._address) as client:
            client.stop("off")
            client.status()
        return self._process.faults(self.descriptors + DESCRIPTORS_MORE)

    def _send_without_token(self, chance: random.Random) -> str:
        with closing(self._connect()) as stranger:
            hello = mutate_json({"ask": "hello", "token": "x" * 43, "role": "visiting"}, chance)
            said = frame(hello) if chance.random() < 0.5 else broken_frame(chance)
            return "door: " + self._send_and_end(stranger, said)

    def _send_and_end(self, connection: socket.socket, said: bytes) -> str:
        """Send data that may be incomplete and end the connection; the engine may answer or close it."""
        with suppress(OSError):
            connection.sendall(said)
            connection.shutdown(socket.SHUT_WR)
        taken = self._answer(connection)
        if connection is self._viewer:
            self.hang_up()
        return taken

    def _answer(self, connection: socket.socket) -> str:
        try:
            head = self._receive(connection, HEAD.size)
            magic, text, payload = HEAD.unpack(head)
            facts = json.loads(self._receive(connection, text))
            self._receive(connection, payload)
        except ConnectionError:
            return "hung up"
        assert magic == MAGIC
        return "refused" if "refused" in facts else "answered"

    @staticmethod
    def _receive(connection: socket.socket, count: int) -> bytes:
        found = b""
        while len(found) < count:
            piece = connection.recv(min(count - len(found), 1 << 16))
            if not piece:
                raise ConnectionError
            found += piece
        return found

    def _connect(self) -> socket.socket:
        return socket.create_connection((self._address.host, self._address.port), LONGEST_S)

    def _open_viewer(self) -> socket.socket:
        if self._viewer is None:
            self._viewer = self._connect()
            self._viewer.sendall(self._hello)
            assert self._answer(self._viewer) == "answered"
        return self._viewer


LOOK_EVERY = 25
"""Messages between two checks of the process."""


def attack(shard: Shard) -> Tally:
    """Send broken messages to an engine without a bench, or with a virtual bench."""
    tally = shard.tally(NAME)
    words = ("vibench.acquisition.engine", "--attendance", "unattended", "--forgotten-s", "36000")
    with ServedProcess(*words) as process, closing(Trial(process)) as trial:
        known = ""
        for number, chance in shard.chances(tally):
            began_s = time.monotonic()
            faults: tuple[str, ...] = ()
            try:
                taken = trial.send(chance)
                if number % LOOK_EVERY < shard.of or not process.is_alive or process.err != known:
                    faults = trial.status_faults()
            except (OSError, AssertionError, ValueError) as error:
                trial.hang_up()
                taken, faults = "lost", (f"{type(error).__name__}: {error}",)
            told, known = process.err.removeprefix(known), process.err
            tally.count(taken, time.monotonic() - began_s, process.peak_bytes if process.is_alive else 0)
            if faults and (told or taken == "lost"):
                tally.findings.append(Finding(NAME, shard.seed, number, faults, told[-1500:]))
            if not process.is_alive:
                break
    return tally
