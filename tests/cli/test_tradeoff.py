"""`vibench tradeoff` for a user's case: error over time for every applicable method."""

import time

import pytest


def test_the_tradeoff_of_a_scene_lists_the_chosen_method_and_all_other_methods(output_of, tmp_path):
    asked = ("tradeoff", "--amplitude", 5e-6, "--frequency", 100, "--model", "power:7", "--error", "0.1 %")
    points = output_of(*asked, "--json", "--out", tmp_path / "new")["points"]
    (chosen,) = [each for each in points if each["is_chosen"]]
    assert chosen["error"] <= 1e-3
    by_method = {each["method"]: each for each in points}
    assert {"shooting", "first-order balance", "30 s, quick", "until settled, reference"} < by_method.keys()
    assert by_method["shooting"]["response_i"] == pytest.approx(chosen["response_i"], rel=1e-6)
    assert not by_method["first-order balance"]["is_stated"]
    assert 0.01 < by_method["first-order balance"]["error"] < 0.2
    assert (tmp_path / "new" / "tradeoff_scene.png").is_file()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--amplitude", 5e-6), "a scene needs both --amplitude and --frequency"),
        (("--frequency", 100), "a scene needs both --amplitude and --frequency"),
        (("--amplitude", -1, "--frequency", 100), "--amplitude was given as -1.0"),
        (("--amplitude", 5e-6, "--frequency", -1), "--frequency was given as -1.0"),
        (("--amplitude", 5e-6, "--frequency", 0), "--frequency was given as 0.0"),
        (("--amplitude", 5e-6, "--frequency", 100, "--time", "soon"), "--time was given as 'soon'"),
    ],
)
def test_an_impossible_scene_is_refused_with_a_readable_message(refusal, tmp_path, arguments, said):
    assert said in refusal("tradeoff", *arguments)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "scene",
    [(1e-4, 1000, "power:47", 0.0, 4.5e-5), (1e-9, 94.6, "linear", 1e-9, 1e-12)],
    ids=["chaos", "linear"],
)
def test_the_tradeoff_computation_of_a_scene_ends_within_the_requested_time(output_of, scene):
    amplitude_m, frequency_hz, law, damping_s, gap_m = scene
    options = ("--model", law, "--damping-time", damping_s, "--gap", gap_m, "--time", "0.4s", "--json")
    asked = ("tradeoff", "--amplitude", amplitude_m, "--frequency", frequency_hz, *options)
    output_of(*asked)  # loads modules
    began_s = time.thread_time()
    points = output_of(*asked)["points"]
    assert time.thread_time() - began_s < 1.5 * 0.4
    assert sum(each["is_chosen"] for each in points) == 1


@pytest.mark.thorough
def test_the_tradeoff_command_without_a_scene_measures_the_four_cases_of_the_paper(output_of, tmp_path):
    scenes = output_of("tradeoff", "--error", "10%", "--json", "--out", tmp_path / "new")["scenes"]
    assert [each["scene"] for each in scenes] == [f"hertz, 260 Hz, {um} µm" for um in (1, 5, 10, 50)]
    assert all(sum(point["is_chosen"] for point in each["points"]) == 1 for each in scenes)
    assert (tmp_path / "new" / "tradeoff.png").is_file()
