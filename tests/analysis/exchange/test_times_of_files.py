"""Times in imported files: each generated file is aligned, has its lost samples counted, or is refused."""

from functools import partial

import h5py
import numpy as np
import pytest
from scipy.io import savemat, wavfile

from vibench.acquisition import open_recording, validate
from vibench.analysis import InvalidRequest, analyse
from vibench.analysis.errors import UnusableData
from vibench.analysis.exchange import ImportMapping, import_recording
from vibench.analysis.recordings.channels import alignment_error_s
from vibench.analysis.recordings.checks import Verdict
from vibench.analysis.recordings.facts import channel_levels

nptdms = pytest.importorskip("nptdms", reason="pip install vibench[exchange] brings npTDMS")
pyuff = pytest.importorskip("pyuff", reason="pip install vibench[test] brings pyuff")
RATE_HZ = 5120.0
SAMPLES = 12_000
FAULTS = ("sound", "late", "gap", "drop", "repeat", "swap", "restart", "drift", "rate")
SAYS_TIMES = ("csv", "csv units row", "csv ms", "csv tab", "csv comma", "mat", "h5", "csv clock", "csv iso")
SAYS_STARTS = ("tdms", "uff a", "uff b")


def motion(times):
    """A signal whose value identifies the time of a sample."""
    return np.sin(2 * np.pi * 20.0 * times) + 0.3 * np.sin(2 * np.pi * 137.0 * times)


def faulty_times(fault, rng):
    """Return row times [s] with one fault."""
    times = np.arange(SAMPLES) / RATE_HZ
    at, count = int(rng.integers(500, SAMPLES - 500)), int(rng.integers(2, 60))
    match fault:
        case "late":
            return times + round(rng.uniform(2, 50)) / RATE_HZ
        case "gap":
            return np.delete(times, slice(at, at + count))
        case "drop":
            return np.delete(times, rng.integers(1, SAMPLES - 1, 20))
        case "repeat":
            return np.insert(times, at, times[at])
        case "swap":
            times[[at, at + 1]] = times[[at + 1, at]]
            return times
        case "restart":
            return np.concatenate((times[:at], times[: SAMPLES - at]))
        case "drift":
            return times * (1 + 2e-3 * times / times[-1])
    return times


def write(kind, folder, fault, rng):
    """Write two channels; only the second is faulty if the format stores times per channel."""
    times = faulty_times(fault, rng)
    values = np.stack((motion(times), 2 * motion(times)))
    path = folder / f"a.{kind.split()[0]}"
    match kind.split():
        case ["csv", *dialect]:
            heading, scale, between, point = {
                (): ("time [s],a,b", 1, ",", "."),
                ("units", "row"): ("Time;a;b\ns;V;m/s", 1, ";", ","),
                ("ms",): ("Time,a,b", 1e3, ",", "."),
                ("tab",): ("t (s)\ta\tb\t", 1, "\t", "."),
                ("comma",): ("Zeit [s] a b", 1, " ", ","),
                ("clock",): ("Clock;a;b", 1, ";", ","),
                ("iso",): ("Timestamp a b", 1, " ", "."),
            }[tuple(dialect)]
            rows = (between.join(f"{x:.9g}" for x in row) for row in np.stack((times * scale, *values)).T)
            if dialect in (["clock"], ["iso"]):
                day = "2026-02-28T" if dialect == ["iso"] else ""
                clock = (f"{day}23:59:{57 + x:09.6f}" if x < 3 else "" for x in times)
                rows = (at + between + row.split(between, 1)[1] for at, row in zip(clock, rows, strict=True))
            end = between if dialect == ["tab"] else ""
            text = "".join(f"{row}{end}\n" for row in rows)
            path.write_text(f"{heading}\n{text if point == '.' else text.replace('.', ',')}")
        case ["mat"]:
            savemat(path, {"run": {"t": times, "a": values[0], "b": values[1]}})
        case ["h5"]:
            with h5py.File(path, "w") as file:
                file["run/time"], file["run/a"], file["run/b"] = (times, *values)
        case ["tdms"]:
            start = np.datetime64("2026-03-01T12:00:00", "us")
            with nptdms.TdmsWriter(path) as writer:
                for name, row, offset_s in (
                    ("a", motion(np.arange(SAMPLES) / RATE_HZ), 0.0),
                    ("b", values[1], times[0]),
                ):
                    about = {"wf_increment": 1 / RATE_HZ, "wf_start_time": start, "wf_start_offset": offset_s}
                    writer.write_segment([nptdms.ChannelObject("g", name, row, about)])
        case ["uff", form]:
            file = pyuff.UFF(str(path))
            for name, row, first_s in (
                ("a", motion(np.arange(SAMPLES) / RATE_HZ), 0.0),
                ("b", values[1], times[0]),
            ):
                x = first_s + np.arange(row.size) / RATE_HZ
                about = {
                    "func_type": 1,
                    "rsp_node": 1,
                    "rsp_dir": 3,
                    "ref_node": 0,
                    "ref_dir": 0,
                    "ord_data_type": 4,
                    "ordinate_spec_data_type": 11,
                    "orddenom_spec_data_type": 0,
                }
                axis = {"abscissa_spacing": 1, "abscissa_spec_data_type": 17, "abscissa_axis_units_lab": "s"}
                binary = int(form == "b")
                file.write_sets(
                    [pyuff.prepare_58(binary=binary, data=row, x=x, id1=name, **about, **axis)], "add"
                )
        case ["wav"]:
            wavfile.write(path, int(RATE_HZ), values.T.astype(np.float32))
    return path


