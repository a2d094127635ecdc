"""Files with missing rows: every missing row is counted as lost, or the file is refused."""

import re

import h5py
import numpy as np
import pytest

from vibench.acquisition import open_recording, validate
from vibench.analysis import InvalidRequest, analyse
from vibench.analysis.errors import UnusableData
from vibench.analysis.exchange import ImportMapping, import_recording, open_source
from vibench.analysis.recordings.checks import Verdict

SAMPLES, DWELL_SAMPLES = 6000, 20_000


def kept_rows(kind, share, rng, samples=SAMPLES):
    """Return the numbers of the rows that remain."""
    kept = np.ones(samples, dtype=bool)
    match kind:
        case "single":
            kept = rng.random(samples) >= share
        case "blocks":
            while np.mean(~kept) < share:
                start = rng.integers(1, samples - 120)
                kept[start : start + rng.integers(2, 100)] = False
        case "packets":  # the same number of rows in each packet
            kept = np.arange(samples) % 500 >= 500 * share
        case "every second" | "every third":
            step = 2 if kind == "every second" else 3
            part = min(round(step * share * samples), samples - 400)
            kept[200 : 200 + part : step] = False
    kept[[0, -1]] = True
    return np.flatnonzero(kept)


def csv_file(path, times, places, rate_hz, unit="ms", frequency_hz=150.0):
    """Write a dwell as a table with base acceleration in g and m0 velocity in mm/s."""
    phase = 2 * np.pi * frequency_hz * places / rate_hz
    columns = (np.cos(phase), 0.3 * np.cos(phase + 0.4), 20.0 * np.cos(phase + 1.0))
    rows = zip(times, *columns, strict=True)
    text = "".join(f"{t};{u:.9g};{a:.9g};{v:.9g}\n" for t, u, a, v in rows)
    path.write_text(f"time [{unit}];drive [V];base [g];m0 [mm/s]\n{text}")
    return path


def meaning(rate_hz=None, **more):
    plan = {"kind": "dwell", "amplitude_vpp": 2.0, "frequency_hz": 150, "settle_s": 0.1, "duration_s": 1.8}
    roles = {"drive": "drive_voltage", "base": "base_acceleration", "m0": "m0_velocity"}
    content = {
        "started_utc": "2026-03-01T12:00:00Z",
        "sample_rate_hz": rate_hz,
        "measurement": {"name": "dwell-150", "excitation": plan},
        "channels": [{"source": key, "role": role} for key, role in roles.items()],
        **more,
    }
    return validate(content, ImportMapping, "test")


def formatted_times(places, rate_hz, form):
    """Return the times in one format, and their unit."""
    match form:
        case "0.1 ms":
            return [f"{1e3 * each / rate_hz:.1f}" for each in places], "ms"
        case "exact":
            return [f"{each / rate_hz:.12g}" for each in places], "s"
        case "us":
            return [f"{each / rate_hz:.6f}" for each in places], "s"
        case "float32 ms":
            return (1e3 * places / rate_hz).astype(np.float32).astype(float), "ms"
    raise AssertionError(form)


KINDS = ("single", "blocks", "packets", "every second", "every third")
FORMS = [(10_000.0, "0.1 ms"), (10_000.0, "us"), (5120.0, "exact"), (5120.0, "us"), (10_000.0, "float32 ms")]


@pytest.mark.parametrize("share", [0.01, 0.1, 0.4])
@pytest.mark.parametrize("kind", KINDS)
def test_every_missing_row_is_counted_as_lost(tmp_path, kind, share):
    rng = np.random.default_rng([1, round(100 * share), len(kind)])
    rate_hz, form = FORMS[(KINDS.index(kind) + round(10 * share)) % len(FORMS)]
    places = kept_rows(kind, min(share, 0.3) if kind == "every third" else share, rng)
    times, unit = formatted_times(places, rate_hz, form)
    path = csv_file(tmp_path / "mine.csv", times, places, rate_hz, unit)
    with open_source(path) as source:
        rates_hz = {sum(each.rates_hz) / 2 for each in source.channels if each.label == "base"}
    (found_hz,) = rates_hz
    assert found_hz == pytest.approx(rate_hz, rel=1e-4)
    with open_recording(import_recording(path, meaning(rate_hz), tmp_path / "a.h5")) as recording:
        velocity = recording.read("m0_velocity")
        assert recording.sample_rate_hz == rate_hz
    np.testing.assert_array_equal(np.flatnonzero(~np.isnan(velocity)), places)
    expected = 0.02 * np.cos(2 * np.pi * 150.0 * places / rate_hz + 1.0)
    np.testing.assert_allclose(velocity[places], expected, atol=1e-7)


@pytest.mark.thorough
@pytest.mark.parametrize("share", [0.01, 0.1, 0.4])
def test_missing_rows_of_an_hdf5_file_with_float32_times_are_counted(tmp_path, share):
    rng = np.random.default_rng(3)
    places = kept_rows("single", share, rng)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["time"] = (places / 10_000.0).astype(np.float32)
        for name in ("drive", "base", "m0"):
            file[name] = np.cos(0.1 * places)
    sources = [{"source": f"/{each.source}", "role": each.role, "scale": 1.0} for each in meaning().channels]
    made = import_recording(tmp_path / "a.h5", meaning(10_000.0, channels=sources), tmp_path / "b.h5")
    with open_recording(made) as recording:
        np.testing.assert_array_equal(np.flatnonzero(~np.isnan(recording.read("m0_velocity"))), places)


