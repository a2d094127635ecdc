"""`vibench reproduce`: what cannot be is refused before anything is computed."""


def test_an_impossible_damping_is_refused_before_computation(vibench_here, tmp_path):
    result = vibench_here("reproduce", "--out", "kept", "--damping-time", "-1e-5", cwd=tmp_path)
    assert result.returncode == 1
    assert "a damping time of -1e-05 s is not allowed; give 0 to 0.01" in result.stderr
    assert not (tmp_path / "kept").exists()


def test_an_invalid_option_is_refused_before_computation(vibench_here, tmp_path):
    result = vibench_here("reproduce", "--out", "kept", "--with", "fit=0", cwd=tmp_path)
    assert result.returncode == 1
    assert "an indentation of 0 m is not allowed; give a positive one" in result.stderr
    assert not (tmp_path / "kept").exists()
