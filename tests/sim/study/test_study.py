import pytest
from pydantic import ValidationError

from vibench.sim import RigidStops, SpecimenWarning, gong2025
from vibench.sim.scene.scene import Rest
from vibench.sim.study import Start, Study
from vibench.sim.study._grid import FREQUENCY
from vibench.sim.study._study import GivenStart

LEAST = {"frequencies_hz": [100.0, 200.0], "amplitudes_m": [1e-6]}


def test_a_study_round_trips_through_json():
    study = Study(
        **LEAST,
        models=("hertz", "power:3@0.2+7@0.8"),
        starts=("up", GivenStart(label="kick", state=(1e-7 / 3.0, 0, 0, 0, 0.1, 0))),
        duration_s="auto",
    )
    assert Study.model_validate_json(study.model_dump_json()) == study


def test_the_default_specimen_of_a_study_is_gong2025():
    study = Study(**LEAST)
    assert study.specimen.specimen() == gong2025()
    assert study.specimen.specimen("power:5", 0.0, 30e-6) == gong2025(0.0, 30e-6, "power:5")
    assert (study.models, study.damping_times_s, study.gaps_m) == (("hertz",), (2e-5,), (45e-6,))


def test_values_that_are_not_varied_in_a_study_come_from_its_specimen():
    own = {"model": "asymmetric", "dampings_ns_per_m": [0.5, 0.01, 0.3], "contact": "rigid:0.7"}
    study = Study(**LEAST, specimen=own)
    scene = study.scene((0,) * 6, Rest())
    assert scene.specimen.gaps_m == (30e-6, 60e-6)
    assert scene.specimen.dampings == (0.5, 0.01, 0.3)
    assert scene.specimen.contact == RigidStops(0.7)
    assert [axis.values for axis in study.axes[:3]] == [("rigid:0.7",), ("as described",), ("as described",)]
    assert Study.model_validate_json(study.model_dump_json()) == study


def test_the_structure_table_of_an_older_study_is_read_as_specimen():
    structure = {"masses_kg": [5e-3, 2e-3, 2e-3]}
    with pytest.warns(SpecimenWarning):
        assert Study(**LEAST, structure=structure).specimen.masses_kg == (5e-3, 2e-3, 2e-3)


def test_the_grid_has_a_point_for_every_combination():
    study = Study(
        **LEAST,
        models=("hertz", "linear"),
        gaps_m=(1e-5, 2e-5, 3e-5),
        starts=("rest", "up"),
        observe=["response"],
    )
    assert study.grid.shape == (2, 1, 3, 1, 2, 2)
    assert study.axes[-1].name == FREQUENCY
    assert study.starts == (Start.REST, Start.UP)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("amplitudes_m", [2e-6, 1e-6], "1e-06 comes after 2e-06; give every value once, ascending"),
        ("amplitudes_m", [], "at least 1 item"),
        ("amplitudes_m", [0.0], "greater than 0"),
        ("frequencies_hz", [float("nan")], "finite|greater than 0"),
        ("frequencies_hz", {"start": 10, "stop": 5, "step": 1}, "start must not be above stop"),
        ("models", ["herz"], "Contact 'herz' is not known: give one of hertz"),
        ("models", ["hertz", "hertz"], "models contains 'hertz' twice"),
        ("starts", ["rest", "rest"], "starts contains 'rest' twice"),
        ("starts", [{"label": "kick", "state": [1, 2, 3]}], "state"),
        ("damping_times_s", [-1e-5], "greater than or equal to 0"),
        ("gaps_m", [0.0], "greater than 0"),
        ("duration_s", "forever", "duration_s"),
        ("observe", ["spectrum"], "response"),
        ("duration_s", 1e300, "it must be at most 1e\\+12 drive periods, 1e\\+10 s"),
        ("amplitudes_m", [1e-6, 1e30], r"Drive amplitude 1e\+30 m is not allowed"),
        ("frequencies_hz", [100.0, 1e13], "Drive frequency 10000000000000.0 Hz is not allowed"),
        ("window_s", 0.005, "it must contain one drive period, 0.01 s"),
        ("window_s", 31.0, "within the run of 30.0 s"),
        ("frequencys", [1.0], "frequencys"),
    ],
)
def test_invalid_study_values_are_named_in_the_error(key, value, said):
    with pytest.raises(ValidationError, match=said):
        Study.model_validate({**LEAST, key: value})


def test_more_points_than_a_file_should_hold_are_refused():
    many = {"start": 1.0, "stop": 900.0, "step": 0.001}
    with pytest.raises(ValidationError, match="points were requested; a study has at most"):
        Study(frequencies_hz=many, amplitudes_m=[k * 1e-6 for k in range(1, 13)])


def test_equal_studies_are_equal_as_dictionary_keys():
    one, again = (Study(frequencies_hz=[100.0], amplitudes_m=[1e-6]) for _ in range(2))
    other = Study(frequencies_hz=[100.0], amplitudes_m=[1e-6], budget_s=0.0)
    assert len({one, again, other}) == 2