def mapping(kind, rate_hz):
    names = {"csv": ("a", "b"), "mat": ("run.a", "run.b"), "h5": ("/run/a", "/run/b"), "wav": ("1", "2")}
    first, second = names.get(kind.split()[0], ("a", "b"))
    plan = {"kind": "dwell", "amplitude_vpp": 1.0, "frequency_hz": 20, "settle_s": 0, "duration_s": 2}
    content = {
        "started_utc": "2026-03-01T12:00:00Z",
        "sample_rate_hz": rate_hz,
        "measurement": {"name": "m", "excitation": plan},
        "channels": [{"source": first, "role": "drive_voltage"}, {"source": second, "role": "m0_velocity"}],
    }
    return validate(content, ImportMapping, "test")


def expected_outcome(kind, fault):
    """Return the expected outcome of an import: "whole", "lost" samples or "refused"."""
    if fault == "rate":
        return "refused"
    if kind in SAYS_TIMES:
        return {"restart": "refused", "drift": "refused", "sound": "whole", "late": "whole"}.get(
            fault, "lost"
        )
    return "lost" if fault == "late" and kind in SAYS_STARTS else "whole"


@pytest.mark.thorough
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # pyuff leaves a file open
@pytest.mark.parametrize("kind", [*SAYS_TIMES, *SAYS_STARTS, "wav"])
@pytest.mark.parametrize("seed", [43])
def test_times_of_a_file_are_stored_in_the_recording(tmp_path, kind, seed):
    rng = np.random.default_rng(seed)
    third = SAYS_TIMES.index(kind) % 3 if kind in SAYS_TIMES else 0
    faults = (
        FAULTS[third::3]
        if kind in SAYS_TIMES
        else ("sound", "late", "rate")
        if kind in SAYS_STARTS
        else ("sound", "rate")
    )
    for number, fault in enumerate(faults):
        folder = tmp_path / f"{number}"
        folder.mkdir()
        path = write(kind, folder, fault, rng)
        wanted = expected_outcome(kind, fault)
        meaning = mapping(kind, RATE_HZ * 1.05 if fault == "rate" else RATE_HZ)
        if wanted == "refused":
            with pytest.raises(InvalidRequest):
                import_recording(path, meaning, folder / "made.h5")
            continue
        with open_recording(import_recording(path, meaning, folder / "made.h5")) as recording:
            drive, response = (recording.read(role) for role in recording.roles)
            lost = int(np.isnan(response).sum())
        assert (lost > 0) == (wanted == "lost"), (kind, fault, lost)
        np.testing.assert_allclose(response, 2 * drive, atol=2e-5, equal_nan=True)
        if kind in SAYS_TIMES and fault == "late":
            continue  # a shared time axis begins with its first sample
        # Samples are evenly spaced, so the index gives the time.
        expected = motion(np.arange(drive.size) / RATE_HZ)
        np.testing.assert_allclose(drive, np.where(np.isnan(drive), np.nan, expected), atol=2e-5)


