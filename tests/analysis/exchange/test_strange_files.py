"""Files of other programs with unusual times, units and scales are read correctly or refused."""

from datetime import UTC, datetime, timedelta, timezone

import h5py
import numpy as np
import pytest
from scipy.io import savemat, wavfile

from vibench.acquisition import open_recording, validate
from vibench.analysis.errors import InvalidRequest, UnusableData
from vibench.analysis.exchange import ImportMapping, import_recording

RATE_HZ = 5120.0
G = 9.80665
LATE = 13
"""Sample intervals by which a channel starts later."""
TIMES = np.arange(4000) / RATE_HZ


def signal(times):
    """Return drive voltage, acceleration and velocity in SI units."""
    phase = 2 * np.pi * 37.0 * times
    return np.stack((np.cos(phase), 30.0 * np.sin(phase), 0.5 * np.cos(phase + 1.0)))


def read_import(path, names=("u", "a", "v"), **more):
    """Return the samples of an imported file, NaN if lost; ``more`` are mapping keys of each channel."""
    plan = {"kind": "dwell", "amplitude_vpp": 1.0, "frequency_hz": 37, "settle_s": 0, "duration_s": 0.5}
    roles = ("drive_voltage", "base_acceleration", "m0_velocity")
    content = {
        "started_utc": "2026-03-01T12:00:00Z",
        "sample_rate_hz": RATE_HZ,
        "measurement": {"name": "m", "excitation": plan},
        "channels": [{"source": name, "role": role, **more} for name, role in zip(names, roles, strict=True)],
    }
    made = import_recording(path, validate(content, ImportMapping, "test"), path.with_name("made.h5"))
    with open_recording(made) as recording:
        return np.stack([recording.read(role) for role in roles])


def is_right(samples, lost=0):
    """Assert that the samples match the signal at their times."""
    missing = np.isnan(samples[0])
    expected = np.where(missing, np.nan, signal(np.arange(samples.shape[1]) / RATE_HZ))
    np.testing.assert_allclose(samples, expected, atol=2e-4, equal_nan=True)
    assert missing.sum() == lost


def text(path, head, columns, between=","):
    """Write a text table with a heading; columns are texts or numbers."""
    cells = [[each if isinstance(each, str) else f"{each:.10g}" for each in column] for column in columns]
    path.write_text(head + "\n" + "".join(between.join(row) + "\n" for row in zip(*cells, strict=True)))
    return path


FORMS = (
    "%d.%m.%Y %H:%M:%S.%f",
    "%m/%d/%Y %I:%M:%S.%f %p",
    "%d/%m/%Y %H:%M:%S.%f",
    "%Y/%m/%d %H:%M:%S,%f",
    "%d-%b-%Y %H:%M:%S.%f",
    "%y-%m-%d %H:%M:%S.%f",
    "%d.%m.%Y;%H:%M:%S.%f",
    "%H:%M:%S.%f",
    "%I:%M:%S.%f %p",
    "%M:%S.%f",
)


MIDNIGHT, NOON = "2026-02-28 23:59:59.6Z", "2026-03-04 11:59:59Z"


@pytest.mark.parametrize(
    ("form", "start"),
    [*((form, MIDNIGHT) for form in FORMS), *((form, NOON) for form in FORMS if "%I" in form)],
)
def test_dates_and_times_in_any_format_determine_sample_positions(tmp_path, form, start):
    kept = np.delete(np.arange(TIMES.size), slice(1500, 1537))
    clock = [(datetime.fromisoformat(start) + timedelta(seconds=TIMES[k])).strftime(form) for k in kept]
    head = "Date;Time;u;a;v" if ";" in form else "Time;u;a;v"
    is_right(read_import(text(tmp_path / "a.csv", head, (clock, *signal(TIMES[kept])), ";")), lost=37)


