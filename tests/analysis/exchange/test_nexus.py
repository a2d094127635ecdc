"""NeXus files: laid out as the standard says, and plotted with labels by a program of others."""

import h5py
import numpy as np
import pytest

from vibench.analysis.exchange import Format, excerpt, export_samples

NEXUS_TYPES = {"NXroot", "NXentry", "NXdata"}


@pytest.fixture
def nexus(known, tmp_path):
    path, _facts = export_samples(excerpt(known), Format.NEXUS, tmp_path / "a.nxs")
    return path


def data_faults(group, path):
    """Hold an NXdata group against its definition, and against what its readers need."""
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
    """Hold a file against what the definitions of NXroot, NXentry and NXdata require."""
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


def test_a_file_is_what_the_definitions_require(nexus):
    with h5py.File(nexus) as file:
        assert list(faults(file)) == []


def test_values_are_physical_and_errors_are_half_a_step(nexus, known, known_values):
    with h5py.File(nexus) as file:
        for role in known.roles:
            data = file["entry"][role]
            np.testing.assert_allclose(data["values"][:], known_values[role], rtol=1e-12)
            np.testing.assert_allclose(data["time"][:], np.arange(known.samples) / known.sample_rate_hz)
            step = abs(known.channel(role).scale_factor)
            assert data["values_errors"][5] == pytest.approx(step / 2)


def test_silx_finds_a_labelled_plot_by_itself(nexus):
    nxdata = pytest.importorskip("silx.io.nxdata", reason="pip install vibench[test] brings silx")
    with h5py.File(nexus) as file:
        for group in (file, file["entry"], file["entry"]["drive_voltage"]):
            found = nxdata.get_default(group)
            assert found.is_valid
            assert found.signal_is_1d
            assert found.axes_names == ["time [s]"]
            assert found.errors.shape == found.signal.shape
        assert "[m s-1]" in nxdata.get_default(file).signal_name
        assert "known" in nxdata.get_default(file).title