HEADINGS = ("Elapsed time [s]", "X_Value", "t/s", "Zeit in s", "Seconds", "Tiempo [s]", "", "x", "#")
UNITS_OF_TIME = {
    "Time [min]": 1 / 60,
    "time (msec)": 1e3,
    "time [ns]": 1e9,
    "Time [h]": 1 / 3600,
    "Time [d]": 1 / 86400,
}
COUNTS = ("Index", "Scan", "Sample")
COLUMN_FAULTS = ("sound", "gap", "drop", "repeat", "swap", "restart", "drift", "rate")


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [43])
@pytest.mark.parametrize("fault", COLUMN_FAULTS)
def test_any_evenly_increasing_column_can_be_the_time_axis(tmp_path, fault, seed):
    rng = np.random.default_rng(seed)
    scales = {**dict.fromkeys(HEADINGS, 1.0), **UNITS_OF_TIME, **dict.fromkeys(COUNTS, RATE_HZ), None: 1.0}
    # Each fault is tested under a third of the headings, each heading with a third of the faults.
    for number, (heading, scale) in list(enumerate(scales.items()))[COLUMN_FAULTS.index(fault) % 3 :: 3]:
        if heading in COUNTS and fault in {"drift", "rate"}:
            continue  # a sample count shows neither drift nor a wrong rate
        times = faulty_times(fault, rng)
        path = tmp_path / f"{number}.csv"
        rows = np.stack((scale * times, motion(times), 2 * motion(times))).T
        first = {} if heading is None else {"header": f"{heading},a,b", "comments": ""}
        np.savetxt(path, rows, "%.12g", ",", **first)
        content = mapping("csv", RATE_HZ * 1.05 if fault == "rate" else RATE_HZ).model_dump()
        if heading is None:
            content["channels"][0]["source"], content["channels"][1]["source"] = "2", "3"
        meaning = validate(content, ImportMapping, "test")
        if fault in {"restart", "drift", "rate"}:
            with pytest.raises(InvalidRequest):
                import_recording(path, meaning, path.with_suffix(".h5"))
            continue
        with open_recording(import_recording(path, meaning, path.with_suffix(".h5"))) as recording:
            drive = recording.read("drive_voltage")
        assert np.isnan(drive).any() == (fault != "sound"), heading
        expected = motion(np.arange(drive.size) / RATE_HZ)
        np.testing.assert_allclose(drive, np.where(np.isnan(drive), np.nan, expected), atol=2e-5)


def late_hdf5(path, first, second, fact):
    with h5py.File(path, "w") as file:
        for name, values, start_s in (("a", first, 0.0), ("b", second, 0.0025)):
            dataset = file.create_dataset(f"run/{name}", data=values)
            dataset.attrs["wf_increment"] = 1 / RATE_HZ
            moment = f"2026-03-01T12:00:00.{round(start_s * 1e6):06d}Z"
            dataset.attrs[fact] = moment if fact == "wf_start_time" else start_s


def late_mat(path, first, second, fact):
    struct, name = fact.split(".")
    channels = {}
    for channel, values, start_s in (("a", first, 0.0), ("b", second, 0.0025)):
        about = {name: start_s, "increment": 1 / RATE_HZ}
        channels[channel] = {"y": values, struct: about} if struct else {"y": values, **about}
    savemat(path, {"run": channels})


