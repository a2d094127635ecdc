import shutil

import h5py
import numpy as np
import pytest

from tests.analysis import synthetic_recordings as synthetic
from vibench.acquisition import open_recording
from vibench.acquisition.plan import Dwell
from vibench.acquisition.recording import BIN_SAMPLES
from vibench.analysis import InvalidRequest
from vibench.analysis.live import has_overview
from vibench.analysis.live._outline import overview_of

RATE = 6400.0
SAMPLES = 200_000
HOLE = (100_000, 103_000)
CHANNELS = ("drive_voltage", "base_acceleration", "m0_velocity")


def write(folder, frequency_hz, impact=(), hole=None):
    """Record a sine, with the velocities of an impact."""
    time_s = np.arange(SAMPLES) / RATE
    velocity = 0.01 * np.sin(2 * np.pi * frequency_hz * time_s)
    velocity[150_001 : 150_001 + len(impact)] = impact
    motion = synthetic.Motion(np.zeros(SAMPLES), np.cos(time_s))
    plan = Dwell(amplitude_vpp=1.0, frequency_hz=50.0, settle_s=1.0, duration_s=20.0)
    return synthetic.write_recording(folder, plan, motion, velocity, [], hole=hole)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = write(tmp_path_factory.mktemp("overview"), 50.0, (0.4, -0.5, 0.4), HOLE)
    with open_recording(path) as opened:
        yield opened


@pytest.mark.parametrize("columns", [10, 100, 1000, 1563, 5000])
def test_an_impact_of_three_samples_is_visible_in_every_overview(recording, columns):
    picture = overview_of(recording).picture(CHANNELS, 0, SAMPLES, columns)
    assert picture.high[2].shape[0] <= columns
    assert np.nanmax(picture.high[2]) == pytest.approx(0.4, rel=1e-5)
    assert np.nanmin(picture.low[2]) == pytest.approx(-0.5, rel=1e-5)
    column = int(np.nanargmax(picture.high[2]))
    assert abs(picture.time_s[column] * RATE - 150_002) <= picture.samples_per_column + BIN_SAMPLES


@pytest.mark.parametrize(
    ("start", "stop"), [(0, 200_000), (37, 180_001), (149_000, 151_000), (150_000, 150_007)]
)
def test_an_overview_picture_shows_the_extremes_of_its_range(recording, start, stop):
    overview = overview_of(recording)
    samples = recording.read("m0_velocity", start, stop)
    picture = overview.picture(("m0_velocity",), start, stop, 200)
    assert np.nanmax(picture.high) == pytest.approx(np.nanmax(samples), rel=1e-6)
    assert np.nanmin(picture.low) == pytest.approx(np.nanmin(samples), rel=1e-6)


def test_an_overview_picture_of_a_short_range_shows_individual_samples(recording):
    picture = overview_of(recording).picture(("m0_velocity",), 150_000, 150_010, 100)
    assert picture.samples_per_column == 1.0
    assert np.allclose(picture.low[0], recording.read("m0_velocity", 150_000, 150_010))
    assert np.allclose(picture.time_s, np.arange(150_000, 150_010) / RATE)


def test_lost_samples_leave_a_gap_in_the_overview_picture(recording):
    picture = overview_of(recording).picture(CHANNELS, 0, SAMPLES, 1000)
    inside = (picture.time_s > (HOLE[0] + 300) / RATE) & (picture.time_s < (HOLE[1] - 400) / RATE)
    assert inside.sum() > 5
    assert np.isnan(picture.low[:, inside]).all()
    assert np.isfinite(picture.low).mean() > 0.97


def test_an_overview_picture_is_the_same_if_the_file_has_no_overview(recording, tmp_path):
    path = tmp_path / "old.h5"
    shutil.copyfile(recording.path, path)
    with h5py.File(path, "r+") as file:
        del file["overview"]
    told = []
    with open_recording(path) as old:
        assert not has_overview(old)
        assert has_overview(recording)
        made = overview_of(old, lambda done, asked: told.append((done, asked)))
        kept = overview_of(recording)
        for columns in (50, 900):
            first = made.picture(CHANNELS, 0, SAMPLES, columns)
            second = kept.picture(CHANNELS, 0, SAMPLES, columns)
            assert np.array_equal(first.low, second.low, equal_nan=True)
            assert np.array_equal(first.high, second.high, equal_nan=True)
    assert told[-1] == (3 * SAMPLES, 3 * SAMPLES)


@pytest.mark.parametrize(("start", "stop", "columns"), [(5, 5, 10), (0, 100, 0), (SAMPLES, SAMPLES + 5, 10)])
def test_an_overview_picture_of_an_empty_range_is_refused(recording, start, stop, columns):
    with pytest.raises(InvalidRequest, match="were requested"):
        overview_of(recording).picture(CHANNELS, start, stop, columns)


@pytest.mark.parametrize("frequency_hz", [4.0, 9.0, 11.5])
def test_the_overview_of_a_steady_sine_is_straight_with_bins_shorter_than_a_period(tmp_path, frequency_hz):
    with open_recording(write(tmp_path, frequency_hz)) as opened:
        for columns in (390, 350, 300):
            picture = overview_of(opened).picture(("m0_velocity",), 0, SAMPLES, columns)
            assert picture.samples_per_column >= BIN_SAMPLES
            assert picture.high[0, 4:-4].min() > 0.0095
            assert picture.low[0, 4:-4].max() < -0.0095
