"""`vibench predict` as a user runs it: JSON with every point, a table, and one-sentence errors."""

import json

import pytest

from vibench.sim import Harmonic, gong2025, steady_response

pytestmark = pytest.mark.timeout(300)  # the first test after a change of the engine compiles it
SHORT = ("--duration", 1, "--window", 0.5)


def test_a_prediction_equals_the_engine_result_at_every_frequency(vibench, tmp_path):
    ran = vibench(
        "predict",
        *("--amplitude", 20e-6, "--frequency", "129:131:1", "--json", *SHORT),
        cwd=tmp_path,
        timeout_s=300,
    )
    assert ran.returncode == 0, ran.stderr
    assert "warning:" not in ran.stderr
    said = json.loads(ran.stdout)
    assert [point["frequency_hz"] for point in said["points"]] == [129, 130, 131]
    for point in said["points"]:
        drive = Harmonic(point["frequency_hz"], 20e-6)
        known = steady_response(gong2025(), drive, duration_s=1.0, window_s=0.5)
        assert point["response_i"] == pytest.approx(known.response_i, rel=1e-4)
        assert point["relative_ii"] == pytest.approx(known.relative_ii, rel=1e-4)
        assert point["impacts"] == known.impacts
        assert point["lyapunov_per_s"] is None
    assert said["is_complete"]
    assert said["options"]["damping_times_s"] == [2e-5]


def test_a_prediction_until_the_motion_has_settled_gives_the_kind_of_motion_and_an_error(output_of):
    asked = ("--amplitude", 5e-6, "--frequency", "94:260:166", "--duration", "auto")
    periodic, chaotic = output_of("predict", *asked, "--json")["points"]
    assert (periodic["motion"], periodic["period"]) == ("periodic", 1)
    assert periodic["error_estimate"] < 1e-6
    assert periodic["duration_s"] < 5.0
    assert (chaotic["motion"], chaotic["period"]) == ("chaotic", None)
    assert chaotic["integration_error"] < 1e-5 < chaotic["scatter"] < chaotic["error_estimate"]


def test_a_requested_lyapunov_exponent_is_given_with_its_error(output_of):
    asked = ("--amplitude", 5e-6, "--frequency", 260, "--observe", "response,lyapunov")
    (point,) = output_of("predict", *asked, "--duration", 6, "--window", 1, "--json")["points"]
    assert point["lyapunov_per_s"] > 50
    assert 0 < point["lyapunov_error_per_s"] < 30


def test_chaos_is_stated_with_the_time_for_which_it_was_observed(output_of):
    asked = ("--specimen", "linear_gap", "--amplitude", 19e-6, "--frequency", 168.2, "--duration", 2)
    printed = output_of("predict", *asked, "--window", 1, "--budget", 0)
    assert "Chaotic over 2 s; --duration auto tests whether the chaos lasts." in printed
    printed = " ".join(output_of("spectrum", *asked, "--settle", 1).split())
    assert "chaotic over 1.98 s, possibly a transient" in printed
    assert "1 chaotic while observed" in printed
    (point,) = output_of("spectrum", *asked, "--settle", 1, "--json")["points"]
    assert (point["verdict"], round(point["observed_s"], 2)) == ("chaotic", 1.98)


def test_a_prediction_prints_a_table_and_the_reason_for_its_method(output_of):
    printed = output_of("predict", "--amplitude", 1e-6, "--frequency", 300, "--explain", *SHORT)
    assert "Responses I and II" in printed
    assert "\n300 Hz: event driven. No stop is touched, but the transient has not decayed" in printed


def test_points_with_equal_explanations_are_printed_in_one_line(output_of):
    asked = ("--amplitude", 5e-6, "--frequency", "200:244:2", "--duration", 8, "--window", 1)
    told = [line for line in output_of("predict", *asked, "--explain").splitlines() if " points, " in line]
    assert [line.split(":")[0] for line in told] == ["11 points, 200 to 220 Hz", "12 points, 222 to 244 Hz"]
    assert "At 220 Hz: No stop is touched: abs(p) stays below 43.8 um" in told[0]


