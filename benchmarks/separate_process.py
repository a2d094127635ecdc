"""Time and peak memory of a function that runs in a separate process."""

import multiprocessing
import resource
import time
from collections.abc import Callable
from dataclasses import dataclass

MEGABYTE = 1 << 20
_KILOBYTE = 1 << 10


@dataclass(frozen=True)
class Run:
    """Cost and result of one run."""

    result: object
    wall_s: float
    cpu_s: float
    peak_mb: float
    idle_mb: float
    """Memory of the process before the run [MB]."""


def run_separately(function: Callable[..., object], *arguments: object) -> Run:
    """Run a function of a module in a new process, so that its peak memory can be measured."""
    context = multiprocessing.get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_send_run, args=(sender, function, arguments))
    process.start()
    answer = receiver.recv()
    process.join()
    return answer


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * _KILOBYTE / MEGABYTE


def _send_run(pipe, function, arguments) -> None:
    idle_mb, begin_s, begin_cpu_s = _peak_mb(), time.perf_counter(), time.process_time()
    result = function(*arguments)
    wall_s, cpu_s = time.perf_counter() - begin_s, time.process_time() - begin_cpu_s
    pipe.send(Run(result, wall_s, cpu_s, _peak_mb(), idle_mb))
