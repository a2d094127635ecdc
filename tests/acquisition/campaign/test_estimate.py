"""Estimates of a campaign's time and size match a real campaign."""

import pytest

from vibench.acquisition import RecordingError, run_campaign, validate
from vibench.acquisition.campaign import ExistingRecordings, estimate_campaign
from vibench.acquisition.plan import Campaign

CAMPAIGN = validate(
    {
        "name": "c",
        "sweeps": [
            {
                "name": "line",
                "amplitude_vpp": [0.5],
                "frequency_hz": [200, 205, 210],
                "continue_from_previous": "frequency_hz",
                "lead_s": 0.25,
                "measurement": {
                    "ramp_s": 0.2,
                    "ramp_step_s": 0.02,
                    "excitation": {"kind": "dwell", "settle_s": 0.1, "duration_s": 0.2},
                },
            }
        ],
    },
    Campaign,
    "c.toml",
)


def test_the_estimated_size_of_recordings_matches_their_samples(rig, tmp_path):
    expected = estimate_campaign(CAMPAIGN, rig, tmp_path)
    bytes_per_s = 5120 * 4 * 4
    assert expected.largest_bytes == pytest.approx((0.6 + 0.4 + 0.5 + 0.3) * bytes_per_s)
    assert expected.largest_bytes < expected.needed_bytes < 3 * expected.largest_bytes * 1.5
    assert expected.fits


@pytest.mark.thorough
def test_an_estimate_excludes_existing_recordings(bench, rig, tmp_path):
    point_results = run_campaign(bench, CAMPAIGN, tmp_path)
    with pytest.raises(RecordingError, match="exist already"):
        estimate_campaign(CAMPAIGN, rig, tmp_path)
    point_results[0].path.unlink()
    expected = estimate_campaign(CAMPAIGN, rig, tmp_path, ExistingRecordings.RESUME)
    assert (expected.recordings, expected.kept) == (1, 2)