def test_a_sampling_rate_inferred_from_times_with_many_missing_rows_must_be_confirmed(tmp_path):
    """Rounded times at another sampling rate with missing rows have the same intervals."""
    places = kept_rows("single", 0.2, np.random.default_rng(4))
    path = csv_file(tmp_path / "mine.csv", *formatted_times(places, 10_000.0, "0.1 ms")[:1], places, 10_000.0)
    with pytest.raises(InvalidRequest, match=r"its times give about 10000\); give sample_rate_hz"):
        import_recording(path, meaning(), tmp_path / "a.h5")
    with pytest.raises(InvalidRequest, match="about 10000 samples/s, but the mapping states 8000") as refused:
        import_recording(path, meaning(8000.0), tmp_path / "a.h5")
    assert "even" not in str(refused.value)


def uneven_times(fault, rng):
    places = kept_rows("single", 0.1, rng)
    match fault:
        case "jitter":
            return places + rng.uniform(-0.3, 0.3, places.size)
        case "drift":
            return places * (1 + 2e-3 * places / SAMPLES)
        case "steps of any length":
            return np.cumsum(rng.exponential(1.0, SAMPLES))
        case "1.2 digits" | "1.96 digits" | "2.5 digits":
            return np.round(places * float(fault.split()[0]))
    raise AssertionError(fault)


@pytest.mark.parametrize(
    "fault", ["jitter", "drift", "steps of any length", "1.2 digits", "1.96 digits", "2.5 digits"]
)
def test_uneven_and_coarse_times_with_missing_rows_are_refused(tmp_path, fault):
    places = uneven_times(fault, np.random.default_rng(5))
    digits = float(fault.split()[0]) if "digits" in fault else 1.0
    times = [f"{0.1 * each:.7g}" for each in places]
    path = csv_file(tmp_path / "mine.csv", times, places, 10_000.0)
    for rate_hz in (10_000.0 / digits, None):
        with pytest.raises(InvalidRequest) as refused:
            import_recording(path, meaning(rate_hz), tmp_path / "a.h5")
        said = str(refused.value)
        assert said.count('give time = "even"') == said.count('if no samples are missing, give time = "even"')


def test_a_refusal_names_the_channel_by_its_heading(tmp_path):
    places = uneven_times("jitter", np.random.default_rng(7))
    path = csv_file(tmp_path / "mine.csv", 0.1 * places, places, 10_000.0)
    with pytest.raises(InvalidRequest, match=re.escape("(channel '2' (drive))")):
        import_recording(path, meaning(10_000.0), tmp_path / "a.h5")


@pytest.mark.parametrize("share", [0.0, 0.02])
def test_times_that_show_lost_samples_are_reported_even_if_a_mapping_replaces_them(tmp_path, share):
    places = kept_rows("single", share, np.random.default_rng(8), DWELL_SAMPLES)
    path = csv_file(tmp_path / "mine.csv", formatted_times(places, 10_000.0, "0.1 ms")[0], places, 10_000.0)
    made = import_recording(path, meaning(10_000.0, time="even"), tmp_path / "a.h5")
    (check,) = (each for each in analyse(made).checks if each.what == "Time of the imported file")
    assert check.verdict is (Verdict.WARNING if share else Verdict.NOTE)
    assert ("frequencies and amplitudes are wrong" in check.text) == (share > 0)


def test_a_dwell_with_missing_rows_is_refused_but_a_part_without_gaps_is_analysed(tmp_path):
    places = np.delete(np.arange(DWELL_SAMPLES), 16_500)
    path = csv_file(tmp_path / "mine.csv", formatted_times(places, 10_000.0, "0.1 ms")[0], places, 10_000.0)
    whole = import_recording(path, meaning(10_000.0), tmp_path / "a.h5")
    with pytest.raises(UnusableData, match="import a part of the file without lost samples"):
        analyse(whole)
    part = meaning(10_000.0, parts=[{"start_s": 0.1, "stop_s": 1.6}])
    found = analyse(import_recording(path, part, tmp_path / "b.h5"))
    assert found.response.drive.frequency_hz == pytest.approx(150.0, abs=0.01)


@pytest.mark.thorough
def test_a_file_with_more_gaps_than_a_recording_can_store_is_refused_without_leftovers(tmp_path):
    places = np.flatnonzero(np.arange(100_000) % 23 != np.arange(100_000) // 23 % 20)
    path = csv_file(tmp_path / "mine.csv", formatted_times(places, 10_000.0, "0.1 ms")[0], places, 10_000.0)
    with pytest.raises(InvalidRequest, match="missing in more than 4096 places of the file"):
        import_recording(path, meaning(10_000.0), tmp_path / "a.h5")
    assert [each.name for each in tmp_path.iterdir()] == ["mine.csv"]


@pytest.mark.parametrize("missing", [1, 30])
def test_times_that_are_not_numbers_are_refused(tmp_path, missing):
    places = np.arange(SAMPLES)
    times = 0.1 * places
    times[100 : 100 + missing] = np.nan
    path = csv_file(tmp_path / "mine.csv", times, places, 10_000.0)
    with pytest.raises(InvalidRequest, match="times that are not numbers"):
        import_recording(path, meaning(10_000.0), tmp_path / "a.h5")
