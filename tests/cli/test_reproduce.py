"""`vibench reproduce` refuses impossible options before any computation."""

import pytest


@pytest.mark.parametrize(
    ("option", "value", "said"),
    [
        ("--damping-time", "-1e-5", "a damping time of -1e-05 s is not allowed; give 0 to 0.01"),
        ("--with", "fit=0", "an indentation of 0 m is not allowed; give a positive one"),
    ],
)
def test_an_impossible_option_is_refused_before_computation(refusal, tmp_path, option, value, said):
    assert said in refusal("reproduce", "--out", "kept", option, value)
    assert not (tmp_path / "kept").exists()
