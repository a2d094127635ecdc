"""``python -m vibench.acquisition.engine``: process of an engine. It first writes a line with its address."""

import argparse
import json
import os
import signal
import sys
from threading import Event, Thread
from types import FrameType

from ..stopping.program import signal_name, stop_signals
from ..stopping.stop import Cause
from ._engine import Engine, JobQueue
from ._request_handler import RequestHandler
from ._server import LOOPBACK, serving
from ._status import Supervision

PARENT_INTERVAL_S = 0.2
"""Interval at which an engine without a parent process checks whether its work has ended [s]."""
FORGOTTEN_S = 60.0
"""An idle unattended engine ends after this time without a request [s]."""


def main() -> None:
    """Serve requests until a request, a signal or the end of the parent process ends the engine."""
    parser = argparse.ArgumentParser(prog="python -m vibench.acquisition.engine", description=__doc__)
    parser.add_argument("--attendance", type=Supervision, default=Supervision.ATTENDED)
    parser.add_argument("--what", default="engine", help="purpose of this engine, shown to other viewers")
    parser.add_argument("--host", default=LOOPBACK, help="address to listen on; a token is always required")
    parser.add_argument(
        "--forgotten-s",
        type=float,
        default=FORGOTTEN_S,
        help="an unattended engine with no campaign ends when no request arrives for this time [s]",
    )
    options = parser.parse_args()
    engine = Engine(options.attendance)
    jobs = JobQueue(engine)
    handler = RequestHandler(engine, jobs)

    def on_signal(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - the signature is Python's
        handler.end(Cause.TERMINATED, f"{signal_name(number)}: ended by the system")

    for number in stop_signals():
        signal.signal(number, on_signal)
    with serving(handler, options.what, options.host) as server:
        line = json.dumps(server.address.model_dump())
        print(line, flush=True)  # noqa: T201 - this line is the handshake with the parent program
        if options.attendance is Supervision.ATTENDED:
            Thread(target=_follow_parent, args=(handler,), name="engine parent", daemon=True).start()
        else:
            arguments = (handler, options.forgotten_s)
            Thread(target=_end_when_unused, args=arguments, name="engine forgotten", daemon=True).start()
        jobs.run()


def _end_when_unused(handler: RequestHandler, after_s: float) -> None:
    """End an idle engine that nobody uses any more, because it may block a bench for other programs."""
    pause = Event()
    while not handler.is_forgotten(after_s):
        pause.wait(after_s / 10)
    handler.end(Cause.PARENT_GONE, f"no request for {after_s:g} s, and no campaign to run")


def _follow_parent(handler: RequestHandler) -> None:
    """Wait until the parent has closed the standard input and no work remains, then end the engine."""
    # Do not use sys.stdin: at the end, its buffer cannot be closed while a thread waits on it.
    while os.read(sys.stdin.fileno(), 4096):
        pass
    pause = Event()
    while handler.outlives_its_parent:
        pause.wait(PARENT_INTERVAL_S)
    handler.end(Cause.PARENT_GONE, "the program that started the engine has ended")


if __name__ == "__main__":
    main()
