"""Spectra in universal files are read back by pyuff and follow the definition of dataset 58."""

import numpy as np
import pytest
from typer.testing import CliRunner

from vibench.acquisition import Block, open_recording
from vibench.acquisition.recording import ChannelHeader, Origin, RecordingHeader, create_recording
from vibench.analysis import FrequencyResponseRequest, InvalidRequest, NotEnoughData
from vibench.analysis.exchange import (
    Format,
    FunctionAxis,
    FunctionType,
    UniversalFunction,
    excerpt,
    export_functions,
    export_samples,
    open_source,
)
from vibench.analysis.results.spectral_functions import spectral_functions
from vibench.analysis.spectra import spectral_density
from vibench.cli.__main__ import app
from vibench.sim import gong2025

pyuff = pytest.importorskip("pyuff", reason="pip install vibench[test] brings pyuff")
ema = pytest.importorskip("sdypy.EMA", reason="pip install vibench[test] brings sdypy-EMA")
RESPONSE = FunctionAxis("m0_velocity", "m0 velocity", "velocity", "m/s")
REFERENCE = FunctionAxis("drive_voltage", "base acceleration", "acceleration", "m/s2")

RATE_HZ = 2000.0
VOLTS = 2.0
RUN = [
    ("check", 0.6, 0.1),
    ("ramp_up", 0.5, 1.0),
    ("", 0.4, VOLTS),
    ("dwell", 2.5, VOLTS),
    ("ramp_down", 0.5, 1.0),
]


def function(frequency_hz, values, kind=FunctionType.FREQUENCY_RESPONSE):
    return UniversalFunction(kind, frequency_hz, values, RESPONSE, REFERENCE, "estimator h1, 12 averages")


@pytest.mark.parametrize("lines", [2, 5, 1001])
@pytest.mark.parametrize("is_even", [True, False])
@pytest.mark.parametrize("is_complex", [True, False])
def test_pyuff_reads_every_line_and_both_axes(known, tmp_path, lines, is_even, is_complex):
    rng = np.random.default_rng(lines)
    hz = 12.5 + 0.125 * np.arange(lines) if is_even else np.cumsum(rng.uniform(0.1, 3.0, lines))
    values = rng.standard_normal(lines) * 10.0 ** rng.uniform(-9, 9, lines)
    if is_complex:
        values = values + 1j * rng.standard_normal(lines)
    path, facts = export_functions(excerpt(known), [function(hz, values)], Format.UFF, tmp_path / "a.uff")
    read = pyuff.UFF(str(path)).read_sets(1)
    assert facts.exists()
    assert (read["func_type"], read["abscissa_spacing"], read["ord_data_type"]) == (
        4,
        int(is_even),
        6 if is_complex else 4,
    )
    np.testing.assert_allclose(read["x"], hz, rtol=1e-12 if is_even else 6e-6)
    np.testing.assert_allclose(read["data"], values, rtol=1e-11)
    axes = ("abscissa", "ordinate", "orddenom")
    assert [read[f"{axis}_spec_data_type"] for axis in axes] == [18, 11, 12]
    assert [read[f"{axis}_len_unit_exp"] for axis in axes] == [0, 1, 1]
    assert [read[f"{axis}_axis_units_lab"].strip() for axis in axes] == ["Hz", "m/s", "m/s2"]
    assert (read["rsp_node"], read["ref_node"]) == (2, 1)
    assert read["id1"].strip() == "m0 velocity over base acceleration"


