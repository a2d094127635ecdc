"""Exit codes: one rule for all commands, as docs/installation.md states it."""

import pytest

SCENE = ("--amplitude", "5e-6", "--frequency", "260")
NOT_ALLOWED = [
    ("predict", *SCENE, "--workers", "0"),
    ("predict", *SCENE, "--accuracy", "exact"),
    ("tradeoff", "--amplitude", "abc", "--frequency", "260"),
    ("chain", "--cells", "none"),
    ("chain", *SCENE, "--time", "0s"),
    ("branches", "--amplitude", "abc", "--frequency", "260:270"),
    ("branches", "--amplitude", "5e-6", "--frequency", "260:270", "--starts", "abc"),
    ("spectrum", "--amplitude", "5e-6", "--frequency", "abc"),
    ("map", "map", "--out", "a", "--kicks", "-1"),
    ("map", "map", "--out", "a", "--estimate", "--workers", "0"),
    ("study", "paper", "--out", "a.h5", "--workers", "0"),
    ("measure", "quick", "--out", "a", "--within", "soon"),
    ("measure", "quick", "--out", "a", "--after-failure", "laugh"),
    ("figure", "99", "--out", "a"),
    ("analyse", "nothing.h5"),
]
NOT_UNDERSTOOD = [
    ("unknown",),
    ("predict", "--unknown"),
    ("predict",),
    ("predict", "--amplitude"),
    ("measure", "quick"),
    ("study", "paper"),
]
NO_NUMBERS = [
    ("predict", *SCENE, "--error", "1_0%"),
    ("predict", *SCENE, "--time", "1_0s"),
    ("predict", *SCENE, "--duration", "1_0"),
    ("predict", *SCENE, "--budget", "1_0"),
    ("predict", *SCENE, "--window=1_0"),
    ("predict", *SCENE, "--workers", "1_0"),
    ("predict", "--amplitude", "5_0e-6", "--frequency", "260"),
    ("predict", "--amplitude", "5e-6", "--frequency", "1_0"),
    ("predict", "--amplitude", "5e-6", "--frequency", "２60"),
    ("chain", "--cells", "٣"),
    ("chain", "--amplitude", "1_0e-6", "--frequency", "260"),
    ("branches", "--amplitude", "1_0e-6", "--frequency", "260:270"),
    ("tradeoff", "--amplitude", "5_0e-6", "--frequency", "260"),
    ("map", "map", "--out", "a", "--kicks", "1_0"),
    ("measure", "quick", "--out", "a", "--within", "1_0h"),
]


def example_value(words):
    return " ".join(words)


@pytest.mark.parametrize("words", [*NOT_ALLOWED, *NO_NUMBERS], ids=example_value)
def test_every_command_exits_with_code_1_if_a_value_is_not_allowed(vibench_here, tmp_path, words):
    ran = vibench_here(*words, cwd=tmp_path)
    assert ran.returncode == 1, ran.stderr
    assert "rror: " in ran.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("words", NOT_UNDERSTOOD, ids=example_value)
def test_an_incomplete_or_unknown_command_exits_with_code_2(vibench_here, tmp_path, words):
    assert vibench_here(*words, cwd=tmp_path).returncode == 2


def test_a_second_path_is_refused_with_the_advice_to_give_only_one_path(vibench_here, tmp_path):
    said = vibench_here("analyse", "a.h5", "b.h5", cwd=tmp_path).stderr
    assert "(b.h5); give one path, such as a folder" in " ".join(said.split())


@pytest.mark.parametrize(("error", "remark"), [("0.1%", "needs about"), ("1e-6", "is not reachable")])
def test_a_result_that_misses_the_target_error_is_marked_and_the_exit_code_is_0(output_of, error, remark):
    assert remark in output_of("predict", *SCENE, "--error", error, "--time", "1s")


@pytest.mark.parametrize("time", ["1e9h", "1e300h"])
def test_long_campaign_times_are_valid(vibench_here, tmp_path, time):
    ran = vibench_here("measure", "quick", "--out", "a", "--estimate", "--within", time, cwd=tmp_path)
    assert "add 'until' to a measurement" in ran.stderr
