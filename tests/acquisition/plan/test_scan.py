"""Scan campaigns: names, order, node numbers, and points that are refused."""

import pytest

from vibench.acquisition import ConfigurationError, load_campaign, shipped, validate
from vibench.acquisition.plan import Campaign

NOISE = {"kind": "white_noise", "amplitude_vpp": 0.1, "band_start_hz": 20, "band_stop_hz": 800}
DWELL = {"kind": "dwell", "frequency_hz": 150, "amplitude_vpp": 0.5, "duration_s": 1}


def point(name, body="m0", **others):
    return {"name": name, "body": body, "x_m": 0.0, "y_m": 0.0, "z_m": 0.01, **others}


def scan(*points, **others):
    content = {"measurements": [{"name": "noise", "excitation": NOISE}], **others}
    return validate({"name": "scan", "scan": list(points), **content}, Campaign, "scan.toml")


def test_every_measurement_is_planned_at_each_scan_point():
    sweep = {
        "name": "line",
        "frequency_hz": [150, 160],
        "continue_from_previous": "frequency_hz",
        "measurement": {"excitation": DWELL},
    }
    campaign = scan(point("top", "m1", node=7), point("foot"), sweeps=[sweep])
    assert campaign.recording_names() == (
        "noise-top",
        "line-150hz-top",
        "line-160hz-top",
        "noise-foot",
        "line-150hz-foot",
        "line-160hz-foot",
    )
    places = [each.measurement.point for each in campaign.points()]
    assert [(each.name, each.node, each.role.value) for each in places[::3]] == [
        ("top", 7, "m1_velocity"),
        ("foot", 2, "m0_velocity"),
    ]
    assert [each.chain for each in campaign.points()][1:3] == ["line-top", "line-top"]


def test_the_shipped_scan_visits_all_three_masses():
    places = [each.measurement.point for each in load_campaign(shipped("campaigns/scan.toml")).points()]
    assert {each.body for each in places} == {"m0", "m1", "m2"}
    assert [each.node for each in places] == [1, 2, 3, 4]


@pytest.mark.parametrize(
    ("points", "sentence"),
    [
        ([point("top"), point("Top")], r"two points have the name 'top'; each name must be unique"),
        ([point("top"), point("foot", node=1)], r"two points have the node '1'; each node must be unique"),
        ([{"name": "top", "body": "m0"}], r"scan\.0\.x_m, scan\.0\.y_m, scan\.0\.z_m are missing"),
        ([point("top", "m3")], r"scan\.0\.body.*'m3': input should be 'm0', 'm1' or 'm2'"),
        ([point("top", x_m=float("nan"))], r"scan\.0\.x_m.*finite"),
        ([point("top", direction="up")], r"scan\.0\.direction.*'x', 'y', 'z'"),
        ([point("t" * 60)], r"would have 66 characters; at most 64 are allowed"),
    ],
)
def test_an_invalid_scan_point_is_refused_with_a_readable_message(points, sentence):
    with pytest.raises(ConfigurationError, match=sentence):
        scan(*points)


def test_a_scan_with_feedback_is_refused_because_feedback_needs_m0():
    held = {"kind": "held_dwell", "frequency_hz": 150, "duration_s": 1, "amplitude_vpp": 1}
    held["base_level"] = {"acceleration_m_per_s2": 5}
    with pytest.raises(ConfigurationError, match="held_dwell needs the motion of m0"):
        scan(point("top"), measurements=[{"name": "dwell", "excitation": held}])