@pytest.mark.parametrize(
    ("suffix", "fact"),
    [
        *((".h5", fact) for fact in ("t0", "start_time", "wf_start_offset", "x0", "wf_start_time")),
        *((".mat", fact) for fact in ("x_values.start_value", ".Tstart", ".start")),
    ],
)
def test_start_times_and_rates_stored_beside_channels_are_read(tmp_path, suffix, fact):
    times = np.arange(SAMPLES) / RATE_HZ
    path = tmp_path / f"a{suffix}"
    write_late = late_hdf5 if suffix == ".h5" else late_mat
    late_s = 13 / RATE_HZ  # 2.5 ms are 12.8 samples, rounded to 13
    write_late(path, motion(times), 2 * motion(times + 0.0025), fact)
    content = mapping("h5", RATE_HZ).model_dump()
    names = ("/run/a", "/run/b") if suffix == ".h5" else ("run.a.y", "run.b.y")
    content["channels"][0]["source"], content["channels"][1]["source"] = names
    made = import_recording(path, validate(content, ImportMapping, "test"), tmp_path / "made.h5")
    with open_recording(made) as recording:
        drive, response = (recording.read(role) for role in recording.roles)
        (delay_s,) = (each.delay_s for each in recording.channels if each.role == "m0_velocity")
    sampled = np.flatnonzero(~np.isnan(response))
    assert sampled[0] == round(late_s * RATE_HZ)
    np.testing.assert_allclose(drive[sampled], motion(sampled / RATE_HZ), atol=2e-5)
    np.testing.assert_allclose(response[sampled], 2 * motion(sampled / RATE_HZ - delay_s), atol=1e-4)
    content["sample_rate_hz"] = RATE_HZ * 1.05
    with pytest.raises(InvalidRequest, match="samples/s"):
        import_recording(path, validate(content, ImportMapping, "test"), tmp_path / "wrong.h5")


@pytest.mark.parametrize(
    ("digits", "late_s"), [(each, 2.5 / RATE_HZ) for each in (4, 5, 6, 12)] + [(6, 0.0025)]
)
@pytest.mark.parametrize("kind", ["times", "start"])
def test_a_start_time_with_few_digits_is_refused_or_stored_with_its_error(tmp_path, kind, digits, late_s):
    """The true delay of the second channel is within the stored error of the delay from the file."""
    times = np.arange(SAMPLES) / RATE_HZ
    first, second = motion(times), motion(times + late_s)
    path, names = tmp_path / "a.mat", ("run.a.y", "run.b.y")
    start = f"{late_s:.{digits}f}"
    about = [{"t": times}, {"t": np.round(times + late_s, digits)}]
    if kind == "start":
        about = [{"increment": 1 / RATE_HZ, "start": each} for each in ("0", start)]
    savemat(
        path, {"run": {n: {"y": y, **more} for n, y, more in zip("ab", (first, second), about, strict=True)}}
    )
    content = mapping("h5", RATE_HZ).model_dump()
    content["channels"][0]["source"], content["channels"][1]["source"] = names
    read = partial(import_recording, path, validate(content, ImportMapping, "test"), tmp_path / "made.h5")
    if (kind, digits) == ("start", 4):
        with pytest.raises(InvalidRequest, match="too few digits"):
            read()
        return
    made = read()
    with open_recording(made) as recording:
        response = recording.read("m0_velocity")
        whole = np.flatnonzero(~np.isnan(response))[0]
        (delay_s,) = (each.delay_s for each in recording.channels if each.role == "m0_velocity")
        error_s = alignment_error_s(recording, "drive_voltage", "m0_velocity")
    off_s = abs(whole / RATE_HZ - delay_s - late_s)
    assert off_s <= error_s + 1e-3 / RATE_HZ
    assert error_s < 0.2 / RATE_HZ


def test_file_times_that_a_mapping_overrides_are_noted_in_the_recording(tmp_path):
    path = write("csv", tmp_path, "drift", np.random.default_rng(0))
    content = {**mapping("csv", RATE_HZ).model_dump(), "time": "even"}
    with open_recording(
        import_recording(path, validate(content, ImportMapping, "t"), tmp_path / "a.h5")
    ) as made:
        (remark,) = made.bench["imported"]["time"]
    assert remark.startswith("the mapping's 5120 samples/s replace the times of the file")


DWELL = {"kind": "dwell", "amplitude_vpp": 2.0, "frequency_hz": 260, "settle_s": 1, "duration_s": 3}
HITS = {
    "kind": "streamed_noise",
    "amplitude_vpp": 2,
    "band_start_hz": 9,
    "band_stop_hz": 600,
    "duration_s": 4,
}