def test_lines_of_a_universal_file_have_the_width_of_the_format(known, tmp_path):
    hz = np.array([1.0, 2.5, 7.25])
    path, _ = export_functions(
        excerpt(known), [function(hz, np.array([1 + 2j, -3j, 5e-7 + 0j]))], Format.UFF, tmp_path / "a.uff"
    )
    lines = path.read_text(encoding="ascii").splitlines()
    start = lines.index("    58")
    header, numbers = lines[start + 1 : start + 12], lines[start + 12 : -1]
    assert [len(line) for line in header[:5]] == [80] * 5
    assert len(header[5]) == 5 + 10 + 5 + 10 + 2 * (1 + 10 + 10 + 4)
    assert len(header[6]) == 3 * 10 + 3 * 13
    assert {len(line) for line in header[7:]} == {10 + 3 * 5 + 2 * 21}
    assert [len(line) for line in numbers] == [13 + 2 * 20] * 3
    assert (lines[start - 1], lines[-1]) == ("    -1", "    -1")


def test_exported_densities_match_the_chosen_channels_and_time_range(known, known_values, tmp_path):
    chosen = excerpt(known, ["m0_velocity"], 0.2, 1.3)
    functions = spectral_functions(chosen, FrequencyResponseRequest())
    path, _ = export_functions(chosen, functions, Format.UFF, tmp_path / "a.uff")
    read = pyuff.UFF(str(path)).read_sets(1)
    samples = known_values["m0_velocity"][chosen.start : chosen.stop]
    wanted = spectral_density(samples, 51_200.0, segment_samples=51_200)
    assert (read["func_type"], read["ordinate_spec_data_type"]) == (9, 11)
    assert read["ordinate_axis_units_lab"].strip() == "(m s-1)2/Hz"
    np.testing.assert_allclose(read["x"], wanted.frequency_hz)
    np.testing.assert_allclose(read["data"], wanted.density, rtol=1e-10)


def write_parts(path, parts):
    """Write a recording of parts (label, duration [s], amplitude [V] of a 100 Hz sine)."""
    channel = ChannelHeader("drive_voltage", "dev/ai0", "voltage", "V", 1.0, range_v=5.0)
    header = RecordingHeader((channel,), RATE_HZ, None, Origin.SIMULATED)
    with create_recording(path, header) as writer:
        now = 0
        for label, duration_s, volts in parts:
            end = now + round(duration_s * RATE_HZ)
            if label:
                writer.begin_segment(label)
            sine = volts * np.sin(2 * np.pi * 100.0 * np.arange(now, end) / RATE_HZ)
            writer.append(Block(now, sine[np.newaxis]))
            if label:
                writer.end_segment()
            now = end
    return writer.path


@pytest.mark.parametrize(
    ("parts", "lines_hz", "told"),
    [
        (RUN, 1.0, "over 2.5 s of dwell"),
        (
            [*RUN, ("ramp_up", 0.4, 0.5), ("step", 1.9, VOLTS), ("step", 0.3, 0.1)],
            1.0,
            "over 4.4 s of dwell and step",
        ),
        (
            [("check", 3.0, 0.1), ("realisation", 0.25, VOLTS), ("ramp_down", 0.3, 0.5)],
            4.0,
            "over 0.25 s of realisation",
        ),
        ([("", 2.5, VOLTS)], 1.0, "over 2.5 s of the recording"),
    ],
)
def test_exported_densities_cover_only_the_played_segments_and_name_them(tmp_path, parts, lines_hz, told):
    run = CliRunner().invoke(
        app, ["export", str(write_parts(tmp_path / "a.h5", parts)), "--to", "uff", "--spectra"]
    )
    assert run.exit_code == 0, run.output
    read = pyuff.UFF(str(tmp_path / "a.uff")).read_sets(1)
    assert read["x"][1] == pytest.approx(lines_hz)
    # Parseval: the sum over all spectral lines is the mean square of the played signal.
    assert read["data"].sum() * lines_hz == pytest.approx(VOLTS**2 / 2, rel=1e-3)
    assert read["id4"].endswith(told), read["id4"]


def test_a_recording_without_a_drive_signal_has_no_spectral_densities(tmp_path):
    with open_recording(write_parts(tmp_path / "a.h5", RUN)) as recording:
        for stretch in ((0.0, 1.5), (0.0, 2.4)):
            with pytest.raises(
                NotEnoughData, match=r"need 1 s of uninterrupted excitation.*; choose a longer excerpt"
            ):
                next(spectral_functions(excerpt(recording, (), *stretch), FrequencyResponseRequest()))


