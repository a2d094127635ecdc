"""Studies on a real Dask cluster of local processes: killed workers, dead schedulers, wrong versions."""

import json
import operator
import os
import shutil
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
import pytest

import vibench.sim
from vibench.sim.study import (
    ExistingStudy,
    MemoryStore,
    PointState,
    Study,
    open_study,
    run_study,
    solve_study,
)
from vibench.sim.study._errors import ClusterLost
from vibench.sim.study._file_store import FileStore
from vibench.sim.study._grid import SESSION, STATE
from vibench.sim.study._queue import StudyEnd
from vibench.sim.study._results import results_of

pytest.importorskip("distributed", reason="a cluster needs the extra 'cluster'")

from distributed import Client

from vibench.sim.study._cluster import ClusterExecutor

START_PATIENCE_S = 60.0
SHORT_S = 3.0


@contextmanager
def process(*arguments, folder, environment=None):
    """Run a process until the end of the test; its output goes to a file."""
    with (folder / f"{arguments[0]}-{time.monotonic_ns()}.log").open("wb") as log:
        command = [sys.executable, "-m", "dask", *map(str, arguments), "--no-dashboard"]
        running = subprocess.Popen(command, stdout=log, stderr=log, cwd=folder, env=environment)
        try:
            yield running
        finally:
            running.kill()
            running.wait()


@contextmanager
def scheduler(folder):
    """Run a scheduler; yields its process and address."""
    told = folder / "scheduler.json"
    with process(
        "scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", told, folder=folder
    ) as running:
        deadline_s = time.monotonic() + START_PATIENCE_S
        while not (told.is_file() and told.read_text().endswith("}")):
            assert running.poll() is None
            assert time.monotonic() < deadline_s
        yield running, json.loads(told.read_text())["address"]


def worker(address, folder, environment=None):
    return process("worker", address, "--nthreads", "1", "--no-nanny", folder=folder, environment=environment)


@pytest.fixture
def cluster(tmp_path):
    """Run a scheduler with two connected workers; remaining processes end with the test."""
    with ExitStack() as stack:
        running, address = stack.enter_context(scheduler(tmp_path))
        workers = [stack.enter_context(worker(address, tmp_path)) for _ in range(2)]
        with Client(address, timeout=START_PATIENCE_S, set_as_default=False) as client:
            client.wait_for_workers(len(workers), timeout=START_PATIENCE_S)
        yield running, address, workers


@pytest.fixture(scope="module")
def long_study():
    return Study(
        frequencies_hz={"start": 180.0, "stop": 300.0, "step": 8.0},
        amplitudes_m=(2e-6, 10e-6),
        starts=("rest", "up"),
        duration_s=2.0,
        window_s=1.0,
        budget_s=0.0,
    )


@pytest.fixture(scope="module")
def truth(long_study):
    return solve_study(long_study)


@pytest.mark.thorough
def test_a_killed_worker_changes_no_result(cluster, long_study, truth, tmp_path, require_equal):
    _, address, workers = cluster
    kept_at_kill = []

    def watch(progress):
        if progress.done >= progress.of // 3 and not kept_at_kill:
            workers[0].kill()
            kept_at_kill.append(progress.done)

    results = solve_study(long_study, tmp_path / "a.h5", cluster=address, observer=watch)
    assert kept_at_kill[0] < long_study.grid.size
    assert np.all(results.state == PointState.DONE)
    require_equal(results, truth)
    assert results.sessions[0].executor.startswith(f"Dask cluster at {address}")


@pytest.mark.slow
def test_a_dead_cluster_is_reported_and_its_study_can_be_continued(
    cluster, long_study, truth, tmp_path, require_equal
):
    running, address, _ = cluster
    path = tmp_path / "a.h5"

    def watch(progress):
        if progress.done >= progress.of // 3:
            running.kill()

    executor = ClusterExecutor(address, patience_s=SHORT_S)
    with FileStore.create(path, long_study) as store, pytest.raises(ClusterLost, match=r"is lost.*resume"):
        run_study(long_study, executor, store, watch)
    executor.close()
    kept = np.count_nonzero(open_study(path).arrays[STATE])
    assert long_study.grid.size // 3 <= kept < long_study.grid.size
    results = solve_study(long_study, path, ExistingStudy.RESUME, workers=2)
    assert np.count_nonzero(results.values(SESSION) == 0.0) == kept
    require_equal(results, truth)


@pytest.mark.slow
def test_a_cluster_reports_errors_and_cancels_work_like_threads(cluster, long_study):
    _, address, _ = cluster
    executor = ClusterExecutor(address, operator.neg)
    store = MemoryStore(long_study)
    assert run_study(long_study, executor, store) is StudyEnd.COMPLETE
    executor.close()
    failures = list(results_of(long_study, store.arrays).failures())
    assert len(failures) == long_study.grid.size
    assert all("TypeError: bad operand type for unary -: 'Scene'" in why for _, why in failures)

    seen = []
    executor = ClusterExecutor(address)
    store = MemoryStore(long_study)
    began_s = time.monotonic()
    end = run_study(long_study, executor, store, seen.append, lambda: bool(seen))
    executor.close()
    assert end is StudyEnd.CANCELLED
    assert 0 < np.count_nonzero(store.arrays[STATE]) < long_study.grid.size
    assert time.monotonic() - began_s < START_PATIENCE_S


@pytest.mark.thorough
def test_a_worker_with_different_software_is_refused_before_it_computes(tmp_path):
    package = tmp_path / "other" / "vibench" / "sim"
    shutil.copytree(Path(vibench.sim.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__"))
    with (package / "contact.py").open("a") as source:
        source.write("\n# a better contact\n")
    environment = {**os.environ, "PYTHONPATH": str(package.parents[1])}
    with (
        scheduler(tmp_path) as (_, address),
        worker(address, tmp_path, environment),
        pytest.raises(ClusterLost, match=r"has different software, so results may differ.*sim_sources"),
    ):
        ClusterExecutor(address)


@pytest.mark.thorough
def test_unreachable_and_empty_clusters_give_a_one_sentence_error(tmp_path):
    with pytest.raises(ClusterLost, match=r"No Dask scheduler answers at 'tcp://127.0.0.1:9'"):
        ClusterExecutor("tcp://127.0.0.1:9", patience_s=0.5)
    with pytest.raises(ClusterLost, match=r"No Dask scheduler answers at 'nonsense:what'"):
        ClusterExecutor("nonsense:what", patience_s=0.5)
    with scheduler(tmp_path) as (_, address), pytest.raises(ClusterLost, match=r"has no worker after 0.5 s"):
        ClusterExecutor(address, patience_s=0.5)
