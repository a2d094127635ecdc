"""Files of other programs become recordings with the same values and metadata."""

import hashlib
import io
import json
import random
import struct
import tempfile
import tracemalloc
import wave
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat, wavfile

from vibench.acquisition import ConfigurationError, load_toml, open_recording
from vibench.acquisition.recording import RecordingState
from vibench.analysis import AnalysisError, InvalidRequest, analyse
from vibench.analysis.errors import UnusableData
from vibench.analysis.exchange import (
    Format,
    ImportMapping,
    excerpt,
    export_samples,
    import_recording,
    open_source,
)
from vibench.sim.hdf5_files import allow_external_data

RATE_HZ = 8000.0
SAMPLES = 60_000
ROUNDING = 2.0**-30
"""Finest step of a stored channel, relative to its range."""
DWELL = """
started_utc = 2026-03-01T12:00:00Z
sample_rate_hz = 8000.0
[measurement]
name = "dwell-260"
excitation = { kind = "dwell", amplitude_vpp = 1.0, frequency_hz = 260, settle_s = 1, duration_s = 5 }
"""
CHANNEL = '[[channels]]\nsource = "{}"\nrole = "{}"\n{}\n'


def mapping(tmp_path, *channels, head=DWELL):
    path = tmp_path / "map.toml"
    path.write_text(head + "".join(CHANNEL.format(*each) for each in channels), encoding="utf-8")
    return load_toml(path, ImportMapping)


def signals():
    noise = np.random.default_rng(5).standard_normal((2, SAMPLES))
    return noise * np.array([[0.3], [2e-3]])


def read_import(path, meaning, out=None):
    with open_recording(import_recording(path, meaning, out or path.parent / "made.h5")) as recording:
        values = [recording.read(role) for role in recording.roles]
        return recording, np.stack(values)


def assert_same(found, wanted):
    for row, expected in zip(found, wanted, strict=True):
        np.testing.assert_allclose(row, expected, rtol=0, atol=2 * np.nanmax(np.abs(expected)) * ROUNDING)