def test_metres_typed_instead_of_micrometres_give_a_warning_beside_the_answer(vibench_here, tmp_path):
    asked = ("--amplitude", 5, "--frequency", 30, "--duration", 0.05, "--window", 0.04, "--model", "linear")
    ran = vibench_here("predict", *asked, "--json", cwd=tmp_path)
    assert ran.returncode == 0, ran.stderr
    assert json.loads(ran.stdout)["is_complete"]
    (warning,) = [line for line in ran.stderr.splitlines() if line.startswith("warning:")]
    assert "5 m" in warning
    assert warning.endswith("give 5e-06")


def test_a_failed_point_does_not_suppress_the_results_of_other_points(vibench_here, tmp_path):
    chatter = ("--model", "rigid:1", "--gap", 1e-9, "--amplitude", 1e-3, "--duration", 0.3, "--window", 0.01)
    ran = vibench_here("predict", *chatter, "--frequency", "100:60100:60000", "--json", cwd=tmp_path)
    assert ran.returncode == 1
    (line,) = [each for each in ran.stderr.splitlines() if each.startswith("error:")]
    assert line.startswith("error: frequency 100.0 Hz: more impacts than allowed")
    said = json.loads(ran.stdout)
    assert [point["response_i"] is None for point in said["points"]] == [True, False]
    assert [failure["frequency"] for failure in said["failures"]] == [100.0]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--amplitude", 1e-300, "--frequency", 100), "Drive amplitude 1e-300 m is not allowed"),
        (("--amplitude", -1, "--frequency", 100), "--amplitude was given as -1.0: it must be above 0"),
        (("--amplitude", 1e-6, "--frequency", "x"), "START:STOP:STEP"),
        (("--amplitude", 1e-6, "--frequency", 100, "--model", "jelly"), "jelly"),
        (("--amplitude", 1e-6, "--frequency", 100, "--observe", "cats"), "cats"),
        (("--amplitude", 1e-6, "--frequency", 100, "--window", 40), "Window 40"),
        (("--amplitude", 1e-6, "--frequency", 100, "--duration", 1), "shorter window or a longer run"),
        (("--amplitude", 1e-6, "--frequency", 100, "--duration", "soon"), "auto"),
        (("--amplitude", 1e-6, "--frequency", 100, "--out", "a.csv"), "another format; use the suffix .h5"),
        (("--amplitude", "nan", "--frequency", 100), "--amplitude"),
    ],
)
def test_invalid_predictions_are_refused_with_a_readable_message(refusal, tmp_path, arguments, said):
    assert said in refusal("predict", *arguments, "--json")
    assert list(tmp_path.iterdir()) == []


FORGETFUL = ("--amplitude", 5e-6, "--frequency", 242, "--damping-time", 3e-5, "--duration", 36, "--window", 2)


def test_a_start_dependent_prediction_lists_motions_with_their_shares(vibench_here, tmp_path):
    """Chaos dies out within tens of seconds: after 36 s half of the initial conditions have settled."""
    asked = ("predict", *FORGETFUL, "--budget", "0.2s", "--explain")
    ran = vibench_here(*asked, "--json", cwd=tmp_path)
    assert ran.returncode == 0, ran.stderr
    (point,) = json.loads(ran.stdout)["points"]
    assert point["memory"] == "lost"
    motions = point["ensemble"]["motions"]
    assert len(motions) > 1
    assert sum(each["starts"] for each in motions) == point["ensemble"]["starts"] >= 8
    assert all(each["share"]["low"] <= each["share"]["share"] <= each["share"]["high"] for each in motions)
    assert "At 1 of 1 point the motion depends sensitively on the start" in ran.stderr
    assert "starts are computed and chaos is integrated further, for at most 0.2 s" in ran.stderr
    told = vibench_here(*asked, cwd=tmp_path)
    assert "Motions with sensitive dependence on the start" in told.stdout
    assert "%)" in told.stdout
    assert "┃" not in told.stdout, "one table with a frame, one without"


