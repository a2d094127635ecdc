"""The drivers of the package pass the contract tests; `vibench doctor` lists the package."""

from importlib.metadata import version

import pytest

from tests.acquisition.contract.test_plug_ins import run_contract_tests
from vibench.cli.doctor import libraries


@pytest.mark.thorough
def test_the_keysight_driver_passes_the_contract_tests():
    done = run_contract_tests("keysight33500b")
    assert done.returncode == 0, done.stdout
    assert "passed" in done.stdout


def test_the_doctor_lists_the_package_and_its_library():
    found = dict(libraries())
    for name in ("vibench-more-drivers", "sounddevice"):
        assert found[name] == version(name)