def test_the_columns_of_a_table_in_hdf5_become_channels(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["run/data"] = signals().T
    meaning = mapping(tmp_path, ("/run/data#1", "drive_voltage", ""), ("/run/data#2", "m0_velocity", ""))
    recording, values = read_import(tmp_path / "a.h5", meaning)
    assert_same(values, signals())
    assert recording.state is RecordingState.COMPLETE
    assert recording.sample_rate_hz == RATE_HZ
    assert recording.channel("m0_velocity").unit == "m s-1"
    assert recording.started_utc.startswith("2026-03-01T12:00:00")


def test_the_scales_of_the_file_and_of_the_mapping_are_multiplied_and_integers_stay_exact(tmp_path):
    counts = np.random.default_rng(1).integers(-(2**23), 2**23, SAMPLES, dtype=np.int32)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["acc"] = counts
        file["acc"].attrs["scale_factor"] = 1e-6
    meaning = mapping(tmp_path, ("acc", "base_acceleration", "scale = 9.80665"))
    recording, values = read_import(tmp_path / "a.h5", meaning)
    np.testing.assert_allclose(values[0], counts * 1e-6 * 9.80665, rtol=1e-12)
    with open_recording(recording.path) as again:
        np.testing.assert_array_equal(again.read_counts("base_acceleration"), counts)


def test_a_file_in_volts_is_scaled_by_the_sensitivity_of_the_sensor(tmp_path):
    volts = signals()
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["acc"], file["vib"] = volts
        file["vib"].attrs["units"] = "V"
        file["other"] = volts[0]
        file["other"].attrs["units"] = "m s-2"
    channels = [
        ("acc", "base_acceleration", 'scale = "100 mV/g"'),
        ("vib", "m0_velocity", 'scale = "250 mm/s/V"'),
        ("acc", "force", 'quantity = "force"\nunit = "N"\nscale = "50 mV/N"'),
    ]
    _, values = read_import(tmp_path / "a.h5", mapping(tmp_path, *channels))
    assert_same(values, [98.0665 * volts[0], 0.25 * volts[1], 20.0 * volts[0]])
    scaled = mapping(tmp_path, ("other", "base_acceleration", 'scale = "100 mV/g"'))
    with pytest.raises(InvalidRequest, match=r"acceleration is in 'm s-2'.* for a file in volts"):
        import_recording(tmp_path / "a.h5", scaled, tmp_path / "second.h5")


def test_non_finite_values_are_imported_as_lost_samples(tmp_path):
    wanted = signals()
    wanted[0, 55_000:55_003] = np.nan
    wanted[1, 10] = np.inf
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["a"], file["b"] = wanted
    meaning = mapping(tmp_path, ("a", "drive_voltage", ""), ("b", "m0_velocity", ""))
    recording, values = read_import(tmp_path / "a.h5", meaning)
    assert [(each.first_sample, each.last_sample) for each in recording.gaps] == [(10, 10), (55_000, 55_002)]
    expected = np.where(np.isfinite(wanted).all(axis=0), wanted, np.nan)
    assert_same(values, expected)


@pytest.mark.parametrize(
    ("said", "more", "factor"),
    [
        ("mm/s", "", 1e-3),
        ("mm/s", "scale = 1e-3", 1e-3),
        ("mm/s", "scale = -0.00102", -0.00102),
        ("mm/s", 'file_unit = "in/s"', 0.0254),
        ("", 'file_unit = "um/s"', 1e-6),
        ("m s^-1", "", 1.0),
        ("mV", 'scale = "250 mm/s/V"', 0.25e-3),
        ("V", "scale = 0.5", 0.5),
        ("knots", "scale = 0.514444", 0.514444),
        ("mm/s", "scale = 1.0", "leave scale out"),
        ("mm/s", 'scale = "250 mm/s/V"', "for a file in volts"),
        ("um", "scale = 1.0", "choose another channel"),
        ("g", "", "choose another channel"),
        ("V", "", "sensitivity of the sensor"),
        ("knots", "", "as a number of 'm s-1' per 'knots'"),
    ],
)
def test_a_unit_in_the_file_sets_the_scale_and_an_unsuitable_unit_is_refused(tmp_path, said, more, factor):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["u"], file["v"] = signals()
        file["v"].attrs["units"] = said
    meaning = mapping(tmp_path, ("u", "drive_voltage", ""), ("v", "m0_velocity", more))
    if isinstance(factor, str):
        with pytest.raises(InvalidRequest, match=factor):
            read_import(tmp_path / "a.h5", meaning)
        return
    _, values = read_import(tmp_path / "a.h5", meaning)
    assert_same(values, [signals()[0], factor * signals()[1]])


def test_a_tdms_file_is_imported_with_its_rate_and_its_values(tmp_path):
    nptdms = pytest.importorskip("nptdms", reason="pip install vibench[exchange] brings npTDMS")
    about = {"wf_increment": 1 / RATE_HZ, "unit_string": "V"}
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        for piece in np.split(signals(), 3, axis=1):
            writer.write_segment(
                [
                    nptdms.ChannelObject("Measured", "Base", piece[0], about),
                    nptdms.ChannelObject("Measured", "Laser", piece[1], about),
                ]
            )
    with open_source(tmp_path / "a.tdms") as source:
        assert [(each.name, each.unit) for each in source.channels] == [
            ("Measured/Base", "V"),
            ("Measured/Laser", "V"),
        ]
    head = DWELL.replace("sample_rate_hz = 8000.0\n", "")
    meaning = mapping(
        tmp_path, ("Base", "drive_voltage", ""), ("Measured/Laser", "m0_velocity", "scale = 1.0"), head=head
    )
    recording, values = read_import(tmp_path / "a.tdms", meaning)
    assert recording.sample_rate_hz == pytest.approx(RATE_HZ, rel=1e-12)
    assert_same(values, signals())


@pytest.mark.parametrize(("dtype", "full"), [(np.int16, 2**15), (np.int32, 2**31), (np.float32, 1)])
def test_samples_of_a_wav_file_are_read_as_fractions_of_full_scale(tmp_path, dtype, full):
    fractions = np.clip(signals()[0], -0.9, 0.9)
    stored = (fractions * full).astype(dtype)
    wavfile.write(tmp_path / "a.wav", int(RATE_HZ), np.stack((stored, -stored), axis=1))
    meaning = mapping(tmp_path, ("1", "drive_voltage", "scale = 10.0"), ("2", "m0_velocity", "scale = 1.0"))
    _, values = read_import(tmp_path / "a.wav", meaning)
    exact = stored.astype(float) / full
    np.testing.assert_allclose(values, np.stack((10 * exact, -exact)), rtol=0, atol=1e-8)


def test_a_wav_file_of_24_bits_keeps_every_bit(tmp_path):
    counts = np.random.default_rng(2).integers(-(2**22), 2**22, SAMPLES, dtype=np.int32)
    with wave.open(str(tmp_path / "a.wav"), "wb") as file:
        file.setparams((1, 3, int(RATE_HZ), 0, "NONE", ""))
        file.writeframes(counts.astype("<i4").view(np.uint8).reshape(-1, 4)[:, :3].tobytes())
    _, values = read_import(tmp_path / "a.wav", mapping(tmp_path, ("1", "m0_velocity", "scale = 1.0")))
    np.testing.assert_array_equal(values[0], counts / 2.0**23)


def test_wav_samples_with_more_bits_than_the_file_states_are_refused(tmp_path):
    counts = np.random.default_rng(2).integers(-(2**22), 2**22, SAMPLES, dtype=np.int32)
    meaning = mapping(tmp_path, ("1", "m0_velocity", "scale = 1.0"))
    for name, stored in (("left", counts << 8), ("right", counts), ("plain", counts)):
        extensible = struct.pack("<HHIIHHHHI", 0xFFFE, 1, int(RATE_HZ), 4 * int(RATE_HZ), 4, 32, 22, 24, 4)
        form = extensible + bytes.fromhex("0100000000001000800000aa00389b71")
        if name == "plain":
            form = struct.pack("<HHIIHH", 1, 1, int(RATE_HZ), 4 * int(RATE_HZ), 4, 25)
        body = b"WAVEfmt " + struct.pack("<I", len(form)) + form
        body += b"data" + struct.pack("<I", 4 * SAMPLES) + stored.astype("<i4").tobytes()
        (tmp_path / f"{name}.wav").write_bytes(b"RIFF" + struct.pack("<I", len(body)) + body)
    _, values = read_import(tmp_path / "left.wav", meaning)
    np.testing.assert_array_equal(values[0], counts / 2.0**23)
    for name in ("right", "plain"):
        with pytest.raises(UnusableData, match=r"states 2[45] bits per sample, but its samples have more"):
            read_import(tmp_path / f"{name}.wav", meaning)


@pytest.mark.parametrize("shape", [(SAMPLES,), (SAMPLES, 2), (2, SAMPLES)])
def test_hdf5_chunks_that_were_never_written_are_imported_as_lost_samples(tmp_path, shape):
    axis = int(np.argmax(shape))
    with h5py.File(tmp_path / "a.h5", "w") as file:
        chunk = tuple(size if size < SAMPLES else 1000 for size in shape)
        dataset = file.create_dataset("a", shape, chunks=chunk, dtype=float)
        signal = signals()[1]
        for part in (slice(0, 20_000), slice(25_000, SAMPLES)):
            where = tuple(part if each == axis else slice(None) for each in range(len(shape)))
            dataset[where] = signal[part, None] if len(shape) == 2 and axis == 0 else signal[part]
    name = "a" if len(shape) == 1 else "a#2"
    recording, _ = read_import(tmp_path / "a.h5", mapping(tmp_path, (name, "m0_velocity", "")))
    assert [(each.first_sample, each.last_sample) for each in recording.gaps] == [(20_000, 24_999)]


def test_samples_near_a_stated_full_scale_count_as_overloads(tmp_path):
    wanted = 0.1 * signals()[:1]
    wanted[0, 100:103] = 0.96
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["a"] = wanted[0]
    meaning = mapping(tmp_path, ("a", "m0_velocity", "full_scale = 1.0"))
    recording, _ = read_import(tmp_path / "a.h5", meaning)
    assert [(each.first_sample, each.last_sample) for each in recording.overloads] == [(100, 102)]


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # pyuff leaves a file open
@pytest.mark.parametrize(("binary", "single"), [(0, False), (0, True), (1, False)])
def test_universal_files_written_by_pyuff_are_read(tmp_path, binary, single):
    pyuff = pytest.importorskip("pyuff", reason="pip install vibench[test] brings pyuff")
    file = pyuff.UFF(str(tmp_path / "a.uff"))
    wanted = signals()[:, :4001]
    if single:
        wanted = wanted.astype(np.float32).astype(float)
    for number, row in enumerate(wanted, start=1):
        each = pyuff.prepare_58(
            binary=binary,
            func_type=1,
            rsp_node=number,
            rsp_dir=3,
            ref_node=0,
            ref_dir=0,
            data=row,
            x=np.arange(row.size) / RATE_HZ,
            id1=f"point {number}",
            ord_data_type=2,
            abscissa_spacing=1,
            abscissa_spec_data_type=17,
            ordinate_spec_data_type=11,
            orddenom_spec_data_type=0,
        )
        file.write_sets([each], "add", force_double=not single)
    head = DWELL.replace("settle_s = 1,", "settle_s = 0,")
    meaning = mapping(tmp_path, ("point 1", "drive_voltage", ""), ("2", "m0_velocity", ""), head=head)
    _, values = read_import(tmp_path / "a.uff", meaning)
    digits = 1e-5 if single else 1e-10
    np.testing.assert_allclose(values, wanted, rtol=digits, atol=2 * np.abs(wanted).max() * ROUNDING)


def test_single_precision_big_endian_binary_samples_are_read(known, known_values, tmp_path):
    path, _ = export_samples(excerpt(known, ("m0_velocity",), to_s=1.0), Format.UFF, tmp_path / "a.uff")
    lines = path.read_bytes().split(b"\n", 19)
    kind, numbers = lines[7], lines[14]
    lines[7] = kind.replace(b"58b     1", b"58b     2").replace(
        b"%12d" % (8 * 51_200), b"%12d" % (4 * 51_200)
    )
    lines[14] = b"         2" + numbers[10:]
    lines[19] = known_values["m0_velocity"][:51_200].astype(">f4").tobytes() + b"\n    -1\n"
    path.write_bytes(b"\n".join(lines))
    with open_source(path) as source:
        read = source.read(source.channels[0], 3, 51_200)
    np.testing.assert_array_equal(read, known_values["m0_velocity"][3:51_200].astype(np.float32))


@pytest.mark.parametrize("ending", ["    -1\n", "\n    -1\n", "\r\n    -1\r\n"])
def test_trailing_bytes_after_binary_samples_are_ignored(known, known_values, tmp_path, ending):
    path, _ = export_samples(excerpt(known, to_s=1.0), Format.UFF, tmp_path / "a.uff")
    head, *bodies = path.read_bytes().split(b"    -1\n    58b")
    kept = [body.removesuffix(b"    -1\n") for body in bodies]
    path.write_bytes(head + b"".join(b"    -1\n    58b" + each + ending.encode() for each in kept))
    head = DWELL.replace("8000.0", "51200.0").replace("settle_s = 1,", "settle_s = 0,")
    meaning = mapping(tmp_path, ("m0_velocity", "m0_velocity", ""), head=head)
    _, values = read_import(path, meaning)
    assert_same(values, [known_values["m0_velocity"][:51_200]])


@pytest.mark.parametrize("unit", [b"m/s\xb2 ", b"m/s\xc2\xb2"])
def test_units_in_a_file_may_contain_non_ascii_characters(known, tmp_path, unit):
    path, _ = export_samples(excerpt(known, ("m0_velocity",), to_s=0.1), Format.UFF, tmp_path / "a.uff")
    path.write_bytes(path.read_bytes().replace(b"m s-1", unit))
    with open_source(path) as source:
        assert source.channels[0].unit == "m/s²"


def test_binary_samples_that_look_like_a_delimiter_are_read(known, tmp_path):
    path, _ = export_samples(excerpt(known, ("drive_voltage",), to_s=1.0), Format.UFF, tmp_path / "a.uff")
    raw = path.read_bytes()
    at = raw.rindex(b"    -1\n") - 8 * 100
    path.write_bytes(raw[:at] + b"\n    -1\n" + raw[at + 8 :])
    with open_source(path) as source:
        (only,) = source.channels
        read = source.read(only, 51_099, 51_102)
    assert read[1] == np.frombuffer(b"\n    -1\n", "<f8")[0]
    assert (read[0], read[2]) == (
        known.read("drive_voltage", 51_099)[0],
        known.read("drive_voltage", 51_101)[0],
    )


def test_a_dwell_that_was_exported_and_imported_gives_the_same_results(dwell_file, tmp_path):
    with open_recording(dwell_file()) as recording:
        original = analyse(recording)
        path, _ = export_samples(excerpt(recording), Format.UFF, tmp_path / "dwell.uff")
        delay_s = recording.channel("m0_velocity").delay_s
        start_s = recording.segments[0].start / recording.sample_rate_hz
        plan = original.excitation
    head = (
        f"started_utc = 2026-03-01T12:00:00Z\nbegins_s = {start_s - plan.settle_s!r}\n"
        '[measurement]\nname = "weak"\nexcitation = { kind = "dwell", frequency_hz = 260.0, '
        f"amplitude_vpp = {plan.amplitude_vpp!r}, settle_s = {plan.settle_s!r}, "
        f"duration_s = {plan.duration_s!r} }}\n"
    )
    channels = [
        ("drive_voltage", "drive_voltage", ""),
        ("base_acceleration", "base_acceleration", ""),
        ("m0_velocity", "m0_velocity", f"delay_s = {delay_s!r}"),
    ]
    found = analyse(import_recording(path, mapping(tmp_path, *channels, head=head), tmp_path / "made.h5"))
    assert found.response.response_i == pytest.approx(original.response.response_i, rel=1e-6)
    assert found.response.response_ii == pytest.approx(original.response.response_ii, rel=1e-6)
    assert found.facts.whole_stretches == found.facts.planned_stretches == 1


@pytest.mark.thorough
def test_export_and_import_use_bounded_memory(tmp_path):
    samples = 2_000_000
    with h5py.File(tmp_path / "long.h5", "w") as file:
        file["v"] = np.random.default_rng(0).standard_normal(samples)
    meaning = mapping(tmp_path, ("v", "m0_velocity", ""))
    tracemalloc.start()
    try:
        import_recording(tmp_path / "long.h5", meaning, tmp_path / "made.h5")
        with open_recording(tmp_path / "made.h5") as recording:
            export_samples(excerpt(recording), Format.UFF, tmp_path / "long.uff")
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 0.4 * samples * 8


def test_an_imported_recording_names_its_source(tmp_path):
    wavfile.write(tmp_path / "a.wav", int(RATE_HZ), signals()[0].astype(np.float32))
    recording, _ = read_import(tmp_path / "a.wav", mapping(tmp_path, ("1", "m0_velocity", 'serial = "V-7"')))
    said = recording.bench["imported"]
    digest = hashlib.sha256((tmp_path / "a.wav").read_bytes()).hexdigest()
    assert (said["file"], said["sha256"]) == ("a.wav", digest)
    assert said["mapping"]["channels"][0]["serial"] == "V-7"
    assert recording.reason == "imported from a.wav"
    assert json.loads(json.dumps(recording.plan))["excitation"]["frequency_hz"] == 260


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("started_utc = 2026-03-01T12:00:00Z", "", "started_utc is missing"),
        ("2026-03-01T12:00:00Z", "2026-03-01T12:00:00", "started_utc.*time zone"),
        ("frequency_hz = 260", "frequency = 260", "frequency is not a known key"),
        ('role = "m0_velocity"', 'role = "m0_velocity"\nunit = "mm s-1"', "convert the numbers with scale"),
        ('role = "m0_velocity"', 'role = "other"', "needs quantity and unit"),
        ('role = "m0_velocity"', 'role = "m0_velocity"\nscale = 0', "all values would be 0"),
        ('role = "m0_velocity"', 'role = "m0_velocity"\nscale = "100 mV/g"', "such as '250 mm/s/V'"),
        ('role = "m0_velocity"', 'role = "m0_velocity"\nscale = "4 V/m/s"', "two ways"),
        ('role = "m0_velocity"', 'role = "m0_velocity"\nscale = true', "number"),
        ('role = "m0_velocity"', 'role = "drive_voltage"\nscale = "10 V/V"', "a voltage; give a number"),
    ],
)
def test_the_error_for_a_wrong_mapping_names_the_key(tmp_path, old, new, said):
    text = DWELL + CHANNEL.format("1", "m0_velocity", "")
    (tmp_path / "map.toml").write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(ConfigurationError, match=said):
        load_toml(tmp_path / "map.toml", ImportMapping)


