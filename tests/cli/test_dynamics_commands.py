"""`vibench branches` and `vibench spectrum` on the command line."""

import re

import h5py
import pytest

from vibench.acquisition import shipped
from vibench.sim import ArcEnd

from .in_this_process import invoke, json_of, refusal_of


@pytest.mark.thorough
def test_branches_are_printed_as_json_and_stored_with_a_figure_and_tables(tmp_path):
    options = ("--frequency", "60:64", "--amplitude", "5e-6", "--places", 2, "--starts", 1)
    (branch,) = json_of("branches", *options, "--out", tmp_path / "out")["branches"]
    assert branch["points"][0]["frequency_hz"] == 60.0
    assert all(point["is_stable"] for point in branch["points"])
    names = {each.name for each in (tmp_path / "out").iterdir()}
    assert names >= {"branches.h5", "branches.png", "branches.svg", "branches.csv"}
    assert "ever overwritten" in refusal_of("branches", *options, "--out", tmp_path / "out")


def test_the_branch_search_ends_at_the_requested_time():
    found = json_of("branches", "--frequency", "50:600", "--amplitude", "5e-6", "--time", "300 ms")
    assert not found["is_complete"]
    assert sum(each["end"] == ArcEnd.OUT_OF_TIME for each in found["branches"]) <= 1


@pytest.mark.thorough
def test_branches_over_amplitude_are_reported_in_sentences():
    result = invoke("branches", "--frequency", 60, "--amplitude", "1e-6:2e-6", "--places", 2, "--starts", 0)
    assert result.exit_code == 0, result.output
    assert "1: period 1, mirrored: 1 to 2 µm" in result.output
    assert "1 branch (0 isolated)" in result.output


SHORT_LINE = (
    "branches", "--frequency", "60:62", "--amplitude", "5e-6", "--places", 2, "--starts", 0,
)  # fmt: skip


@pytest.mark.thorough
def test_branches_report_which_motions_a_bench_can_hold():
    found = json_of(*SHORT_LINE, "--holdable", shipped("hardware_configs/virtual_rig.toml"))
    # Ten control steps; each takes ten periods, or a fifth of a second if that is longer.
    assert found["least_growth_time_s"] == pytest.approx(2.0, rel=0.05)
    assert all(point["growth_time_s"] is None for point in found["branches"][0]["points"])


@pytest.mark.thorough
def test_a_real_time_controller_can_hold_more_motions():
    pytest.importorskip("vibench_fast_loop", reason="pip install -e extensions/fast_loop brings it")
    found = json_of(*SHORT_LINE, "--holdable", shipped("hardware_configs/virtual_rig_controller.toml"))
    # Ten times the sum of the latency, 0.3 ms, and one and a half periods of the rate of 10,240 samples/s.
    assert found["least_growth_time_s"] == pytest.approx(10.0 * (3e-4 + 1.5 / 10_240))


@pytest.mark.thorough
@pytest.mark.parametrize("options", [("--model", "linear"), ()])
def test_rounding_errors_give_an_undamped_branch_neither_an_instability_nor_a_bifurcation(options):
    line = ("--amplitude", 5e-6, "--frequency", "200:201", "--places", 2, "--starts", 1)
    found = json_of("branches", "--damping-time", 0, *line, *options)
    smooth = max(found["branches"], key=lambda each: len(each["points"]))
    assert not any(point["is_stable"] or point["is_unstable"] for point in smooth["points"])
    assert smooth["events"] == []
    printed = invoke("branches", "--damping-time", 0, *line, *options).output
    assert "0% stable, 100% undecided" in printed


def test_exponents_are_printed_as_json_and_stored_in_a_file(tmp_path):
    times = ("--duration", 1.5, "--settle", 0.5)
    found = json_of("spectrum", "--amplitude", 5e-6, "--frequency", 260, *times, "--out", tmp_path / "s")
    (point,) = found["points"]
    assert len(point["exponents_per_s"]) == 6
    assert found["largest_sum_difference"] < 1e-6
    with h5py.File(tmp_path / "s" / "spectrum.h5") as file:
        assert file.attrs["format"] == "vibench spectrum"
    assert (tmp_path / "s" / "spectrum.png").is_file()


POINT = ("--amplitude", "5e-6", "--frequency", "260")
LINE = ("--amplitude", "5e-6", "--frequency", "60:70")
DRIVEN = (("spectrum", *POINT), ("branches", *LINE), ("chain", *POINT))


