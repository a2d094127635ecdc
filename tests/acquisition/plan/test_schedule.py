"""The time schedule of a measurement: check, ramp, lead-in, settling and recording."""

import pytest

from vibench.acquisition.plan import (
    CHECK_S,
    HUSH_S,
    Dwell,
    LeadIn,
    Measurement,
    ResonanceTracking,
    SineSweep,
    lead_in_s,
)


def measurement(excitation):
    return Measurement(name="one", excitation=excitation, ramp_s=0.5)


def test_a_sweep_starts_after_the_check_the_ramp_and_the_settling():
    sweep = SineSweep(amplitude_vpp=1.0, start_hz=100, stop_hz=200, duration_s=10, settle_s=2.0)
    assert lead_in_s(measurement(sweep)) == pytest.approx(CHECK_S + 0.5 + 2.0)


def test_the_lead_in_tones_of_a_dwell_are_part_of_its_lead_in_time():
    tones = tuple(LeadIn(frequency_hz=hz, amplitude_vpp=1.0) for hz in (90, 95))
    dwell = Dwell(amplitude_vpp=1.0, frequency_hz=100, duration_s=5, settle_s=1.0, lead_in=tones, lead_s=0.25)
    assert lead_in_s(measurement(dwell)) == pytest.approx(CHECK_S + 0.5 + 2 * 0.25 + 1.0)


def test_the_settling_time_under_feedback_does_not_count_as_lead_in():
    tracking = ResonanceTracking(
        amplitude_vpp=1.0, start_hz=94, low_hz=90, high_hz=98, accelerations_m_per_s2=(0.1,)
    )
    assert lead_in_s(measurement(tracking)) == pytest.approx(CHECK_S + HUSH_S + 0.5)