def test_an_unsuitable_mapping_is_refused_without_leftovers(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["x/v"], file["y/v"], file["short"] = (*signals(), np.ones(5))
    one = ("x/v", "m0_velocity", "")
    refusals = [
        ([("w", "m0_velocity", "")], DWELL, r"no channel 'w'; it has '/short' \(short\), '/x/v' \(v\)"),
        ([("v", "m0_velocity", "")], DWELL, "several channels 'v'"),
        ([("/x/v", *one[1:]), ("/short", "drive_voltage", "")], DWELL, "have different numbers of samples"),
        ([("/x/v", *one[1:]), ("/x/v", "base_acceleration", "")], DWELL, "are both read from '/x/v'"),
        ([("/x/v", *one[1:])], DWELL.replace("sample_rate_hz = 8000.0\n", ""), "give sample_rate_hz"),
        ([("/x/v", *one[1:])], "begins_s = 7.0\n" + DWELL, "no part of the plan begins within the 7.5 s"),
    ]
    for channels, head, said in refusals:
        with pytest.raises(InvalidRequest, match=said):
            import_recording(tmp_path / "a.h5", mapping(tmp_path, *channels, head=head), tmp_path / "made.h5")
    assert sorted(each.name for each in tmp_path.iterdir()) == ["a.h5", "map.toml"]


@pytest.mark.parametrize(
    ("heading", "unit_s", "digits", "rate_hz"),
    [
        ("t [s]", 1.0, 9, 8020.0),
        ("Zeit (s)", 1.0, 9, 8000.0),
        ("Time [ms]", 1e-3, 6, 1000.0),
        ("time (\u00b5s)", 1e-6, 3, 8020.0),
        ("time [s]", 1.0, 2, 8000.0),
        ("time [s]", 1.0, 2, 1000.0),
    ],
)
def test_a_rate_that_contradicts_a_time_column_is_refused(tmp_path, heading, unit_s, digits, rate_hz):
    rows = (f"{k / rate_hz / unit_s:.{digits}f};{value!r}\n" for k, value in enumerate(signals()[0].tolist()))
    (tmp_path / "a.csv").write_text(f"{heading};v\n" + "".join(rows), encoding="utf-8")
    meaning = mapping(tmp_path, ("v", "m0_velocity", ""))
    if rate_hz == RATE_HZ:
        assert read_import(tmp_path / "a.csv", meaning)[0].sample_rate_hz == RATE_HZ
        return
    with pytest.raises(InvalidRequest, match=r"a\.csv states .* samples/s, but the mapping states 8000"):
        read_import(tmp_path / "a.csv", meaning)
    assert not (tmp_path / "made.h5").exists()


@pytest.mark.parametrize(
    ("increment", "unit", "said"),
    [
        (
            "  1.95313E-05",
            "s",
            "states about 51200 samples/s, but the mapping states 8000; correct the mapping, or export",
        ),
        ("  1.25000D-04", "s", None),
        ("  2.00000E-01", "ms", "states about 5000 samples/s"),
        ("  2.00000E-01", "r", "has an axis in 'r' with steps of 0.2"),
        ("  0.00000E+00", "s", None),
        ("             ", "s", None),
    ],
)
def test_a_sampling_rate_that_contradicts_a_universal_file_is_refused(known, tmp_path, increment, unit, said):
    path, _ = export_samples(excerpt(known, ("m0_velocity",), to_s=1.0), Format.UFF, tmp_path / "a.uff")
    lines = path.read_bytes().split(b"\n", 19)
    lines[12] = b"NONE"
    lines[14] = lines[14][:43] + increment.encode() + lines[14][56:]
    lines[15] = lines[15][:46] + unit.encode().ljust(20)
    path.write_bytes(b"\n".join(lines))
    meaning = mapping(
        tmp_path, ("1", "m0_velocity", ""), head=DWELL.replace("settle_s = 1,", "settle_s = 0,")
    )
    if said is None:
        assert read_import(path, meaning)[0].sample_rate_hz == RATE_HZ
        return
    with pytest.raises(InvalidRequest, match=said):
        read_import(path, meaning)


@pytest.mark.parametrize("to", [Format.UFF, Format.MAT, Format.CSV])
def test_a_sampling_rate_that_contradicts_a_vibench_export_is_refused(known, tmp_path, to):
    path, *_ = export_samples(excerpt(known, to_s=0.5), to, tmp_path / f"a.{to.value}")
    source = "m0_velocity.values" if to is Format.MAT else "m0_velocity"
    for each in (path, known.path):
        meaning = mapping(tmp_path, (source if each is path else "/m0_velocity", "m0_velocity", ""))
        with pytest.raises(InvalidRequest, match=r"states .* samples/s, but the mapping states 8000"):
            read_import(each, meaning, tmp_path / "made.h5")


def wav_bytes(width, kept=None, samples=100):
    with io.BytesIO() as made:
        with wave.open(made, "wb") as file:
            file.setparams((2, width, int(RATE_HZ), 0, "NONE", ""))
            file.writeframes(bytes(2 * width * samples))
        return made.getvalue()[:kept]


def uff_bytes(known, old=b"", new=b"", kept=None):
    """Return one channel as a universal file, with one text replaced or truncated."""
    with tempfile.TemporaryDirectory() as folder:
        path, _ = export_samples(
            excerpt(known, ("m0_velocity",), to_s=0.01), Format.UFF, Path(folder, "a.uff")
        )
        raw = path.read_bytes()
    assert old in raw
    return raw.replace(old, new)[:kept]


def hdf5_bytes(kept):
    with io.BytesIO() as made:
        with h5py.File(made, "w") as file:
            file["v"] = signals()[0]
        return made.getvalue()[:kept]


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.wav", wav_bytes(2, 245), "states 400 bytes of samples, but contains 201"),
        ("a.wav", wav_bytes(2, 248), "states 400 bytes of samples, but contains 204"),
        ("a.wav", wav_bytes(3, 245), "states 600 bytes of samples, but contains 201"),
        ("a.wav", wav_bytes(2, 44), "states 400 bytes of samples, but contains 0"),
        ("a.wav", wav_bytes(2, 30), "states 16 bytes about its samples, but contains 10"),
        ("a.wav", wav_bytes(2, 36), "it ends before its samples"),
        ("a.wav", wav_bytes(2).replace(struct.pack("<II", 8000, 32000), bytes(8)), "it states 0 Hz"),
        (
            "a.wav",
            wav_bytes(3).replace(b"\x06\0\x18\0", b"\x03\0\x18\0"),
            "and 3 bytes for 2 samples of 24 bits",
        ),
        ("a.wav", wav_bytes(2).replace(struct.pack("<I", 400), bytes(4)), "it states 0 bytes of samples"),
        ("a.uff", {"kept": 1000}, "it ends inside a dataset"),
        (
            "a.uff",
            {"old": b"58b     1     2", "new": b"58b     x     2"},
            "a dataset 58 has 'x'",
        ),
        ("a.uff", {"old": b"58b     1", "new": b"58b     7"}, "its byte order is 7"),
        (
            "a.uff",
            {"old": b"         4       512", "new": b"         4          "},
            "a dataset 58 has ''",
        ),
        ("a.h5", hdf5_bytes(9000), r"has 9000 of \d+ bytes"),
        ("a.csv", b"a,b\n1,2\n3,x\n", "line 3 contains 'x' instead of a number"),
        ("a.csv", b"a,b\n1,2\n\n3,\n", "line 4 contains '' instead of a number"),
        (
            "a.csv",
            b"a;b\n1,5;2\n3;4\n3\n",
            "line 4 and line 2 have different numbers of columns: 1 instead",
        ),
    ],
)
def test_file_errors_name_the_file_and_are_stated_once(known, tmp_path, name, content, said):
    (tmp_path / name).write_bytes(uff_bytes(known, **content) if isinstance(content, dict) else content)
    with pytest.raises(UnusableData, match=said) as refused, open_source(tmp_path / name) as source:
        source.read(source.channels[0], 0, source.channels[0].samples)
    assert str(refused.value).startswith(name)
    assert str(refused.value).count("again") == 1