@pytest.mark.parametrize(
    "command",
    [
        *(("spectrum", *POINT, option) for option in ("--duration", "--settle", "--confidence")),
        *(("branches", *LINE, name) for name in ("--places", "--starts", "--harmonics", "--most-periods")),
        *(("chain", *POINT, option) for option in ("--duration", "--settle", "--exponent", "--cells")),
        *((*each, option) for each in DRIVEN for option in ("--gap", "--damping-time")),
    ],
)
@pytest.mark.parametrize("value", ["-1", "nan"])
def test_an_invalid_number_is_quoted_as_typed(command, value):
    result = invoke(*command, value)
    said = f"{result.exception} {result.output}"
    assert result.exit_code != 0
    assert command[-1] in said
    assert not re.search(r"\w_(s|m|hz)\b|most_periods|lengths\b", said)


@pytest.mark.parametrize("command", [("spectrum", *POINT, "--duration"), ("branches", *LINE, "--places")])
def test_a_zero_that_is_not_allowed_is_quoted_as_typed(command):
    assert f"{command[-1]} was given as 0" in refusal_of(*command, "0")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("branches", "--amplitude", "5e-6"), "--amplitude or --frequency is missing"),
        (
            ("branches", "--like", "any.h5", "--amplitude", "1e-6:5e-6"),
            "leave out --amplitude (--frequency START:STOP is allowed",
        ),
        (("branches", "--resonance", "92:97"), "also give --amplitude START:STOP"),
        (
            ("branches", "--resonance", "92", "--amplitude", "1e-8:1e-7"),
            "--resonance was given as '92': 1 numbers are",
        ),
        (("branches", "--resonance", "102:107", "--amplitude", "1e-8:1e-7"), "a band around one mode"),
        (("spectrum", "--amplitude", 5e-6, "--frequency", 260, "--confidence", 95), "for 95 % give 0.95"),
        (("branches", "--amplitude", "5e-6", "--frequency", "60"), "give one of them as a range"),
        (("branches", "--amplitude", "1e-6:5e-6", "--frequency", "60:70"), "give one of them as a range"),
        (("branches", "--amplitude", "5e-6", "--frequency", "70:60"), "70 is not below 60"),
        (("branches", "--amplitude", "x", "--frequency", "60:70"), "'x' is not a number"),
        (("branches", "--amplitude", "-1", "--frequency", "60:70"), "-1 is not above 0"),
        (("branches", *LINE, "--model", "rigid:2"), "Restitution 2.0 is not allowed"),
        (("branches", *LINE, "--method", "first-order"), "one harmonic cannot describe hertz"),
        (("branches", *LINE, "--places", "1"), "places was given as 1"),
        (("spectrum", *LINE), "one above 0 Hz or START:STOP:STEP such as 50:600:1"),
        (
            ("spectrum", "--amplitude", "1e-6:2e-6:1e-6", "--frequency", "60:70:1"),
            "give one of them as one number",
        ),
        (("spectrum", *POINT, "--duration", "0.1"), "request 32 intervals or more"),
    ],
)
def test_invalid_options_are_refused_with_a_readable_message(arguments, said):
    assert said in refusal_of(*arguments)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        *(
            ((*each, f"{before}{value}"), f"Drive amplitude {float(value)} m is not allowed")
            for each, before in (
                *((each, "--amplitude=") for each in DRIVEN),
                (("branches", "--frequency", 60), "--amplitude=1e-6:"),
            )
            for value in ("1e300", "1e30", "1001")
        ),
        *(
            ((*each, "--damping-time", value), f"--damping-time was given as {float(value)!r}")
            for each in DRIVEN
            for value in ("1e300", "1e3")
        ),
    ],
)
@pytest.mark.timeout(30)
def test_impossible_specimen_values_are_refused_at_once(arguments, told):
    """Such values once caused tracebacks, warnings of numpy, or minutes of computation."""
    assert told in refusal_of(*arguments, *(("--starts", 0) if arguments[0] == "branches" else ()))


@pytest.mark.thorough
def test_branches_reach_and_report_a_target_error(vibench_here, tmp_path):
    asked = ("branches", "--model", "power:5", "--amplitude", 5e-6, "--frequency", "50:60", "--places", 2)
    ran = vibench_here(*asked, "--method", "balance", "--error", "1 %", cwd=tmp_path)
    assert ran.returncode == 0, ran.stderr
    assert "motions reached an error of 1 %" in " ".join(ran.stdout.split())
    refusal_of = vibench_here(*asked, "--method", "first-order", "--error", "1 %", cwd=tmp_path)
    assert refusal_of.returncode != 0
    assert "the error of one harmonic is fixed" in " ".join(refusal_of.stderr.split())
