import numpy as np
import pytest

from analysis.live.view import LiveChannel, LiveView

RATE = 51_200.0
A0 = 4e-6
CHANNELS = (
    LiveChannel("drive_voltage", "V", 2.0, 5.0),
    LiveChannel("amplifier_voltage", "V", 10.0, 5.0),
    LiveChannel("base_acceleration", "m/s²", 100.0, 5.0),
    LiveChannel("m0_velocity", "m/s", 0.25, 5.0),
)


def volts(first, count, frequency_hz=260.0):
    omega = 2 * np.pi * frequency_hz
    phase = omega * (first + np.arange(count)) / RATE
    drive = np.cos(phase)
    units = np.stack((drive, 3 * drive, -A0 * omega**2 * drive, -3 * A0 * omega * np.sin(phase)))
    return (units / np.array([[each.units_per_volt] for each in CHANNELS])).astype(np.float32)


@pytest.fixture
def view():
    found = LiveView(CHANNELS, RATE, band_hz=(150.0, 350.0))
    for first in range(0, 102_400, 2560):
        found.add(first, volts(first, 2560))
    return found


def test_lanes_show_the_newest_seconds_in_the_channels_units(view):
    lanes = view.lanes(1.0, 800)
    assert lanes.low.shape == (4, 800)
    assert lanes.time_s[0] == pytest.approx(1.0)
    assert lanes.time_s[-1] == pytest.approx(2.0, abs=0.01)
    assert lanes.high[0].max() == pytest.approx(1.0, rel=1e-3)
    assert lanes.high[1].max() == pytest.approx(3.0, rel=1e-3)
    assert lanes.high[3].max() == pytest.approx(3 * A0 * 2 * np.pi * 260, rel=1e-3)


def test_responses_grow_as_the_run_goes_on(view):
    course = view.course()
    assert course.frequency_hz.size >= 10
    assert np.allclose(course.frequency_hz, 260.0, atol=0.01)
    assert np.allclose(course.response_ii, 3.0, rtol=3e-3)
    assert np.allclose(course.response_i, 3.0, rtol=5e-3)


def test_a_portrait_keeps_its_section(view):
    assert view.portrait().drive_hz == pytest.approx(260.0, abs=0.01)
    assert np.allclose(view.section.displacement_m, 3 * A0, rtol=5e-3)


def test_the_transmission_at_the_drive_is_the_ratio_of_displacements(view):
    found = view.transmission()
    line = int(np.argmin(np.abs(found.frequency_hz - 260.0)))
    assert found.magnitude[line] == pytest.approx(3.0, rel=0.01)
    assert view.transmission() is found
    assert view.spectrum() is view.spectrum()


def test_meters_and_impacts_are_read(view):
    assert view.levels[0].peak_share == pytest.approx(0.1, rel=0.01)
    assert view.impacts == 0


def test_blocks_that_overlap_change_nothing(view):
    before = view.next_sample
    view.add(before - 1000, volts(before - 1000, 1000))
    assert view.next_sample == before


def test_a_run_without_a_base_channel_is_still_watched():
    found = LiveView(CHANNELS[:2], RATE, band_hz=(150.0, 350.0))
    found.add(0, volts(0, 51_200)[:2])
    assert found.transmission() is None
    assert found.portrait() is None
    assert found.course().time_s.size == 0
    assert found.lanes(0.5, 100).low.shape == (2, 100)