def test_an_invalid_budget_is_refused_with_a_readable_message(refusal):
    for given, said in (("soon", "--budget was given as 'soon'"), ("-1", "--budget was given as -1")):
        assert said in refusal("predict", *FORGETFUL, f"--budget={given}")


def test_a_target_error_is_reached_and_reported(output_of):
    asked = ("predict", "--amplitude", 20e-6, "--frequency", 130, "--error", "1 %", "--time", "20 s")
    (point,) = output_of(*asked, "--json")["points"]
    assert point["error_estimate"] < 1e-6
    assert point["target"]["is_met"]
    assert point["target"]["wanted_error"] == 0.01
    assert " % reached in " in output_of(*asked)


def test_start_dependence_has_the_same_label_in_the_table_and_in_json(output_of):
    asked = ("predict", "--amplitude", 5e-6, "--frequency", 260, "--error", "50 %")
    (point,) = output_of(*asked, "--json")["points"]
    (row,) = [each for each in output_of(*asked).splitlines() if "chaotic" in each]
    assert (point["memory"], row.split()[-1]) == ("lost", "lost")


@pytest.mark.parametrize(
    ("command", "text"),
    [
        ("map", "frequency_hz = {{ start = 260, stop = 262, points = 2 }}\namplitude_m = {0}\n"),
        ("study", "frequencies_hz = [260.0, 262.0]\namplitudes_m = [{0}]\n"),
    ],
)
def test_maps_and_studies_state_a_target_error_that_was_not_reached(output_of, tmp_path, command, text):
    plan = tmp_path / "plan.toml"
    plan.write_text(text.format(5e-6) + 'error = "0.001 %"\ntime_s = 0.2\n', "utf-8")
    printed = " ".join(output_of(command, plan, "--out", {"map": "a", "study": "a.h5"}[command]).split())
    assert "0 of 2 points reached an error of 0.001 %. The largest error is " in printed
    assert "; predict one point to see whether more time helps." in printed
    assert "e+" not in printed.split("The largest error is ")[1]


def test_a_chain_states_that_a_target_error_is_not_reachable(output_of):
    asked = ("chain", "--cells", 2, "--amplitude", 1e-6, "--frequency", 130, "--time", "0.5s")
    assert "; 1e-12 % is not reachable; impacts" in " ".join(output_of(*asked, "--error", 1e-14).split())
    (run,) = output_of(*asked, "--error", 1e-14, "--json")["runs"]
    assert run["target"]["is_reachable"] is False
    assert run["target"]["wanted_error"] == 1e-14


@pytest.mark.parametrize("command", [("predict",), ("chain", "--cells", 2)])
def test_a_target_error_far_below_rounding_is_reported_as_unreachable(output_of, command):
    asked = (*command, "--amplitude", 5e-6, "--frequency", 260, "--error", "1e-300")
    assert "1e-298 % is not reachable" in " ".join(output_of(*asked).split())


def test_every_point_of_a_curve_reaches_the_target_error(output_of):
    asked = ("predict", "--amplitude", 20e-6, "--frequency", "128:132:2", "--error", "0.01")
    assert "3 of 3 points reached an error of 1 %" in output_of(*asked)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--error", "1%", "--duration", 30), "--error was given with --duration"),
        (("--time", "2s", "--accuracy", "quick"), "--time was given with --accuracy"),
        (("--error", "1%", "--budget", "1s"), "--error was given with --budget"),
        (("--error", "200%"), "--error was given as '200%': it must be below 1"),
        (("--error", "1"), "it must be below 1; for 1 % give 1%"),
        (("--error", "0"), "--error was given as '0': it must be above 0"),
        (("--error", "small"), "'small' is not a number, alone or with %"),
        (("--time", "soon"), "'soon' is not a number, alone or with ms or s or min or h"),
        (("--error", "1%", "--observe", "response,lyapunov"), "A target is not allowed with lyapunov"),
    ],
)
def test_an_impossible_error_target_is_refused_with_a_readable_message(refusal, arguments, said):
    assert said in refusal("predict", "--amplitude", 1e-6, "--frequency", 100, *arguments, "--json")