@pytest.mark.parametrize(("winter_h", "summer_h"), [(1, 2), (-3.5, -2.5)])
@pytest.mark.parametrize("change", ["spring", "autumn"])
def test_local_times_with_a_zone_continue_when_summer_time_changes(tmp_path, winter_h, summer_h, change):
    hours = (winter_h, summer_h) if change == "spring" else (summer_h, winter_h)
    before, after = (timedelta(hours=each) for each in hours)
    turn = datetime(2026, 3, 29, 1, tzinfo=UTC)
    moments = [turn + timedelta(seconds=each - 1.0) for each in TIMES]
    clock = [each.astimezone(timezone(before if each < turn else after)).isoformat() for each in moments]
    is_right(read_import(text(tmp_path / "a.csv", "Time;u;a;v", (clock, *signal(TIMES)), ";")), lost=0)


def test_a_record_continued_on_the_next_day_is_refused(tmp_path):
    clock = [f"0{1 + k // 2000}.03.2026 12:00:{TIMES[k]:09.6f}" for k in range(TIMES.size)]
    with pytest.raises(InvalidRequest, match="sample intervals, but only"):
        read_import(text(tmp_path / "a.csv", "Time;u;a;v", (clock, *signal(TIMES)), ";"))


@pytest.mark.parametrize("sign", ".,")
def test_thousands_separators_in_numbers_are_refused(tmp_path, sign):
    volts, base, velocity = signal(TIMES)
    grouped = [f"{round(1e3 * each):,d}".replace(",", sign) for each in base]
    with pytest.raises(UnusableData, match="seems to group thousands"):
        read_import(text(tmp_path / "a.csv", "t;u;a;v", (TIMES, volts, grouped, velocity), ";"))


UNITS = (
    "t,u / mV,a / g,v / mm/s",
    "t_s,u_mV,a_g,v_mm_s",
    "Time,u,a,v\ns,mV,g,mm/s\nDC,AC,AC,AC",
    "Name,u,a,v\nUnit,mV,g,mm/s",
    "Time,u,a,v\nhh:mm:ss.ms,mV,g,mm/s",
    "# units: s, mV, g, mm/s\nt,u,a,v",
    "units = s mV g mm/s\nt,u,a,v",
    "# Unit u: mV\n# Unit a: g\n# v unit = mm/s\nt,u,a,v",
)


@pytest.mark.parametrize("head", UNITS)
def test_units_in_channel_names_or_heading_rows_set_the_scales(tmp_path, head):
    volts, base, velocity = signal(TIMES)
    columns = (TIMES, 1e3 * volts, base / G, 1e3 * velocity)
    is_right(read_import(text(tmp_path / "a.csv", head, columns), "234"))


@pytest.mark.parametrize("head", ["u {mV};a {g};v {mm/s}", "u <mV>;a-g;v mm/s", "u: mV;a: g;v-mm/s"])
def test_units_after_other_separators_in_names_set_the_scales(tmp_path, head):
    volts, base, velocity = signal(TIMES)
    path = text(tmp_path / "a.csv", f"t;{head}", (TIMES, 1e3 * volts, base / G, 1e3 * velocity), ";")
    is_right(read_import(path, "234"))


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ("t,u,a [g],v\ns,V,m/s2,m/s", "is in 'g or m/s2'"),
        ("t,u,a,v\ns,V,m/s2,m/s\ns,V,g,mm/s", "is in 'm/s2 or g'"),
        ("t,u,sensor g,v", r"is in 'g\?'"),
        ("t,u,a,v at 40 mm", r"is in 'mm\?'"),
        ("t,u,a (100 mV/g),v", "is in '100 mV/g'"),
        ("Scale,1,9.80665,0.001\nt,u,a,v", "states Scale = 9.80665 for 3, but not whether"),
        ("# gain of v: 1\n# v gain: 0.001\nt,u,a,v", "states gain = 0.001 for 4, but not whether"),
    ],
)
def test_contradictory_units_and_scales_in_a_heading_are_refused(tmp_path, head, said):
    with pytest.raises(InvalidRequest, match=said):
        read_import(text(tmp_path / "a.csv", head, (TIMES, *signal(TIMES))), "234")


@pytest.mark.parametrize("line", ["XINCR 2.0E-4", "Acquisition frequency [Hz]: 5000", "recorded at 5000 Hz"])
def test_a_sampling_rate_in_a_heading_line_of_another_form_is_compared_with_the_mapping(tmp_path, line):
    with pytest.raises(InvalidRequest, match="states 5000 samples/s, but the mapping states 5120"):
        read_import(text(tmp_path / "a.csv", f"{line}\nu\ta\tv", signal(TIMES), "\t"))


