"""Instrument under test and its bench, as given on the command line."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from vibench.acquisition.bench import Bench, open_bench
from vibench.acquisition.errors import AcquisitionError, BrokenPromise, ConfigurationError
from vibench.acquisition.host.installation import all_shipped
from vibench.acquisition.instruments import PlugInKind, Samples, plug_in_names
from vibench.acquisition.rig import CalibrationRule, Rig, Role, load_rig, plug_ins_of
from vibench.acquisition.run.silence_watch import fit_sine

LEVEL = 0.02
"""Signal level of the tests, as a fraction of the bench's amplitude limit."""
SETTLING_S = 0.3
_RIGS = pytest.StashKey[dict[PlugInKind, Rig | None]]()


def chosen_rig(name: str, given: str | None, kind: PlugInKind) -> Rig | None:
    """Return the given bench, or the first suitable shipped bench; None if no bench uses the instrument."""
    if given is not None:
        rig = load_rig(Path(given))
        return rig if (kind, name) in plug_ins_of(rig) else None
    for path in all_shipped("hardware_configs"):
        try:
            rig = load_rig(path)
        except ConfigurationError:  # the bench needs a package that is not installed
            continue
        if rig.virtual is not None and (kind, name) in plug_ins_of(rig):
            return rig
    return None


def no_bench_text(name: str, given: str | None, kinds: list[PlugInKind]) -> str:
    """Return the error text for an instrument that no bench names."""
    who = "no shipped virtual bench uses" if given is None else f"{given} does not use"
    kinds_in_words = " or ".join(each.value for each in kinds)
    return f"{who} {name!r} as one of {kinds_in_words}; use --vibench-bench to give a bench that does"


def pytest_collection_modifyitems(config: pytest.Config) -> None:
    """Report an error in the command-line options once, before the first test."""
    name = config.getoption("--vibench-instrument")
    given = config.getoption("--vibench-bench")
    if name is None:
        raise pytest.UsageError(
            "--vibench-instrument NAME is missing; give the name of an entry point, such as afg1022x"
        )
    kinds = [each for each in PlugInKind if name in plug_in_names(each)]
    if not kinds:
        raise pytest.UsageError(f"{name!r} is not an installed instrument; install its package first")
    try:
        found = {kind: chosen_rig(name, given, kind) for kind in kinds}
    except ConfigurationError as error:
        raise pytest.UsageError(str(error)) from None
    if not any(found.values()):
        raise pytest.UsageError(no_bench_text(name, given, kinds))
    config.stash[_RIGS] = found


@pytest.fixture(scope="module")
def rig(request: pytest.FixtureRequest) -> Rig:
    """Return the bench's configuration; the test module determines the kind of instrument."""
    name, kind = request.config.getoption("--vibench-instrument"), request.module.KIND
    rigs = request.config.stash[_RIGS]
    if kind not in rigs:
        pytest.skip(f"{name} is not a plug-in of the kind {kind.value}")
    found = rigs[kind]
    if found is None:
        raise ConfigurationError(no_bench_text(name, request.config.getoption("--vibench-bench"), [kind]))
    return found


@pytest.fixture
def bench(rig: Rig) -> Iterator[Bench]:
    """Open the bench again for each test. Its manual settings (knobs) are taken as confirmed by the user."""
    with open_bench(rig, calibration=CalibrationRule.WAIVED) as opened:
        yield opened


@contextmanager
def refusal() -> Iterator[None]:
    """Require an AcquisitionError other than BrokenPromise."""
    with pytest.raises(AcquisitionError) as error:
        yield
    assert not isinstance(error.value, BrokenPromise), str(error.value)


def measured_v(bench: Bench, duration_s: float) -> Samples:
    """Return samples of the generator's terminal voltage over ``duration_s`` [V], after settling."""
    count = int(duration_s * bench.digitizer.sample_rate_hz)
    bench.digitizer.read(max(1, int(SETTLING_S * bench.digitizer.sample_rate_hz)))
    row = bench.digitizer.roles.index(Role.DRIVE_VOLTAGE.value)
    volts = bench.digitizer.read(count).volts[row] * bench.channels[row].units_per_volt
    return np.asarray(volts)


def line_v(volts: Samples, frequency_hz: float, rate_hz: float) -> float:
    """Return the amplitude of the sine at ``frequency_hz`` in a signal, by least squares [V]."""
    return fit_sine(volts, frequency_hz, rate_hz).amplitude
