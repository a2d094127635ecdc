"""What the first run on a machine compiles: an empty cache, a process of its own."""

import json
import os
import subprocess
import sys

import pytest

FIRST_USE = """
import json, time
import numpy as np
from vibench.sim import Accuracy
from vibench.sim import Harmonic, Sampled
from vibench.sim.power_law import advance_under_power
from vibench.sim.rigid import rebound
from vibench.sim import follow_samples
from vibench.sim.sticking import hold_on_series
from vibench.sim.stepping._stops_run import advance_between_stops
from vibench.sim.contact import propagate_tangent_steps
from vibench.sim import steady_response
from vibench.sim import gong2025

start, specimen = time.process_time(), gong2025()
steady_response(specimen, Harmonic(260.0, 5e-6), Accuracy.QUICK, duration_s=0.2, window_s=0.1)
follow_samples(specimen, Sampled(np.zeros(100), 51_200.0))
kernels = (advance_under_power, rebound, hold_on_series, propagate_tangent_steps, advance_between_stops)
print(json.dumps([time.process_time() - start, {k.__name__: len(k.signatures) for k in kernels}]))
"""
ALLOWED_S = 29.0
"""Of one core, sampled drives included."""


@pytest.mark.slow
def test_a_first_run_on_hertzs_stops_compiles_no_other_law_and_is_ready_in_time(tmp_path):
    run = subprocess.run(
        [sys.executable, "-c", FIRST_USE],
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    taken_s, compiled = json.loads(run.stdout)
    assert compiled.pop("advance_between_stops") == 1
    assert set(compiled.values()) == {0}
    assert taken_s < ALLOWED_S
