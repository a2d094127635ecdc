"""NeXus files follow the standard and are plotted with labels by silx."""

import h5py
import numpy as np
import pytest

from tests.analysis.exchange.conftest import RATE_HZ
from vibench.analysis.exchange import Format, excerpt, export_samples

NEXUS_TYPES = {"NXroot", "NXentry", "NXdata"}


@pytest.fixture
def nexus(known, tmp_path):
    path, _facts = export_samples(excerpt(known), Format.NEXUS, tmp_path / "a.nxs")
    return path


def data_faults(group, path):
    """Yield the deviations of an NXdata group from its definition and from the needs of its readers."""
    signal, axes = group.attrs["signal"], list(group.attrs["axes"])
    if signal not in group or len(axes) != group[signal].ndim:
        yield f"{path}: signal and axes do not belong together"
    for number, axis in enumerate(axes):
        if group[axis].shape != (group[signal].shape[number],):
            yield f"{path}: axis {axis} has another length"
        if group.attrs.get(f"{axis}_indices") != number:
            yield f"{path}: {axis}_indices"
    if group[f"{signal}_errors"].shape != group[signal].shape:
        yield f"{path}: errors have another shape"
    for name, field in group.items():
        if field.dtype.kind == "f" and not field.attrs.get("units"):
            yield f"{path}{name}: no units"


def faults(group, path="/"):
    """Yield the deviations of a file from the definitions of NXroot, NXentry and NXdata."""
    kind = group.attrs.get("NX_class")
    if kind not in NEXUS_TYPES:
        yield f"{path}: class {kind}"
    if kind == "NXdata":
        yield from data_faults(group, path)
    elif group.attrs.get("default") not in group:
        yield f"{path}: default names nothing"
    for name, child in group.items():
        if isinstance(child, h5py.Group):
            yield from faults(child, f"{path}{name}/")


def test_a_nexus_file_follows_the_nexus_definitions(nexus):
    with h5py.File(nexus) as file:
        assert list(faults(file)) == []


def test_nexus_values_have_physical_units_and_errors_of_half_a_converter_step(nexus, known, known_values):
    with h5py.File(nexus) as file:
        for role in known.roles:
            data = file["entry"][role]
            np.testing.assert_allclose(data["values"][:], known_values[role], rtol=1e-12)
            np.testing.assert_allclose(data["time"][:], np.arange(known.samples) / known.sample_rate_hz)
            step = abs(known.channel(role).scale_factor)
            assert data["values_errors"][5] == pytest.approx(step / 2)


def test_silx_shows_each_channel_as_a_labelled_curve(known_file, known_values):
    nxdata = pytest.importorskip("silx.io.nxdata", reason="pip install vibench[test] brings silx")
    with h5py.File(known_file) as file:
        assert nxdata.get_default(file).group.name == "/view/m0_velocity"
        for role, unit in (("drive_voltage", "V"), ("m0_velocity", "m s-1")):
            found = nxdata.get_default(file["view"][role])
            assert found.is_valid
            name = role.replace("_", " ")
            assert found.signal_name == f"{name} [{unit}]"
            assert found.axes_names == ["time since the first sample [s]"]
            assert found.title == f"known: {name} [{unit}]"
            low, high = found.signal[::2], found.signal[1::2]
            bins = known_values[role][: 128 * (len(low) - 1)].reshape(-1, 128)
            np.testing.assert_allclose(low[:-1], np.nanmin(bins, axis=1), rtol=1e-6)
            np.testing.assert_allclose(high[:-1], np.nanmax(bins, axis=1), rtol=1e-6)
            np.testing.assert_allclose(found.axes[0][::2], 128 * np.arange(len(low)) / RATE_HZ, atol=1e-12)


def test_silx_finds_the_default_plot(nexus):
    nxdata = pytest.importorskip("silx.io.nxdata", reason="pip install vibench[test] brings silx")
    with h5py.File(nexus) as file:
        for group in (file, file["entry"], file["entry"]["drive_voltage"]):
            found = nxdata.get_default(group)
            assert found.is_valid
            assert found.signal_is_1d
            assert found.axes_names == ["time [s]"]
            assert found.errors.shape == found.signal.shape
        assert "[m s-1]" in nxdata.get_default(file).signal_name
        assert nxdata.get_default(file).title == "known: m0 velocity [m s-1]"
