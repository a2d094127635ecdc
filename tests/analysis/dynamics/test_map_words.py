"""The caption of a map names specimen, contact law and start."""

from types import SimpleNamespace

import pytest

from vibench.analysis.dynamics import map_caption, motion_words
from vibench.sim import MotionKind
from vibench.sim.maps import Audit, Map, MapMotion, Range, solve_map
from vibench.sim.scene.shares import Share

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
def test_a_map_caption_names_every_changed_specimen_value(said, words):
    # The drive is too small for contact, so nothing is integrated.
    levels = Range(start=1e-9, stop=2e-9, points=2)
    plan = Map.model_validate({"amplitude_m": levels, "periods": 100, "window_periods": 10, **said})
    assert map_caption(solve_map(plan, workers=1)).startswith(words)


CHAOS = MapMotion(MotionKind.CHAOTIC_SO_FAR, None, True, 4.08, 2.0, Share(0.7134, 0.1707, 0.9678))


@pytest.mark.parametrize(
    ("random_starts", "filled", "end"),
    [
        (0, None, "71.34% of the points"),
        (0, 0, "71.34% of the points"),
        (0, 5, "71.34% of the points; if all points were computed, it would be 17.07% to 96.78%"),
        (3, None, "71.34% of the points; with other random initial states, it would be 17.07% to 96.78%"),
    ],
)
def test_only_an_estimated_share_of_a_motion_in_a_map_has_an_interval(random_starts, filled, end):
    plan = Map(frequency_hz=Range(start=100.0, stop=200.0, points=3), random_starts=random_starts)
    audit = None if filled is None else Audit(filled, 0, 0, (0.0,), (0.0,))
    said = motion_words(SimpleNamespace(plan=plan, audit=audit), CHAOS)
    assert said == f"chaotic, Response I 4.08: {end}"
