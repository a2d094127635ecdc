"""An engine with its door open: others find it, ask it, and are looked after, while inside."""

from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager

from ._announcement import announced
from ._request_handler import Desk
from ._server import LOOPBACK, Server
from ._watchdog import Watch


@contextmanager
def hosted(desk: Desk, what: str, host: str = LOOPBACK) -> Iterator[Server]:
    """Serve a desk; ``what`` is shown to those who look for an engine."""
    with ExitStack() as inside:
        server = inside.enter_context(closing(Server(desk, host)))
        inside.enter_context(closing(Watch(desk)))
        inside.enter_context(announced(server.address, what))
        yield server