@pytest.mark.parametrize("text", [b"m/s\xb2", "m/s\u00b2".encode()])
@pytest.mark.parametrize("is_fixed", [True, False])
def test_a_unit_in_hdf5_may_be_a_fixed_or_variable_length_string(tmp_path, text, is_fixed):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["v"] = signals()[0]
        kind = h5py.string_dtype("utf-8", len(text) if is_fixed else None)
        file["v"].attrs.create("units", text, dtype=kind)
    with open_source(tmp_path / "a.h5") as source:
        assert source.channels[0].unit == "m/s\u00b2"


@pytest.mark.parametrize("heading", ["m0 / Gal", "m0 / ips", "m0 / ft/s^2"])
def test_an_unknown_unit_in_a_heading_is_not_taken_as_an_si_unit(tmp_path, heading):
    text = "".join(f"{number / 8000:.6f};{number % 7}\n" for number in range(40_000))
    (tmp_path / "a.csv").write_text(f"time / s;{heading}\n{text}")
    with pytest.raises(
        InvalidRequest, match=r"m0_velocity is in '.*' in the file, but the recording needs 'm s-1'"
    ):
        read_import(tmp_path / "a.csv", mapping(tmp_path, ("2", "m0_velocity", "")))


@pytest.mark.parametrize("encoding", ["cp037", "utf-16-le"])
def test_the_error_for_zero_bytes_in_a_text_table_explains_the_zero_bytes(tmp_path, encoding):
    text = "Zeit [s];v [m/s]\n" + "".join(f"{0.001 * number:.3f};1\n" for number in range(20))
    (tmp_path / "a.csv").write_bytes(text.encode(encoding) + b"\0\0\0")
    with (
        pytest.raises(UnusableData, match=r"zero bytes|lines contains numbers only"),
        open_source(tmp_path / "a.csv"),
    ):
        pass


