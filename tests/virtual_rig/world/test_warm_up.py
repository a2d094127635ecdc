"""What runs behind the sockets is compiled when the rig is switched on, not while a reader waits."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PROGRAM = """
from pathlib import Path
from vibench.acquisition import open_bench
from vibench.acquisition.instruments import LoopProgram
from vibench.sim.shaker import _loaded_shaker as loaded_shaker
from vibench.virtual_rig.world import _loop_cables as loop_cables

kernels = (loaded_shaker.move_shaker, loop_cables._closed_loop)
with open_bench(Path("hardware_configs/virtual_rig_controller.toml")) as bench:
    before = [len(each.signatures) for each in kernels]
    bench.controller.play(LoopProgram(frequency_hz=100, reference_v=((0.1, 0.0),)))
    bench.digitizer.start()
    bench.digitizer.read(512)
    print(before, [len(each.signatures) for each in kernels])
"""


@pytest.mark.thorough
def test_the_first_read_of_a_process_compiles_nothing():
    told = subprocess.run(
        [sys.executable, "-c", PROGRAM], cwd=ROOT, capture_output=True, text=True, check=True, timeout=120
    )
    before, after = told.stdout.strip().split("] ")
    assert before.removeprefix("[") == after.strip("[]")
    assert "0" not in after
