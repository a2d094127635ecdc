"""Without vibench-more-drivers, benches that need it are refused with a sentence that names it."""

import pytest

from vibench.acquisition import shipped

SENTENCE = (
    "needs vibench-more-drivers, which is not installed: run 'pip install extensions/more_drivers' in the "
    "folder of vibench's sources"
)
SWITCH_ON = """
import sys
from pathlib import Path
from vibench.acquisition import ConfigurationError
from vibench.acquisition.rig import load_rig
from vibench.virtual_rig import VirtualRig
for path in sys.argv[1:]:
    try:
        VirtualRig(load_rig(Path(path)))
    except ConfigurationError as error:
        print(error)
"""
CHANGES = {
    "generator.driver = 'keysight33500b'": ("[generator]\n", '[generator]\ndriver = "keysight33500b"\n'),
    "generator.driver = 'file'": ("[generator]\n", '[generator]\ndriver = "file"\n'),
    "daq.driver = 'file'": ("[daq]\n", '[daq]\ndriver = "file"\n'),
    "daq.driver = 'soundcard'": ("[daq]\n", '[daq]\ndriver = "soundcard"\n'),
    "generator.resource = 'USB0::0x0957::0x2C07::C019999::INSTR': '0x0957'": (
        "USB0::0x0699::0x0353",
        "USB0::0x0957::0x2C07",
    ),
}


def test_every_bench_that_needs_the_missing_package_is_refused(run, tmp_path):
    usual = shipped("hardware_configs/virtual_rig.toml").read_text(encoding="utf-8")
    for number, change in enumerate(CHANGES.values()):
        (tmp_path / f"{number}.toml").write_text(usual.replace(*change), encoding="utf-8")
    told = run("-c", SWITCH_ON, *(f"{number}.toml" for number in range(len(CHANGES))))
    assert told.stderr == ""
    for line, given in zip(told.stdout.splitlines(), CHANGES, strict=True):
        assert line.endswith(f"{given} {SENTENCE}")


@pytest.mark.thorough
def test_a_measurement_on_the_shipped_bench_is_refused_before_output(run, tmp_path):
    told = run("-m", "vibench.cli", "measure", "quick", "--bench", "virtual_rig_keysight", "--out", "out")
    assert told.returncode == 1
    assert SENTENCE in " ".join(told.stderr.split())
    assert not (tmp_path / "out").exists()