def dwell_at(file, volts, base, velocity, rate_hz=5120.0, more="", plan=DWELL):
    """Write and map a dwell at 260 Hz, or another plan."""
    times = np.arange(volts.size) / rate_hz
    np.savetxt(
        file, np.stack((times, volts, base, velocity)).T, "%.9g", ",", header="time [s],u,a,v", comments=""
    )
    roles = {"u": "drive_voltage", "a": "base_acceleration", "v": "m0_velocity"}
    content = {
        "started_utc": "2026-03-01T12:00:00Z",
        "measurement": {"name": "m", "excitation": plan},
        "channels": [{"source": key, "role": role} for key, role in roles.items()],
    }
    if more:
        content["channels"][2]["full_scale"] = float(more)
    return validate(content, ImportMapping, "test")


@pytest.mark.parametrize(
    ("low", "high", "noise", "full_scale"),
    [
        (-0.8, 0.8, 0.0, ""),
        (-9, 0.8, 0.0, "10"),
        (-0.8, 0.8, 1e-3, "10"),
        (-0.8, 0.8, 1e-3, ""),
        (-9, 9, 0.0, ""),
        (-9, 9, 0.0, "10"),
    ],
)
def test_clipped_flat_tops_and_an_unknown_full_scale_are_reported(tmp_path, full_scale, low, high, noise):
    rng = np.random.default_rng(1)
    phase = 2 * np.pi * 260.0 * np.arange(22_000) / 5120.0
    volts, base = np.cos(phase), 3.0 * np.cos(phase + 0.4) + 1e-4 * rng.standard_normal(phase.size)
    velocity = np.clip(np.cos(phase + 1.0), low, high) + (noise + 1e-5) * rng.standard_normal(phase.size)
    meaning = dwell_at(tmp_path / "a.csv", volts, base, velocity, more=full_scale)
    checks = analyse(import_recording(tmp_path / "a.csv", meaning, tmp_path / "a.h5")).checks
    (check,) = (each for each in checks if each.what == "Overloads")
    if high < 1:
        assert check.verdict is Verdict.WARNING
        assert "flat tops: m0_velocity at 0.8" in check.text
        assert "Responses I and II are wrong" in check.text
        assert (" and -0.8" in check.text) == (low > -1)
    else:
        assert check.verdict is Verdict.NOTE
        assert ("m0_velocity is not known" in check.text) == (not full_scale)


@pytest.mark.parametrize(
    ("cycles", "noise"),
    [(4, 0.0), (4, 1e-4), (8, 1e-4), (10, 1e-3), (16, 0.0), (20, 1e-4), (25, 1e-3), (40, 0.0)],
)
def test_peaks_of_a_sine_locked_to_the_sample_clock_do_not_count_as_flat_tops(tmp_path, cycles, noise):
    """Such a sine repeats few values in each period, many of them at the maximum."""
    phase = 2 * np.pi * np.arange(20_000) / cycles
    rng = np.random.default_rng(cycles)
    wave = [np.cos(phase + at) + noise * rng.standard_normal(phase.size) for at in (0.3, np.pi / cycles, 0.8)]
    meaning = dwell_at(tmp_path / "a.csv", *wave)
    with open_recording(import_recording(tmp_path / "a.csv", meaning, tmp_path / "a.h5")) as recording:
        assert [each.flat_tops for each in channel_levels(recording)] == [(), (), ()]


@pytest.mark.parametrize(
    ("motion_of", "noise"),
    [
        ("one side", 0.0),
        ("one side", 1e-3),
        ("two sides", 1e-5),
        ("clipped hits", 0.0),
        ("clipped hits", 1e-3),
    ],
)
def test_only_the_clipped_peaks_of_hits_count_as_flat_tops(tmp_path, motion_of, noise):
    """A free body moves at a constant velocity between hits, and vibrates after each hit."""
    rng = np.random.default_rng(3)
    since = np.arange(22_000)[:, np.newaxis] - np.array([1700, 5300, 8000, 12_500, 17_100])
    signs = (-1.0) ** np.arange(5) if motion_of == "two sides" else np.ones(5)
    force = np.sum(signs * np.where(abs(since) < 40, np.cos(since * np.pi / 80), 0), axis=1)
    if motion_of == "clipped hits":
        force = np.minimum(force, 0.6)
    ringing = np.exp(-since / 200.0) * np.cos(0.3 * since)
    velocity = np.sum(signs * np.where(since > 0, 1.0 - ringing, 0.0), axis=1)
    wave = [each + noise * rng.standard_normal(each.size) for each in (force, force, velocity)]
    meaning = dwell_at(tmp_path / "a.csv", *wave, plan=HITS)
    with open_recording(import_recording(tmp_path / "a.csv", meaning, tmp_path / "a.h5")) as recording:
        flat = [bool(each.flat_tops) for each in channel_levels(recording)]
    assert flat == [motion_of == "clipped hits"] * 2 + [False]