@pytest.mark.parametrize(("head", "between"), [("t u a v\n  mV g mm/s", " "), ("t,u,a,v\nmV,g,mm/s", ",")])
def test_a_row_of_units_with_an_empty_cell_is_refused(tmp_path, head, between):
    with pytest.raises(UnusableData, match="has 3 units for 4 columns"):
        read_import(text(tmp_path / "a.csv", head, (TIMES, *signal(TIMES)), between))


def test_different_start_times_of_labview_columns_align_the_channels(tmp_path):
    volts, base, _ = signal(TIMES)
    velocity = signal(TIMES + LATE / RATE_HZ)[2]
    head = f"X0;0;0;{LATE / RATE_HZ:.9f}\nDelta_X;{1 / RATE_HZ};{1 / RATE_HZ};{1 / RATE_HZ}\nu;a;v"
    columns = (volts, base, velocity)
    is_right(read_import(text(tmp_path / "a.txt", head.replace(";", "\t"), columns, "\t")), lost=LATE)


def test_comments_and_fortran_numbers_are_read_and_a_stated_rate_is_compared_with_the_mapping(tmp_path):
    cells = [[f"{each:.9E}".replace("E", "D") for each in row] for row in (TIMES, *signal(TIMES))]
    cells[0][2000] = f"# marker\n{cells[0][2000]}"
    is_right(read_import(text(tmp_path / "a.txt", "t u a v", cells, " ")))
    with pytest.raises(InvalidRequest, match="states 4096 samples/s"):
        read_import(text(tmp_path / "b.txt", "Data recorded at 4096 Hz\nu a v", cells[1:], " "))


def test_time_stamps_of_a_tdms_file_show_lost_samples(tmp_path):
    nptdms = pytest.importorskip("nptdms", reason="pip install vibench[exchange] brings npTDMS")
    kept = np.delete(np.arange(TIMES.size), slice(1500, 1537))
    start = np.datetime64("2026-03-01T23:59:59.5", "us")
    stamps = start + (TIMES[kept] * 1e6).round().astype("timedelta64[us]")
    volts, base, velocity = signal(TIMES[kept])
    columns = {"Time": stamps, "u": 1e3 * volts, "a": base / G, "v": velocity}
    units = {"u": {"NI_UnitDescription": "mV"}, "a": {"Unit": "g"}}
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        writer.write_segment(
            [nptdms.ChannelObject("g", name, row, units.get(name, {})) for name, row in columns.items()]
        )
    is_right(read_import(tmp_path / "a.tdms"), lost=37)


def test_units_and_rates_stored_beside_matlab_matrices_are_used(tmp_path):
    volts, base, velocity = signal(TIMES)
    content = {"data": np.stack((1e3 * volts, base / G, 1e3 * velocity)).T, "Ts": 1 / RATE_HZ}
    units = np.array(["mV", "g", "mm/s"], dtype=object)
    savemat(tmp_path / "a.mat", {**content, "units": units})
    names = ("data#1", "data#2", "data#3")
    is_right(read_import(tmp_path / "a.mat", names))
    savemat(tmp_path / "b.mat", {**content, "Ts": 1 / 4096})
    with pytest.raises(InvalidRequest, match="states 4096 samples/s"):
        read_import(tmp_path / "b.mat", names)


