"""`vibench figure` and `vibench reproduce` refuse impossible options before any computation."""

import pytest

from .in_this_process import refusal_of


@pytest.mark.parametrize("number", ["5", "all"])
@pytest.mark.parametrize("none", ["0", "-0.0"])
def test_figure_5_needs_a_damping_time_above_zero(tmp_path, number, none):
    said = refusal_of("figure", number, "--out", tmp_path / "f", "--damping-time", none)
    assert said == "figure 5 compares with an undamped specimen; give a damping time above 0 s"
    assert not (tmp_path / "f").exists()


@pytest.mark.parametrize(
    ("option", "value", "told"),
    [
        ("--gap", "1e300", "a gap of 1e+300 m is not allowed; give 1e-09 to 0.01"),
        ("--gap", "1e-300", "a gap of 1e-300 m is not allowed; give 1e-09 to 0.01"),
        ("--damping-time", "1e300", "a damping time of 1e+300 s is not allowed; give 0 to 0.01"),
        ("--damping-time", "nan", "a damping time of nan s is not allowed; give 0 to 0.01"),
    ],
)
def test_impossible_specimen_sizes_are_refused(tmp_path, option, value, told):
    assert refusal_of("figure", "1", "--out", tmp_path / "f", option, value) == told
    assert not (tmp_path / "f").exists()


@pytest.mark.parametrize(
    ("option", "value", "said"),
    [
        ("--damping-time", "-1e-5", "a damping time of -1e-05 s is not allowed; give 0 to 0.01"),
        ("--with", "fit=0", "an indentation of 0 m is not allowed; give a positive length"),
    ],
)
def test_an_impossible_option_of_reproduce_is_refused_before_computation(
    refusal, tmp_path, option, value, said
):
    assert said in refusal("reproduce", "--out", "kept", option, value)
    assert not (tmp_path / "kept").exists()
