"""A bench on simulated instruments that programs take for a real one, with faults on demand."""

from contextlib import contextmanager

import pytest

from tests.small_rig import small_rig
from vibench.acquisition import open_bench
from vibench.acquisition.rig import CalibrationRule, confirm_simulated
from vibench.virtual_rig import VirtualRig


@pytest.fixture
def rig():
    return small_rig()


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