@pytest.mark.parametrize("suffix", [".mat", ".h5"])
@pytest.mark.parametrize(
    ("facts", "said"),
    [
        ({"unit_a": "g"}, ""),
        ({"info": {"a": {"unit": "g"}}}, ""),
        ({"a_scale": 0.1}, "states scale = 0.1 for /?a, but not whether"),
        ({"gain a": 0.1}, "states gain = 0.1 for /?a, but not whether"),
        ({"v_t0": 0.0025}, "states the start of some channels, but not of"),
        ({"t": TIMES, "t_v": TIMES + 0.0025}, "has different times in"),
        ({"delays": np.array([0.0, 0.0, 0.0025])}, "several different values of delays"),
    ],
)
def test_units_scales_and_times_named_after_a_channel_apply_to_that_channel(tmp_path, suffix, facts, said):
    columns = dict(zip("uav", signal(TIMES), strict=True))
    is_unit = not said
    columns["a"] = columns["a"] / G if is_unit else columns["a"]
    path, slash = tmp_path / f"a{suffix}", "/" * (suffix == ".h5")
    if suffix == ".mat":
        savemat(path, {**columns, **{name.replace(" ", "_"): fact for name, fact in facts.items()}})
    else:
        with h5py.File(path, "w") as file:
            for name, values in {**columns, **facts}.items():
                if isinstance(values, dict):
                    file.create_group(f"{name}/a").attrs.update(values["a"])
                elif np.size(values) > 3:
                    file[name] = values
                else:
                    file.attrs[name] = values
    names = tuple(f"{slash}{each}" for each in "uav")
    if is_unit:
        is_right(read_import(path, names))
    else:
        with pytest.raises(InvalidRequest, match=said):
            read_import(path, names)


def hdf5(path, columns, **facts):
    """Write HDF5 datasets with common attributes."""
    with h5py.File(path, "w") as file:
        for name, values in columns.items():
            file.create_dataset(name, data=values).attrs.update(facts)
    return path


def test_ambiguous_scales_and_times_in_hdf5_are_refused(tmp_path):
    columns = dict(zip("uav", signal(TIMES), strict=True))
    names = ("/u", "/a", "/v")
    with pytest.raises(InvalidRequest, match=r"states gain = 0\.01 for /u"):
        read_import(hdf5(tmp_path / "a.h5", columns, gain=0.01), names)
    times = {f"x{k}": TIMES + k * LATE / RATE_HZ for k in range(2)}
    with pytest.raises(InvalidRequest, match="has different times in /x0, /x1"):
        read_import(hdf5(tmp_path / "b.h5", {**columns, **times}), names)
    for each in columns.values():
        each[700:710] = -999.0
    is_right(read_import(hdf5(tmp_path / "c.h5", columns, missing_value=-999.0), names), lost=10)


def test_unlabelled_motion_in_a_universal_file_uses_its_length_unit(tmp_path):
    pyuff = pytest.importorskip("pyuff", reason="pip install vibench[test] brings pyuff")
    path = tmp_path / "a.uff"
    length = f"{1e3:25.16E}".replace("E", "D")
    path.write_text(f"    -1\n   164\n         5mm                           2\n{length}\n 0\n    -1\n")
    kinds = {"func_type": 1, "rsp_node": 1, "rsp_dir": 3, "ref_node": 0, "ref_dir": 0, "abscissa_spacing": 1}
    axes = {"abscissa_spec_data_type": 17, "abscissa_axis_units_lab": "s", "orddenom_spec_data_type": 0}
    for name, row, kind, scale in zip("uav", signal(TIMES), (0, 12, 11), (1, 1e3, 1e3), strict=True):
        about = {"ordinate_spec_data_type": kind, "ordinate_axis_units_lab": "NONE", "ord_data_type": 4}
        made = pyuff.prepare_58(binary=0, data=scale * row, x=TIMES, id1=name, **kinds, **axes, **about)
        pyuff.UFF(str(path)).write_sets([made], "add")
    is_right(read_import(path))
    path.write_bytes(path.read_bytes().replace(b"         5mm", b"         1SI"))
    with pytest.raises(InvalidRequest, match="is in 'm or mm/s2' in the file"):
        read_import(path)


def to_tdms(path, channels):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(path) as writer:
        objects = [
            nptdms.ChannelObject("G", name, values, facts) for name, (values, facts) in channels.items()
        ]
        writer.write_segment(objects)
    return tuple(f"G/{name}" for name in channels)


def to_hdf5(path, channels):
    with h5py.File(path, "w") as file:
        for name, (values, facts) in channels.items():
            file.create_dataset(name, data=values).attrs.update(facts)
    return tuple(f"/{name}" for name in channels)


def to_mat(path, channels):
    savemat(path, {name: {"y": values, **facts} for name, (values, facts) in channels.items()})
    return tuple(f"{name}.y" for name in channels)


