"""A bench that is real as far as anybody on it can tell, on simulated instruments with faults on demand."""

import itertools
from contextlib import contextmanager
from pathlib import Path

import pytest

from vibench.acquisition import open_bench
from vibench.acquisition.rig import CalibrationRule, confirm_simulated, load_rig
from vibench.virtual_rig import VirtualRig

ROOT = Path(__file__).parents[3]
_serials = itertools.count(1)


@pytest.fixture
def rig():
    rig = load_rig(ROOT / "hardware_configs" / "virtual_rig.toml")
    resource = f"USB0::0x0699::0x0353::R{next(_serials):04d}::INSTR"
    return rig.model_copy(
        update={
            "daq": rig.daq.model_copy(update={"sample_rate_hz": 5120}),
            "generator": rig.generator.model_copy(update={"resource": resource}),
        }
    )


@contextmanager
def bench_of(rig, **habits):
    with VirtualRig(rig, **habits) as virtual:
        daq = rig.daq.model_copy(update={"server": virtual.daq_address})
        laboratory = rig.model_copy(update={"virtual": None, "daq": daq})
        with open_bench(laboratory, confirm_simulated, CalibrationRule.WAIVED) as bench:
            yield bench, virtual


@pytest.fixture(name="bench_of")
def _bench_of():
    """Open a bench on a virtual rig that looks real: gives the bench and what is behind it."""
    return bench_of


@pytest.fixture
def state_folder(tmp_path, monkeypatch):
    """A state folder that nothing was kept in yet."""
    folder = tmp_path / "state"
    monkeypatch.setenv("VIBENCH_STATE_DIR", str(folder))
    return folder