@pytest.mark.parametrize(
    "encoding", ["latin-1", "utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32"]
)
def test_a_csv_heading_may_be_in_any_common_encoding(tmp_path, encoding):
    text = "F\u00fchrung am Fu\u00df\nZeit [s];Fu\u00dfpunkt (\u00b5m)\n0,0;1,5\n0,5;-2\n1,0;3\n"
    (tmp_path / "a.csv").write_bytes(text.encode(encoding))
    with open_source(tmp_path / "a.csv") as source:
        _, column = source.channels
        assert (column.label, column.unit, column.sample_rate_hz) == ("Fu\u00dfpunkt", "\u00b5m", 2.0)
        assert source.read(column, 0, 3).tolist() == [1.5, -2.0, 3.0]
    with pytest.raises(InvalidRequest, match=r"no channel 'x'; it has '1' \(Zeit\), '2' \(Fu\u00dfpunkt\)"):
        read_import(tmp_path / "a.csv", mapping(tmp_path, ("x", "m0_velocity", "")))


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.pkl", b"\x80\x04", "cannot be imported"),
        ("a.npy", b"\x93NUMPY", "cannot be imported"),
        ("a.h5", b"text", "is not an HDF5 file"),
        ("a.mat", b"MATLAB 5.0 MAT-file", "is damaged, or has a wrong suffix"),
        ("a.csv", b"a,b\nc,d\n", "lines contains numbers only"),
        ("a.csv", b"", r"wrong suffix \(empty\)"),
        ("a.wav", b"RIFF\x00\x00", "is damaged, or has a wrong suffix"),
        ("a.uff", b"    -1\n    58b     1     2\n", "is damaged, or has a wrong suffix"),
        ("a.unv", b"    -1\n   164\n    -1\n", "contains no real samples over time"),
    ],
)
def test_a_file_with_a_wrong_suffix_gives_a_one_sentence_error(tmp_path, name, content, said):
    (tmp_path / name).write_bytes(content)
    with pytest.raises((InvalidRequest, UnusableData), match=said), open_source(tmp_path / name):
        pass