def to_mat73(path, channels):
    """Write structs as MATLAB 7.3 does in HDF5: texts are arrays of character codes."""
    with h5py.File(path, "w") as file:
        for name, (values, facts) in channels.items():
            group = file.create_group(name)
            group["y"] = np.atleast_2d(values)
            for fact, value in facts.items():
                codes = [[ord(letter)] for letter in value] if isinstance(value, str) else [[value]]
                group.create_dataset(fact, data=np.array(codes, "u2" if isinstance(value, str) else "f8"))
                group[fact].attrs["MATLAB_class"] = np.bytes_("char" if isinstance(value, str) else "double")
    return tuple(f"/{name}/y" for name in channels)


WRITERS = {".tdms": to_tdms, ".h5": to_hdf5, ".mat": to_mat, "73.mat": to_mat73}


def with_facts(tmp_path, suffix, values, facts):
    """Write three channels with their attributes; return a function that imports the file."""
    path = tmp_path / f"facts{suffix}"
    channels = dict(zip("uav", zip(values, facts, strict=True), strict=True))
    names = WRITERS[suffix](path, channels)
    return lambda **more: read_import(path, names, **more)


@pytest.mark.parametrize(
    ("suffix", "word"),
    [
        (".tdms", "unit"),
        (".tdms", "EU"),
        (".h5", "engineering_unit"),
        (".h5", "unit"),
        (".mat", "PhysicalUnit"),
        (".mat", "Einheit"),
        ("73.mat", "y_units"),
        ("73.mat", "unit"),
    ],
)
def test_a_unit_attribute_with_any_common_name_is_applied(tmp_path, suffix, word):
    volts, acceleration, velocity = signal(TIMES)
    units = [{word: unit} for unit in ("V", "g", "mm/s")]
    is_right(with_facts(tmp_path, suffix, (volts, acceleration / G, 1000 * velocity), units)())


def test_the_unit_of_one_variable_is_not_applied_to_another_variable(tmp_path):
    values = dict(zip("uav", signal(TIMES), strict=True)) | {"a": signal(TIMES)[1] / G, "a_unit": "g"}
    savemat(tmp_path / "a.mat", values)
    is_right(read_import(tmp_path / "a.mat"))


@pytest.mark.parametrize(
    ("suffix", "name"),
    [(".tdms", "wf_xunit_string"), (".h5", "x_unit"), (".mat", "wf_xunit_string"), ("73.mat", "x_unit")],
)
def test_a_time_increment_is_read_in_its_stated_unit(tmp_path, suffix, name):
    in_ms, in_hz = ([{"wf_increment": 1e3 / RATE_HZ, name: unit}] * 3 for unit in ("ms", "Hz"))
    is_right(with_facts(tmp_path, suffix, signal(TIMES), in_ms)())
    with pytest.raises(InvalidRequest, match=r"axis in 'Hz' instead of times.*time = \"even\""):
        with_facts(tmp_path, suffix, signal(TIMES), in_hz)()


@pytest.mark.parametrize(
    ("suffix", "facts"),
    [
        *((suffix, ({}, {}, {"t0": 0.0025})) for suffix in WRITERS),
        (".tdms", ({"delay": 0.0}, {"delay": 0.0}, {"delay": 0.0025})),
        (".h5", ({"time_shift": 0.0}, {"time_shift": 0.0}, {"time_shift": 0.0025})),
        (".mat", ({}, {}, {"trigger_time": "12:00:00.0025"})),
        ("73.mat", ({"first_sample": 0.0}, {"first_sample": 0.0}, {"first_sample": 13.0})),
        (".tdms", tuple({"start_time": f"01/03/2026 12:00:0{second}"} for second in (0, 0, 1))),
    ],
)
def test_channel_start_times_that_cannot_be_compared_are_refused(tmp_path, suffix, facts):
    imported_with = with_facts(tmp_path, suffix, signal(TIMES), facts)
    with pytest.raises(
        InvalidRequest, match=r"(give delay_s|states the start of some channels).*time = \"even\""
    ):
        imported_with()
    if "t0" not in facts[2]:
        imported_with(delay_s=0.001)