@pytest.mark.parametrize(
    ("heading", "order"),
    [
        ("time [s]", "falling"),
        ("Zeit", "shuffled"),
        ("t (s)", "falling"),
        ("t", "shuffled"),
        ("time [s]", "not a number"),
    ],
)
def test_times_that_do_not_increase_are_refused(tmp_path, order, heading):
    times = np.arange(SAMPLES) / RATE_HZ
    shown = {
        "falling": times[::-1],
        "shuffled": np.random.default_rng(3).permutation(times),
        "not a number": np.full(SAMPLES, np.nan),
    }[order]
    rows = (f"{t:.7f};{x:.9g};{2 * x:.9g}\n" for t, x in zip(shown, motion(times), strict=True))
    (tmp_path / "a.csv").write_text(f"{heading};a;b\n" + "".join(rows))
    with pytest.raises(InvalidRequest, match="times that do not rise; sort the rows by time"):
        import_recording(tmp_path / "a.csv", mapping("csv", RATE_HZ), tmp_path / "made.h5")


@pytest.mark.parametrize("heading", ["t", "T", "Temps", "position"])
def test_a_column_of_another_quantity_is_not_read_as_time(tmp_path, heading):
    rng = np.random.default_rng(4)
    torque, warmth = rng.standard_normal(SAMPLES), np.round(np.linspace(20.0, 21.0, SAMPLES), 2)
    other = torque if heading == "t" else warmth + 0.01 * rng.integers(-1, 2, SAMPLES)
    if heading == "position":
        other = np.linspace(0.0, 6.0, SAMPLES) + 2e-4 * rng.standard_normal(SAMPLES)
    signal = motion(np.arange(SAMPLES) / RATE_HZ)
    rows = (f"{t:.7g};{x:.9g};{2 * x:.9g}\n" for t, x in zip(other, signal, strict=True))
    (tmp_path / "a.csv").write_text(f"{heading};a;b\n" + "".join(rows))
    made = import_recording(tmp_path / "a.csv", mapping("csv", RATE_HZ), tmp_path / "made.h5")
    with open_recording(made) as recording:
        assert not recording.gaps


@pytest.mark.parametrize(
    ("suffix", "jitter"),
    [(".csv", "normal"), (".csv", "rare"), (".mat", "uniform"), (".h5", "alternating"), (".tdms", "normal")],
)
def test_jittered_times_are_refused_unless_the_mapping_ignores_them(tmp_path, suffix, jitter):
    rng = np.random.default_rng(17)
    intervals = {
        "normal": 0.1 * rng.standard_normal(SAMPLES),
        "uniform": rng.uniform(-0.25, 0.25, SAMPLES),
        "alternating": 0.1 * (-1.0) ** np.arange(SAMPLES),
        "rare": 0.4 * (rng.random(SAMPLES) < 0.1),
    }[jitter]
    times = np.round((np.arange(SAMPLES) + intervals) / RATE_HZ, 7)
    path = tmp_path / f"a{suffix}"
    columns = {"time": times, "a": motion(times), "b": 2 * motion(times)}
    if suffix == ".csv":
        np.savetxt(path, np.stack(list(columns.values())).T, "%.9g", ",", header="time,a,b", comments="")
    elif suffix == ".mat":
        savemat(path, {"run": columns})
    elif suffix == ".h5":
        with h5py.File(path, "w") as file:
            for name, values in columns.items():
                file[f"run/{name}"] = values
    else:
        with nptdms.TdmsWriter(path) as writer:
            writer.write_segment([nptdms.ChannelObject("g", *each) for each in columns.items()])
    with pytest.raises(InvalidRequest, match=r"jitter by|from an evenly spaced axis"):
        import_recording(path, mapping(suffix[1:], RATE_HZ), tmp_path / "made.h5")
    even = mapping(suffix[1:], RATE_HZ).model_copy(update={"time": "even"})
    with open_recording(import_recording(path, even, tmp_path / "made.h5")) as recording:
        assert recording.bench["imported"]["time_contradicted"]


