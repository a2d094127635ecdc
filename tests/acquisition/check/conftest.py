"""A bench on simulated instruments that programs take for a real one, with faults on demand."""

import itertools
from contextlib import contextmanager

import pytest

from tests.changed import changed
from vibench.acquisition import open_bench
from vibench.acquisition.rig import CalibrationRule, confirm_simulated, load_rig
from vibench.virtual_rig import VirtualRig

_serials = itertools.count(1)


@pytest.fixture
def rig():
    rig = load_rig("virtual_rig")
    resource = f"USB0::0x0699::0x0353::R{next(_serials):04d}::INSTR"
    return changed(rig, daq={"sample_rate_hz": 5120}, generator={"resource": resource})


@contextmanager
def bench_of(rig, **habits):
    with VirtualRig(rig, **habits) as virtual:
        daq = rig.daq.model_copy(update={"server": virtual.daq_address})
        laboratory = rig.model_copy(update={"virtual": None, "daq": daq})
        with open_bench(laboratory, confirm_simulated, CalibrationRule.WAIVED) as bench:
            yield bench, virtual


@pytest.fixture(name="bench_of")
def _bench_of():
    """Open a bench on a virtual rig that looks real; yields the bench and the virtual rig."""
    return bench_of


@pytest.fixture
def state_folder(tmp_path, monkeypatch):
    """Return a state folder without stored files."""
    folder = tmp_path / "state"
    monkeypatch.setenv("VIBENCH_STATE_DIR", str(folder))
    return folder