def test_an_invalid_tdms_file_gives_a_one_sentence_error(tmp_path):
    pytest.importorskip("nptdms", reason="pip install vibench[exchange] brings npTDMS")
    (tmp_path / "a.tdms").write_bytes(b"nothing of the kind")
    with pytest.raises(UnusableData, match="is not a TDMS file"), open_source(tmp_path / "a.tdms"):
        pass


def test_non_numeric_objects_in_hdf5_are_not_offered_as_channels(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["v"] = signals()[0]
        file.create_dataset("pickled", data=np.void(b"\x80\x04K\x01."))
        file.create_dataset("text", data=["a", "b"], dtype=h5py.string_dtype())
        file.create_dataset("complex", data=np.ones(9, dtype=complex))
    with open_source(tmp_path / "a.h5") as source:
        assert [each.name for each in source.channels] == ["/v"]


def test_external_links_are_followed_only_if_allowed(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["v"] = signals()[0]
        file["elsewhere"] = h5py.ExternalLink("b.h5", "/v")
    with pytest.raises(UnusableData, match=r"/elsewhere refers to another file \(b.h5\).*--allow-external"):
        open_source(tmp_path / "a.h5").__enter__()
    with allow_external_data(), open_source(tmp_path / "a.h5") as source:
        assert [each.name for each in source.channels] == ["/v"]


def test_an_interrupted_import_leaves_no_file(tmp_path):
    def interrupt(_):
        raise KeyboardInterrupt

    wavfile.write(tmp_path / "a.wav", int(RATE_HZ), signals()[0].astype(np.float32))
    meaning = mapping(tmp_path, ("1", "m0_velocity", ""))
    with pytest.raises(KeyboardInterrupt):
        import_recording(tmp_path / "a.wav", meaning, tmp_path / "made.h5", interrupt)
    assert sorted(each.name for each in tmp_path.iterdir()) == ["a.wav", "map.toml"]


@pytest.mark.parametrize(
    ("number", "units"), [(1, ["V", "m s-2", "m s-1"]), (2, ["V", "m s-2", "m s-1", "N"])]
)
def test_the_mappings_in_the_manual_are_valid(tmp_path, number, units):
    manual = (Path(__file__).parents[3] / "docs" / "exchange.md").read_text(encoding="utf-8")
    (tmp_path / "map.toml").write_text(manual.split("```toml\n")[number].split("```")[0], encoding="utf-8")
    meaning = load_toml(tmp_path / "map.toml", ImportMapping)
    assert [each.kind[1] for each in meaning.channels] == units


@pytest.mark.parametrize(("role", "unit"), [("m0_acceleration", "m s-2"), ("m0_displacement", "m")])
def test_sensors_on_m0_need_no_unit_in_the_mapping(tmp_path, role, unit):
    meaning = mapping(tmp_path, ("1", "drive_voltage", ""), ("2", role, ""))
    assert meaning.channels[1].kind == (role.removeprefix("m0_"), unit)


def test_one_channel_of_a_file_can_be_imported_under_two_roles(tmp_path):
    wavfile.write(tmp_path / "a.wav", int(RATE_HZ), signals()[0].astype(np.float32))
    meaning = mapping(tmp_path, ("1", "drive_voltage", "scale = 2.0"), ("1", "base_acceleration", ""))
    _, values = read_import(tmp_path / "a.wav", meaning)
    np.testing.assert_array_equal(values[0], 2.0 * values[1])


@pytest.mark.parametrize("to", [Format.MAT, Format.CSV])
def test_matlab_and_text_exports_can_be_imported(known, known_values, tmp_path, to):
    path, *_ = export_samples(excerpt(known, to_s=1.0), to, tmp_path / f"a.{to.value}")
    head = DWELL.replace("8000.0", "51200.0").replace("settle_s = 1,", "settle_s = 0,")
    channels = (
        [(role, role, "") for role in known.roles]
        if to is Format.CSV
        else [(f"{role}.values", role, "") for role in known.roles]
    )
    _, values = read_import(path, mapping(tmp_path, *channels, head=head))
    wanted = np.stack([known_values[role][:51_200] for role in known.roles])
    np.testing.assert_allclose(values, wanted, rtol=1e-9, atol=1e-8)


def test_matrices_and_fields_of_matlab_5_become_channels(tmp_path):
    field = {"data": signals()[0], "units": "V"}
    savemat(tmp_path / "a.mat", {"run": {"vib": field}, "table": signals().T, "name": "text", "n": 3.0})
    with open_source(tmp_path / "a.mat") as source:
        assert {each.name: each.unit for each in source.channels} == {
            "run.vib.data": "V",
            "table#1": "",
            "table#2": "",
        }
    meaning = mapping(tmp_path, ("data", "drive_voltage", ""), ("table#2", "m0_velocity", ""))
    _, values = read_import(tmp_path / "a.mat", meaning)
    assert_same(values, signals())


@pytest.mark.parametrize(
    ("text", "label", "rate_hz"),
    [
        ("Time (s),Vib (m/s)\n0,1.5\n0.001,-2\n0.002,1e-3\n", "Vib", 1000.0),
        ('"time";"Vib (m/s)"\n0;1,5\n0,001;-2\n0,002;1e-3\n', "Vib", 1000.0),
        ("recorded by X\n\nno\tVib (m/s)\n0\t1.5\n1\t-2\n2\t1e-3\n", "Vib", None),
        ("0 1.5\n1 -2\n2 1e-3\n", "", None),
        ("time,Vib (m/s)\n0,1.5\n0.001,-2\n0.004,1e-3\n", "Vib", None),
    ],
)
def test_common_formats_of_text_columns_are_read(tmp_path, text, label, rate_hz):
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    with open_source(tmp_path / "a.csv") as source:
        _, column = source.channels
        assert source.read(column, 0, 3).tolist() == [1.5, -2.0, 1e-3]
    assert (column.label, column.unit) == (label, "m/s" if label else "")
    assert column.sample_rate_hz == (None if rate_hz is None else pytest.approx(rate_hz))


def corrupt(raw, dice):
    """Change a few bytes, mostly of the header, and sometimes truncate the file."""
    found = bytearray(raw[: dice.randrange(len(raw))] if dice.random() < 0.3 else raw)
    for _ in range(dice.randrange(1, 6)):
        if found:
            at = dice.randrange(len(found) if dice.random() < 0.3 else min(len(found), 1200))
            found[at] = dice.choice([dice.randrange(256), *b" -09\xff\x00"])
    return bytes(found)


@pytest.mark.parametrize("suffix", ["uff", "h5", "wav", "tdms", "mat", "csv"])
def test_a_corrupted_file_never_crashes_the_import(known, tmp_path, suffix):
    path = tmp_path / f"a.{suffix}"
    data = signals()[:, :500]
    match suffix:
        case "uff":
            export_samples(excerpt(known, to_s=0.01), Format.UFF, path)
        case "h5":
            with h5py.File(path, "w") as file:
                file["table"] = data
                file.create_dataset("packed", data=data[0], chunks=(100,), compression="gzip")
        case "wav":
            wavfile.write(path, int(RATE_HZ), data.T.astype(np.float32))
        case "mat":
            savemat(path, {"table": data})
        case "csv":
            np.savetxt(path, data.T, delimiter=",", header="a,b", comments="")
        case "tdms":
            nptdms = pytest.importorskip("nptdms", reason="pip install vibench[exchange] brings npTDMS")
            with nptdms.TdmsWriter(path) as writer:
                writer.write_segment([nptdms.ChannelObject("g", "c", data[0], {"wf_increment": 1e-3})])
    raw, dice = path.read_bytes(), random.Random(7)
    refused = 0
    for _ in range(80):
        path.write_bytes(corrupt(raw, dice))
        try:
            with open_source(path) as source:
                for channel in source.channels:
                    assert source.read(channel, 0, channel.samples).shape == (channel.samples,)
        except AnalysisError:
            refused += 1
    assert 0 < refused < 80


@pytest.mark.parametrize(("said", "found"), [("", "simulated"), ('origin = "simulated"\n', "simulated")])
def test_a_universal_file_keeps_the_mark_that_its_samples_are_simulated(known, tmp_path, said, found):
    path, _ = export_samples(excerpt(known, ("m0_velocity",), to_s=1.0), Format.UFF, tmp_path / "a.uff")
    head = said + DWELL.replace("sample_rate_hz = 8000.0\n", "").replace("settle_s = 1,", "settle_s = 0,")
    recording, _ = read_import(path, mapping(tmp_path, ("1", "m0_velocity", ""), head=head))
    assert recording.origin.value == found


def test_a_mapping_cannot_declare_simulated_samples_to_be_real(known, tmp_path):
    path, _ = export_samples(excerpt(known, ("m0_velocity",), to_s=1.0), Format.UFF, tmp_path / "a.uff")
    head = 'origin = "real"\n' + DWELL.replace("sample_rate_hz = 8000.0\n", "").replace("= 1,", "= 0,")
    with pytest.raises(InvalidRequest, match=r"has origin = 'real', but a\.uff states simulated"):
        import_recording(path, mapping(tmp_path, ("1", "m0_velocity", ""), head=head), tmp_path / "b.h5")


def test_a_text_file_with_fewer_numbers_than_declared_is_refused(known, tmp_path):
    path, _ = export_samples(excerpt(known, ("m0_velocity",), to_s=0.01), Format.UFF, tmp_path / "a.uff")
    lines = path.read_bytes().split(b"\n")
    place = next(n for n, line in enumerate(lines) if line.startswith(b"    58b"))
    lines[place] = b"    58"
    lines[place + 7] = lines[place + 7][:10] + b"   2508876" + lines[place + 7][20:]
    numbers = b"\n".join(b"%20.11E" % each for each in range(42))
    path.write_bytes(b"\n".join(lines[: place + 12]) + b"\n" + numbers + b"\n    -1\n")
    refused = pytest.raises(UnusableData, match=r"states 2508876 numbers, but contains at most \d+")
    with refused, open_source(path):
        pass