@pytest.mark.parametrize(
    ("rate_hz", "digits", "rows", "first"),
    [
        (1024, 3, 6000, 0.0),
        (980, 3, 6000, 1.7e9),
        (4900, 4, 6000, 7.3),
        (5120, 4, 6000, 1.7e9),
        (9600, 4, 6000, 0.0),
        (9980, 4, 6000, 7.3),
        (51_200, 5, 6000, 1.7e9),
        (96_000, 5, 6000, 0.0),
        (980, 3, 200, 7.3),
        (5120, 4, 200, 0.0),
        (5120, 5, 200, 1.7e9),
    ],
)
def test_rounded_times_are_not_counted_as_lost_samples(tmp_path, rate_hz, digits, rows, first):
    """One interval in 20 or fewer differs from the others, by one unit of the last digit."""
    times = np.arange(rows) / rate_hz
    rows = (
        f"{first + t:.{digits}f};{x:.9g};{2 * x:.9g}\n" for t, x in zip(times, motion(times), strict=True)
    )
    (tmp_path / "a.csv").write_text("time [s];a;b\n" + "".join(rows))
    with pytest.raises(InvalidRequest, match="does not state its sample rate exactly"):
        import_recording(tmp_path / "a.csv", mapping("csv", None), tmp_path / "made.h5")
    with open_recording(
        import_recording(tmp_path / "a.csv", mapping("csv", rate_hz), tmp_path / "made.h5")
    ) as made:
        assert made.sample_rate_hz == rate_hz
        assert not made.gaps


def write_restarted_tdms(path, more, at):
    """Write two channels in two segments; the last segment has changed properties."""
    values = motion(np.arange(SAMPLES) / RATE_HZ)
    start = np.datetime64("2026-03-01T12:00:00", "us")
    about = {"wf_increment": 1 / RATE_HZ, "wf_start_time": start, "wf_start_offset": 0.0}
    with nptdms.TdmsWriter(path) as writer:
        for number, part in enumerate((slice(0, at), slice(at, SAMPLES))):
            said = about | (more(start) if number else {})
            writer.write_segment([nptdms.ChannelObject("g", name, values[part], said) for name in ("a", "b")])
    return values


@pytest.mark.parametrize(("fact", "at"), [("wf_start_time", 500), ("wf_start_offset", 7001)])
@pytest.mark.parametrize("paused", [0, 640, 5120])
def test_samples_between_segments_of_a_tdms_file_count_as_lost(tmp_path, fact, at, paused):
    path = tmp_path / "a.tdms"
    later_s = (at + paused) / RATE_HZ

    def more(start):
        return {fact: start + np.timedelta64(round(later_s * 1e6), "us") if "time" in fact else later_s}

    values = write_restarted_tdms(path, more, at)
    with open_recording(import_recording(path, mapping("tdms", RATE_HZ), tmp_path / "made.h5")) as recording:
        drive = recording.read("drive_voltage")
    assert np.isnan(drive).sum() == paused
    np.testing.assert_allclose(drive[at + paused :], values[at:], atol=2e-5)


@pytest.mark.parametrize(
    "more",
    [
        lambda _: {"wf_increment": 1.01 / RATE_HZ},
        lambda start: {"wf_start_time": start + np.timedelta64(1_234_567, "us")},
        lambda start: {"wf_start_time": start - np.timedelta64(10, "s")},
        lambda start: {"wf_start_time": start + np.timedelta64(1, "D")},
    ],
    ids=["another rate", "between samples", "backward", "another day"],
)
def test_tdms_segments_without_a_consistent_time_axis_are_refused(tmp_path, more):
    write_restarted_tdms(tmp_path / "a.tdms", more, 7001)
    with pytest.raises(InvalidRequest, match=r"samples/s|has a second start|go back|intervals, but only"):
        import_recording(tmp_path / "a.tdms", mapping("tdms", RATE_HZ), tmp_path / "made.h5")


