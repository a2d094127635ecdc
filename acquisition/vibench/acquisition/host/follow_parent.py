"""A process that works for another one ends with it, however that one ends."""

import os
from multiprocessing import parent_process
from multiprocessing.connection import wait
from threading import Thread


def follow_parent() -> None:
    """End this process as soon as the one that spawned it is gone.

    For the workers of a pool, which never notice: each of them holds both ends of the pipe that it
    waits on. A worker has nothing to lose; what it was to give would reach nobody.
    """
    parent = parent_process()
    if parent is not None:
        Thread(target=_end_after, args=(parent.sentinel,), name="follow parent", daemon=True).start()


def _end_after(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)
