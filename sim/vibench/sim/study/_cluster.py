"""Executor on a Dask cluster: any number of processes on any number of machines.

Dask repeats a task if its worker fails, and moves tasks between workers. This does not change results,
because the result of a scene does not depend on the worker. All workers must have the same software.
"""

import queue
import time
import uuid
from collections.abc import Mapping, Sequence
from functools import partial

from distributed import CancelledError, Client, Future
from distributed.comm import get_address_host_port

from ..scene.scene import Scene
from ..scene.solve import SolvedScene, solve_scene
from ._errors import ClusterLost
from ._executor import Bundle, Reply, Solver, empty_queue, software, solve_timed

CONNECT_PATIENCE_S = 30.0
"""Longest wait for the scheduler, and also for the first worker [s]."""
LOOK_AGAIN_S = 1.0
"""Shortest interval between two queries of the number of workers [s]."""
RUNNING, CONNECTING = "running", "connecting"
FINISHED, ERROR = "finished", "error"

Answer = tuple[str, tuple[SolvedScene, ...]]
"""Results of a worker, with the versions of its software."""


def solve_bundle(scenes: Sequence[Scene], solver: Solver) -> Answer:
    """Solve scenes on a worker; return the results and the versions of the worker's software."""
    return software(), tuple(solve_timed(scenes, solver))


class ClusterExecutor:
    """Executor that uses the workers of a Dask scheduler.

    Raises ClusterLost if the scheduler does not answer, has no worker, or a worker has different software.
    """

    def __init__(
        self, address: str, solver: Solver = solve_scene, patience_s: float = CONNECT_PATIENCE_S
    ) -> None:
        self._address = address
        self._solver = solver
        self._client = _connect(address, patience_s)
        try:
            _require_workers(self._client, address, patience_s)
        except BaseException:
            self._client.close()
            raise
        self._arrived: queue.SimpleQueue[tuple[Bundle, Future]] = queue.SimpleQueue()
        # Keep a reference to each future: the scheduler drops futures without references.
        self._held: dict[str, Future] = {}
        self._prefix = f"vibench-{uuid.uuid4().hex}"
        self._submitted = 0
        self._slots = 0
        self._look_s = -LOOK_AGAIN_S

    @property
    def description(self) -> str:
        """Description of the executor, which the study's file stores."""
        return f"Dask cluster at {self._address}, {self.slots} worker thread(s) at first"

    @property
    def slots(self) -> int:
        """Total number of the workers' threads at the last query; 0 while the scheduler does not answer."""
        if not self._is_in_contact():
            return 0
        now_s = time.monotonic()
        if now_s - self._look_s >= LOOK_AGAIN_S:
            self._look_s = now_s
            self._slots = self._count_threads()
        return self._slots

    def submit(self, bundle: Bundle) -> None:
        """Submit a bundle to the scheduler."""
        self._submitted += 1
        key = f"{self._prefix}-{self._submitted}"
        future = self._client.submit(solve_bundle, bundle.scenes, self._solver, key=key, pure=False)
        self._held[key] = future
        future.add_done_callback(partial(self._note, bundle))

    def replies(self, timeout_s: float) -> Sequence[Reply]:
        """Return the replies for finished bundles; a bundle that the scheduler dropped has no results."""
        arrived = empty_queue(self._arrived, timeout_s)
        if not arrived:
            self._is_in_contact()
        answers = self._fetch([future for _, future in arrived if future.status == FINISHED])
        return [self._reply(bundle, future, answers) for bundle, future in arrived]

    def cancel(self) -> Sequence[Reply]:
        """Cancel all bundles; results of running bundles are discarded."""
        if self._client.status == RUNNING and self._held:
            self._client.cancel(list(self._held.values()))
        self._held.clear()
        return ()

    def close(self) -> None:
        """Cancel all work and disconnect from the cluster."""
        self.cancel()
        self._client.close()

    def _note(self, bundle: Bundle, future: Future) -> None:
        """Put a finished bundle into the queue; the Dask client calls this function in one of its threads."""
        self._arrived.put((bundle, future))

    def _fetch(self, futures: Sequence[Future]) -> Mapping[str, Answer]:
        """Return the results of all finished futures, fetched together; lost results are left out."""
        if not futures:
            return {}
        try:
            answers = self._client.gather(list(futures))
        except (CancelledError, OSError):
            return {}
        return {future.key: answer for future, answer in zip(futures, answers, strict=True)}

    def _reply(self, bundle: Bundle, future: Future, answers: Mapping[str, Answer]) -> Reply:
        self._held.pop(future.key, None)
        if future.status == ERROR:
            return Reply(bundle, (), future.exception())
        if future.key not in answers:
            return Reply(bundle, ())
        made_by, solved = answers[future.key]
        if made_by != software():
            raise ClusterLost(_other_software(self._address, made_by))
        return Reply(bundle, solved)

    def _is_in_contact(self) -> bool:
        """Return whether the scheduler answers; raise ClusterLost if the client has stopped trying."""
        if self._client.status in (RUNNING, CONNECTING):
            return bool(self._client.status == RUNNING)
        raise ClusterLost(
            f"The connection to the cluster at {self._address} is lost. Computed points are kept;"
            " start the cluster again and resume."
        )

    def _count_threads(self) -> int:
        try:
            return sum(self._client.nthreads().values())
        except (CancelledError, OSError):
            return 0


def _connect(address: str, patience_s: float) -> Client:
    try:
        # Check the address before creating a client: with an invalid address, a client cannot be closed.
        get_address_host_port(address)
        return Client(address, timeout=patience_s, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ClusterLost(
            f"No Dask scheduler answers at {address!r} ({error});"
            " give the address that `dask scheduler` prints, such as tcp://host:8786."
        ) from error


def _require_workers(client: Client, address: str, patience_s: float) -> None:
    """Raise ClusterLost for a cluster without workers, or with a worker that has different software."""
    try:
        client.wait_for_workers(1, timeout=patience_s)
    except OSError as error:
        raise ClusterLost(
            f"The cluster at {address} has no worker after {patience_s:g} s;"
            f" start workers with `dask worker {address}`."
        ) from error
    try:
        found = client.run(software)
    except ImportError as error:
        raise ClusterLost(
            f"A worker of {address} has no vibench ({error}); install the same version on every machine."
        ) from error
    for made_by in found.values():
        if made_by != software():
            raise ClusterLost(_other_software(address, made_by))


def _other_software(address: str, made_by: str) -> str:
    return (
        f"A worker of {address} has different software, so results may differ: {made_by} there,"
        f" {software()} here. Install the same versions on every machine, and restart the workers."
    )
