"""The first simulation in a new process needs no compiler."""

import json
import subprocess
import sys

import pytest

FIRST_USE = """
import json, sys
from vibench.sim import Harmonic, gong2025, integrate, lyapunov_exponent, steady_response
from vibench.sim.scene.scene import FixedDuration, Scene
from vibench.sim.scene.solve import solve_scene

drive, law = Harmonic(130.0, 20e-6), sys.argv[1]
steady_response(gong2025(contact=law), drive, duration_s=0.2, window_s=0.1)
integrate(gong2025(contact=law), drive, 0.1, sample_rate_hz=1e4)
lyapunov_exponent(gong2025(contact=law), drive, duration_s=2.0, settle_s=0.0)
solve_scene(Scene(gong2025(contact=law), drive, duration=FixedDuration(1.0, 0.5)))
print(json.dumps(sorted({name.partition(".")[0] for name in sys.modules})))
"""


@pytest.mark.parametrize("law", ["hertz", "rigid:0.8", "power:3+5+7"])
def test_the_first_simulation_loads_no_compiler(law):
    run = subprocess.run([sys.executable, "-c", FIRST_USE, law], capture_output=True, text=True, check=True)
    assert not {"numba", "llvmlite"} & set(json.loads(run.stdout))
