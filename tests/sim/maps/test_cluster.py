"""A map on the processes of a real Dask cluster, one of which dies, is the map of threads."""

import numpy as np
import pytest

from vibench.sim.maps import Map, Range, estimate_map, solve_map

pytest.importorskip("distributed", reason="a cluster needs the extra 'cluster'")

from tests.sim.study import test_cluster as study_cluster

cluster = study_cluster.cluster

PLAN = Map(
    frequency_hz=Range(start=80.0, stop=300.0, points=33),
    amplitude_m=Range(start=2e-6, stop=3e-5, points=17, spacing="logarithmic"),
    periods=800,
    coarse=8,
)


@pytest.mark.slow
def test_a_worker_killed_half_way_loses_no_point_and_changes_no_answer(cluster, tmp_path):
    _, address, workers = cluster
    killed_at = []

    def watch(progress):
        if progress.done >= 60 and not killed_at:
            workers[0].kill()
            killed_at.append(progress.done)

    results = solve_map(PLAN, tmp_path / "map.h5", cluster=address, observer=watch)
    truth = solve_map(PLAN)
    assert killed_at
    for name in results.arrays.keys() - {"taken", "session"}:
        is_float = results.arrays[name].dtype.kind == "f"
        assert np.array_equal(results.arrays[name], truth.arrays[name], equal_nan=is_float), name


@pytest.mark.slow
def test_an_estimate_is_what_two_threads_take_within_its_scatter():
    # The first map teaches what such points take here; the second is elsewhere.
    solve_map(PLAN, workers=2)
    other = PLAN.model_copy(
        update={"frequency_hz": Range(start=85.0, stop=310.0, points=21), "refinement": "full"}
    )
    planned = estimate_map(other, 2)
    taken_s = float(np.nansum(solve_map(other, workers=2).arrays["taken"].astype(float)))
    assert taken_s / 4.0 < planned.work_s < 4.0 * taken_s