def test_an_existing_file_or_a_wrong_format_is_refused_before_spectra_are_computed(known, tmp_path):
    computed = (pytest.fail("this takes minutes") for _ in "once")
    (tmp_path / "a.uff").touch()
    for to in (Format.UFF, Format.CSV):
        with pytest.raises(InvalidRequest, match=r"a\.uff exists|spectra were requested as csv.*choose uff"):
            export_functions(excerpt(known), computed, to, tmp_path / f"a.{to.value}")


def test_an_import_ignores_the_spectra_in_a_file(known, tmp_path):
    hz = np.arange(1.0, 5.0)
    path, _ = export_functions(excerpt(known), [function(hz, hz * 1j)], Format.UFF, tmp_path / "a.uff")
    mixed, _ = export_samples(excerpt(known), Format.UFF, tmp_path / "b.uff")
    spectrum, samples = path.read_bytes(), mixed.read_bytes()
    for content in (spectrum + samples, samples + spectrum):
        mixed.write_bytes(content)
        with open_source(mixed) as source:
            assert [each.label for each in source.channels] == ["drive_voltage", "m0_velocity"]


def velocity_of_m0(hz):
    """Velocity ratio of m0 to the base, for the paper's specimen without contact."""
    specimen = gong2025(contact="linear")
    found = []
    for s in 2j * np.pi * hz:
        forces = np.asarray(specimen.stiffness_matrix) + s * np.asarray(specimen.damping_matrix)
        motion = np.linalg.solve(forces + s**2 * np.asarray(specimen.mass_matrix), forces.sum(axis=1))
        found.append(motion[0])
    return np.array(found)


@pytest.mark.parametrize("spacing_hz", [1.0000175, 0.25, 1.0666667])
def test_modal_software_finds_the_modes_for_any_band_and_clock_ratio(known, tmp_path, spacing_hz):
    wanted = gong2025(contact="linear").natural_frequencies_hz
    for number, start_hz in enumerate((10, 37, 73)):
        hz = spacing_hz * np.arange(np.ceil(start_hz / spacing_hz), 605 / spacing_hz)
        given = [
            function(hz, velocity_of_m0(hz)),
            function(hz, np.full(hz.size, 0.99), FunctionType.COHERENCE),
        ]
        path, _ = export_functions(excerpt(known), given, Format.UFF, tmp_path / f"{number}.uff")
        model = ema.Model(lower=start_hz + 1, upper=600, pol_order_high=30)
        model.read_uff(str(path))
        first, step = model.freq[:2] - (0.0, model.freq[0])
        assert abs(first / step - round(first / step)) < 1e-3
        assert np.abs(model.freq - hz[: model.freq.size]).max() < 0.02 * spacing_hz
        np.testing.assert_allclose(model.frf[0], velocity_of_m0(model.freq), atol=2e-3)
        model.get_poles(show_progress=False)
        model.select_closest_poles(list(wanted))
        np.testing.assert_allclose(model.nat_freq, wanted, rtol=0, atol=0.03)
        _, coherence = pyuff.UFF(str(path)).read_sets([1, 2])
        np.testing.assert_allclose(coherence["x"], hz, atol=0.02 * spacing_hz)


def test_a_response_with_omitted_lines_keeps_the_frequency_of_every_line(known, tmp_path):
    hz = 1.0000175 * np.array([31, 33, 37, 39, 41])
    path, _ = export_functions(excerpt(known), [function(hz, hz * 1j)], Format.UFF, tmp_path / "a.uff")
    read = pyuff.UFF(str(path)).read_sets(1)
    assert read["abscissa_spacing"] == 0
    np.testing.assert_allclose(read["data"], hz * 1j, rtol=1e-11)