@pytest.mark.parametrize(
    ("segments", "is_clear"),
    [
        (("ab", "ab", "ab"), True),
        (("a", "b", "a", "b"), True),
        (("a", "a", "b", "b"), True),
        (("ab", "a", "ab", "b"), False),
        (("ab", "b", "a", "ab"), False),
        (("a", "b", "a", "a", "b", "b"), False),
        (("abb", "aab"), False),
    ],
    ids=str,
)
def test_tdms_channels_in_different_segments_are_refused_if_times_may_shift(tmp_path, segments, is_clear):
    """A repeated letter stands for more samples; all channels have the same number of samples."""
    values, done = motion(np.arange(SAMPLES) / RATE_HZ), {"a": 0, "b": 0}
    about = {"wf_increment": 1 / RATE_HZ}
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        for each in segments:
            objects = []
            for name in sorted(set(each)):
                part = slice(done[name], done[name] + 1000 * each.count(name))
                done[name] = part.stop
                objects.append(nptdms.ChannelObject("g", name, values[part], about))
            writer.write_segment(objects)
    if is_clear:
        import_recording(tmp_path / "a.tdms", mapping("tdms", RATE_HZ), tmp_path / "made.h5")
    else:
        with pytest.raises(InvalidRequest, match=r"states samples of segments = 1: .*may shift their times"):
            import_recording(tmp_path / "a.tdms", mapping("tdms", RATE_HZ), tmp_path / "made.h5")


def test_a_wav_or_mat_file_that_stores_a_channel_more_than_once_is_refused(tmp_path):
    path = write("wav", tmp_path, "sound", np.random.default_rng(0))
    content = path.read_bytes()
    path.write_bytes(content + b"data" + (64).to_bytes(4, "little") + bytes(64))
    with pytest.raises(UnusableData, match="samples in several chunks"):
        import_recording(path, mapping("wav", RATE_HZ), tmp_path / "made.h5")
    for form in ("4", "5"):
        path = tmp_path / f"{form}.mat"
        with path.open("wb") as file:
            for times in (np.arange(SAMPLES), np.arange(SAMPLES) + SAMPLES):
                savemat(file, {"t": times / RATE_HZ, "a": motion(times), "b": motion(times)}, format=form)
        meaning = mapping("h5", RATE_HZ).model_dump()
        meaning["channels"][0]["source"], meaning["channels"][1]["source"] = "a", "b"
        with pytest.raises(UnusableData, match="several variables of the same name"):
            import_recording(path, validate(meaning, ImportMapping, "test"), tmp_path / "made.h5")


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("at_s", "length_s", "share"),
    [(8.0, 0.1, 0.47), (3.0, 0.02, 0.2), (4.5, 0.1, 0.0)],
)
def test_an_imported_dwell_with_a_burst_is_not_periodic(tmp_path, at_s, length_s, share):
    rng = np.random.default_rng(4343)
    times = np.arange(64_000) / 5120.0
    phase = 2 * np.pi * 260.0 * times
    velocity = np.cos(phase + 1.0) * (1 + share * ((times > at_s) & (times < at_s + length_s)))
    velocity += 1e-5 * rng.standard_normal(times.size)
    base = 3.0 * np.cos(phase + 0.4) + 1e-4 * rng.standard_normal(times.size)
    content = dwell_at(tmp_path / "a.csv", np.cos(phase), base, velocity).model_dump()
    content["measurement"]["excitation"]["duration_s"] = 11.0
    meaning = validate(content, ImportMapping, "test")
    verdict = analyse(import_recording(tmp_path / "a.csv", meaning, tmp_path / "a.h5")).motion.verdict
    assert (verdict.kind == "periodic") == (share == 0), verdict.why
    assert ("burst" in verdict.why) == (share > 0)