@pytest.mark.parametrize("suffix", WRITERS)
def test_integer_counts_without_a_scale_are_refused(tmp_path, suffix):
    scales = np.array([1e-4, 1e-2, 1e-4])
    counts = np.rint(signal(TIMES) / scales[:, None]).astype(np.int16)
    with pytest.raises(InvalidRequest, match=r"counts without a unit.*V per count as scale"):
        with_facts(tmp_path, suffix, counts, [{}] * 3)()
    units = [
        {"unit": unit, "conversion": scale} for unit, scale in zip(("V", "m/s2", "m/s"), scales, strict=True)
    ]
    with pytest.raises(InvalidRequest, match=r"conversion = 0.0001.*give scale"):
        with_facts(tmp_path, suffix, counts, units)()
    samples = with_facts(tmp_path, suffix, counts, [{}] * 3)(scale=1.0) * scales[:, None]
    np.testing.assert_allclose(samples, signal(TIMES), atol=0.006)


def test_units_at_the_end_of_a_universal_file_apply_to_its_functions(tmp_path):
    pyuff = pytest.importorskip("pyuff")
    file = pyuff.UFF(str(tmp_path / "a.uff"))
    axis = {"abscissa_spacing": 1, "abscissa_min": 0.0, "abscissa_inc": 1 / RATE_HZ}
    kinds = {"abscissa_spec_data_type": 17, "orddenom_spec_data_type": 0, "z_axis_spec_data_type": 0}
    nodes = {"rsp_node": 1, "rsp_dir": 1, "ref_node": 1, "ref_dir": 1}
    for kind, factor, values in zip((0, 12, 11), (1, 1000, 1000), signal(TIMES), strict=True):
        own = {"ordinate_spec_data_type": kind, "x": TIMES, "data": factor * values, "id1": "c"}
        file.write_sets({"type": 58, "func_type": 1, **axis, **kinds, **nodes, **own}, "add")
    units = {"units_code": 5, "length": 1000.0, "force": 1.0, "temp": 1.0, "temp_offset": 273.15}
    file.write_sets({"type": 164, "units_description": "mm", "temp_mode": 1, **units}, "add")
    is_right(read_import(tmp_path / "a.uff", ("1", "2", "3")))


@pytest.mark.parametrize("suffix", [".h5", ".mat"])
@pytest.mark.parametrize(
    ("fact", "numbers", "said"),
    [("t0", (0, 0, 0.0025), "several different values"), ("gain", (1.0, 0.1, 10.0), "gain = 1, 0.1, 10")],
)
def test_several_start_times_or_gains_of_one_table_are_refused(tmp_path, suffix, fact, numbers, said):
    facts = {fact: np.array(numbers, dtype=float)}
    if suffix == ".h5":
        with h5py.File(tmp_path / "a.h5", "w") as file:
            file["y"] = signal(TIMES)
            file["y"].attrs.update(facts)
    else:
        savemat(tmp_path / "a.mat", {"y": signal(TIMES), **facts})
    names = [f"{'/' * (suffix == '.h5')}y#{number}" for number in (1, 2, 3)]
    with pytest.raises(InvalidRequest, match=said):
        read_import(tmp_path / f"a{suffix}", names)


@pytest.mark.parametrize(
    ("suffix", "order"),
    [(".csv", (0, 1, 2, 3, 4, 5)), (".csv", (3, 0, 4, 1, 5, 2)), (".mat", (3, 4, 5, 0, 1, 2))],
)
def test_times_that_cannot_be_assigned_to_a_channel_are_refused(tmp_path, suffix, order):
    late = TIMES + LATE / RATE_HZ
    columns = [TIMES, TIMES, late, *signal(TIMES)[:2], signal(late)[2]]
    names = ("t_u", "t_a", "t_v", "u", "a", "v")
    if suffix == ".csv":
        text(tmp_path / "a.csv", ",".join(names[k] for k in order), [columns[k] for k in order])
    else:
        savemat(tmp_path / "a.mat", {names[k]: columns[k] for k in order})
    with pytest.raises(InvalidRequest, match="has different times in "):
        read_import(tmp_path / f"a{suffix}")


