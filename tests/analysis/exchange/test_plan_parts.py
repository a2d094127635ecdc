"""Positions of the parts of a plan in an imported file."""

import pytest

from vibench.acquisition import validate
from vibench.analysis import InvalidRequest
from vibench.analysis.exchange import ImportMapping
from vibench.analysis.exchange._import_recording import place_parts

NOISE = {
    "kind": "multisine_noise",
    "amplitude_vpp": 1.0,
    "band_start_hz": 60.0,
    "band_stop_hz": 560.0,
    "repetition_hz": 4.0,
    "periods": 2,
    "realisations": 3,
    "settle_s": 1.0,
}


def mapping_of(excitation, **more):
    content = {
        "started_utc": "2026-03-01T12:00:00Z",
        "measurement": {"name": "m", "excitation": excitation},
        "channels": [{"source": "1", "role": "m0_velocity"}],
        **more,
    }
    return validate(content, ImportMapping, "test")


def ranges(parts):
    return [(each.start, each.stop) for each in parts]


def test_the_realisations_of_an_imported_plan_alternate_with_settling_times():
    parts = place_parts(mapping_of(NOISE, begins_s=0.5), 1000.0, 10_000)
    assert ranges(parts) == [(1500, 2000), (3000, 3500), (4500, 5000)]
    assert [each.segment.numbers["realisation"] for each in parts] == [0, 1, 2]


def test_parts_given_in_the_mapping_take_the_labels_of_the_plan():
    told = [{"start_s": 1.0, "stop_s": 1.5}, {"start_s": 4.0, "stop_s": 4.5}]
    parts = place_parts(mapping_of(NOISE, parts=told), 1000.0, 10_000)
    assert ranges(parts) == [(1000, 1500), (4000, 4500)]
    assert [each.segment.numbers["realisation"] for each in parts] == [0, 1]


def test_parts_after_the_end_of_the_file_are_left_out():
    assert len(place_parts(mapping_of(NOISE), 1000.0, 3000)) == 2
    (cut,) = place_parts(mapping_of(NOISE, parts=[{"start_s": 1, "stop_s": 1e308}]), 1000.0, 3000)
    assert cut.start == 1000 < 3000 < cut.stop


@pytest.mark.parametrize(
    ("told", "said"),
    [
        ([(1, 2), (3, 4), (5, 6), (7, 8)], "4 parts are given, but the plan of m has 3"),
        ([(1, 3), (2, 4)], "in the order of time"),
        ([(11, 12)], "no part of the plan begins within the 10 s"),
        ([(1e307, 1e308)], "no part of the plan begins within the 10 s"),
    ],
)
def test_parts_that_an_imported_plan_cannot_have_are_refused(told, said):
    parts = [{"start_s": start_s, "stop_s": stop_s} for start_s, stop_s in told]
    with pytest.raises(InvalidRequest, match=said):
        place_parts(mapping_of(NOISE, parts=parts), 1000.0, 10_000)
