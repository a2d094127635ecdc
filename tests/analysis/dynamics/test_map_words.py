"""The caption of a map: what tells its figure from that of another specimen, law or start."""

import pytest

from vibench.analysis.dynamics import map_caption
from vibench.sim.maps import Map, Range, solve_map

OWN = {"name": "mine", "masses_kg": (5.8e-3, 2.1e-3, 2.2e-3)}


@pytest.mark.filterwarnings("ignore::vibench.sim.SpecimenWarning")
@pytest.mark.parametrize(
    ("said", "words"),
    [
        ({}, "Specimen gong2025, frequency_hz = 260;"),
        ({"damping_time_s": 0.0}, "Specimen gong2025, frequency_hz = 260, damping_time_s = 0;"),
        ({"model": "linear"}, "Specimen gong2025, model = linear, frequency_hz = 260;"),
        (
            {"specimen": {"gap_m": (4.5e-5, float("inf"))}},
            "Specimen gong2025 (gap_m = [4.5e-05, inf]), frequency_hz = 260;",
        ),
        (
            {"specimen": {"dampings_ns_per_m": (0.0, 0.1, 0.2), "hertz_stiffness": 1e9}},
            "Specimen gong2025 (dampings_ns_per_m = [0, 0.1, 0.2], hertz_stiffness = 1e+09), freq",
        ),
        ({"specimen": "rigid_stops"}, "Specimen rigid_stops, frequency_hz = 260;"),
        ({"specimen": OWN}, "Specimen mine (masses_kg = [0.0058, 0.0021, 0.0022]), frequency_hz = 260;"),
        ({"x_m": 1e-7}, "Specimen gong2025, frequency_hz = 260, x_m = 1e-07;"),
    ],
)
def test_a_caption_names_every_changed_specimen_value(said, words):
    # So small a drive touches nothing: nothing is followed.
    levels = Range(start=1e-9, stop=2e-9, points=2)
    plan = Map.model_validate({"amplitude_m": levels, "periods": 100, "window_periods": 10, **said})
    assert map_caption(solve_map(plan, workers=1)).startswith(words)