@pytest.mark.parametrize("suffix", [".tdms", ".h5", ".mat"])
@pytest.mark.parametrize("fact", ["SampleRate", "srate", "time"])
def test_rates_and_times_in_another_group_of_the_file_are_used(tmp_path, suffix, fact):
    kept = np.delete(TIMES, slice(700, 737)) if fact == "time" else TIMES
    data, other = dict(zip("uav", signal(kept), strict=True)), {fact: kept if fact == "time" else 5000.0}
    path = tmp_path / f"a{suffix}"
    if suffix == ".mat":
        savemat(path, {"info": other, "data": data})
    elif suffix == ".h5":
        with h5py.File(path, "w") as file:
            file["data/u"], file["data/a"], file["data/v"] = data.values()
            file[f"info/{fact}"] = other[fact]
    else:
        nptdms = pytest.importorskip("nptdms")
        with nptdms.TdmsWriter(path) as writer:
            group = nptdms.GroupObject("info", {} if fact == "time" else other)
            times = [nptdms.ChannelObject("info", fact, kept)] if fact == "time" else []
            writer.write_segment(
                [group, *times, *(nptdms.ChannelObject("d", *each) for each in data.items())]
            )
    names = tuple({".mat": "data.", ".h5": "/data/", ".tdms": ""}[suffix] + each for each in "uav")
    if fact == "time":
        is_right(read_import(path, names), lost=37)
    else:
        with pytest.raises(InvalidRequest, match="states 5000 samples/s, but the mapping states 5120"):
            read_import(path, names)


@pytest.mark.parametrize("fact", ["unit_string", "gain", "NI_Scale[0]_Linear_Slope"])
def test_a_unit_or_scale_that_changes_within_a_tdms_file_is_refused(tmp_path, fact):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        for value in ("m/s", "mm/s") if fact == "unit_string" else (0.5, 1.0):
            rows = [("u", {}), ("a", {}), ("v", {fact: value})]
            objects = [nptdms.ChannelObject("g", name, signal(TIMES)[0], facts) for name, facts in rows]
            writer.write_segment(objects)
    with pytest.raises((InvalidRequest, UnusableData), match=r"mm/s|gain = 0.5|NI_Scale"):
        read_import(tmp_path / "a.tdms")


@pytest.mark.parametrize(("suffix", "mark"), [(".csv", -999.0), (".mat", -9999.0), (".h5", 32767.0)])
def test_numbers_that_mark_lost_samples_are_refused(tmp_path, suffix, mark):
    columns = dict(zip("uav", signal(TIMES), strict=True))
    columns["v"][700:710] = mark
    path, names = tmp_path / f"a{suffix}", "uav"
    if suffix == ".csv":
        text(path, "u,a,v", columns.values())
    elif suffix == ".mat":
        savemat(path, columns)
    else:
        hdf5(path, columns)
        names = ("/u", "/a", "/v")
    with pytest.raises(
        UnusableData, match=rf"has 10 samples of exactly {abs(mark):g} or .* mark lost samples"
    ):
        read_import(path, names)


@pytest.mark.parametrize("peak", [0.9, 1.5])
def test_floating_point_wav_samples_within_full_scale_need_a_scale(tmp_path, peak):
    """Floats in sound files are usually fractions of full scale; larger values cannot be."""
    values = peak * signal(TIMES) / np.array([[1.0], [30.0], [0.5]])
    wavfile.write(tmp_path / "a.wav", int(RATE_HZ), values.T.astype(np.float32))
    if peak < 1:
        with pytest.raises(InvalidRequest, match="has fractions of full scale without a unit for 1"):
            read_import(tmp_path / "a.wav", "123")
    samples = read_import(tmp_path / "a.wav", "123", scale=1.0)
    np.testing.assert_allclose(samples, values, atol=1e-6)


def test_single_precision_in_the_wrong_byte_order_is_refused(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, values in zip("uav", signal(TIMES), strict=True):
            file[name] = values.astype("<f4").view(">f4")
    with pytest.raises(UnusableData, match="a recording stores only peaks"):
        read_import(tmp_path / "a.h5", ("/u", "/a", "/v"))
