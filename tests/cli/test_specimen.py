"""A specimen file gives the same numbers in prediction, study, rig, recording and overlay."""

import json
import tomllib
from math import inf, isfinite

import numpy as np
import pytest

from vibench.acquisition import Verdict, open_bench, shipped
from vibench.acquisition.check.bench_report import bench_report
from vibench.acquisition.rig import load_rig
from vibench.analysis.recordings.facts import specimen_of
from vibench.sim import FixedDuration, Harmonic, Scene, load_specimen, shipped_specimens, solve_scene
from vibench.sim.study import Study, open_study

VIRTUAL_RIG = load_rig("virtual_rig")
DRIVE = Harmonic(130.0, 20e-6)
ASKED = ("--amplitude", 20e-6, "--frequency", 130.0, "--duration", 0.2, "--window", 0.1)
LAWS = ("hertz", "linear_gap:2e5", "rigid:0.8")


def random_specimen(folder, rng):
    """Write a random specimen, close enough to the paper's to be driven by the same base motion."""
    spread = 2.0 ** rng.uniform(-1.0, 1.0, (3, 3))
    masses, springs, dampings = spread * [[5.8e-3, 2.1e-3, 2e-3], [2.4e4, 829.0, 1.2e4], [0.47, 0.017, 0.24]]
    path = folder / "random.toml"
    path.write_text(
        f'name = "random"\nmasses_kg = {masses.tolist()}\nstiffnesses_n_per_m = {springs.tolist()}\n'
        f"dampings_ns_per_m = {dampings.tolist()}\ngap_m = {rng.uniform(1e-5, 6e-5, 2).tolist()}\n"
        f'contact = "{rng.choice(LAWS)}"\nhertz_stiffness = {rng.uniform(1e9, 9e9)}\n',
        encoding="utf-8",
    )
    return path


def require_agreement(vibench_here, folder, path):
    """Require that every command builds the same specimen from the file and gives the engine's result."""
    own = load_specimen(path).specimen()
    known = solve_scene(Scene(own, DRIVE, duration=FixedDuration(0.2, 0.1)))

    said = vibench_here("predict", *ASKED, "--specimen", path, "--json", cwd=folder)
    assert said.returncode == 0, said.stderr
    document = json.loads(said.stdout)
    point = document["points"][0]
    assert (point["response_i"], point["impacts"]) == (known.response_i, known.impacts)
    assert Study.model_validate(document["options"]).specimen.specimen() == own

    study = folder / "study.toml"
    study.write_text(
        f'specimen = "{path.name}"\nfrequencies_hz = [{DRIVE.frequency_hz}]\n'
        f"amplitudes_m = [{DRIVE.amplitude_m}]\nduration_s = 0.2\nwindow_s = 0.1\n"
    )
    answers = folder / "answers.h5"
    answers.unlink(missing_ok=True)
    assert vibench_here("study", study, "--out", answers, cwd=folder.parent).returncode == 0
    results = open_study(answers)
    assert next(iter(results.predictions())).response_i == known.response_i
    assert results.study.specimen.specimen() == own

    rig_text = shipped("hardware_configs/virtual_rig.toml").read_text(encoding="utf-8")
    changed = rig_text.replace(
        'model = "gong2025"\ndamping_time_s = 2e-5\ngap_m = 45e-6', f'model = "{path.name}"'
    )
    assert changed != rig_text
    (folder / "rig.toml").write_text(changed, encoding="utf-8")
    rig = load_rig(folder / "rig.toml")
    assert rig.specimen.specimen() == own
    recorded = json.loads(json.dumps(rig.model_dump(mode="json")))
    assert specimen_of(recorded) == own


@pytest.mark.thorough
@pytest.mark.timeout(300)
def test_all_commands_agree_on_the_numbers_of_random_specimens(vibench_here, tmp_path):
    rng = np.random.default_rng(1)
    for _ in range(2):
        require_agreement(vibench_here, tmp_path, random_specimen(tmp_path, rng))


def one_sided_specimen(folder):
    """Write the paper's specimen without the stop at positive p."""
    path = folder / "one_sided.toml"
    path.write_text('model = "gong2025"\nname = "one-sided"\ngap_m = [30e-6, inf]\n', encoding="utf-8")
    return path


@pytest.mark.timeout(300)
def test_all_commands_agree_on_a_specimen_with_one_stop(vibench_here, tmp_path):
    require_agreement(vibench_here, tmp_path, one_sided_specimen(tmp_path))


@pytest.mark.parametrize("command", [("specimen",), ("chain", "--cells", 1, "--specimen")])
def test_the_json_output_states_a_missing_stop_as_an_infinite_gap(output_of, tmp_path, command):
    document = output_of(*command, one_sided_specimen(tmp_path), "--json")
    described = document.get("options", {}).get("described", document)
    assert described["gap_m"] == [30e-6, "inf"]


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_fifty_random_specimens_pass_the_bench_check_on_the_virtual_rig(tmp_path):
    rng, refused = np.random.default_rng(3), []
    for number in range(50):
        path = random_specimen(tmp_path, rng)
        own = {
            **load_specimen(path).model_dump(),
            "amplitude_limit_m": VIRTUAL_RIG.specimen.amplitude_limit_m,
        }
        specimen = VIRTUAL_RIG.specimen.model_copy(update=own)
        with open_bench(VIRTUAL_RIG.model_copy(update={"specimen": specimen})) as bench:
            report = bench_report(bench, tmp_path)
        refused += [
            (number, each.name, each.value) for each in report.findings if each.verdict is Verdict.FAIL
        ]
    assert refused == []


def test_the_specimen_list_contains_every_specimen_and_contact_law(output_of):
    said = output_of("specimen", "--json")
    assert said["specimens"].keys() == shipped_specimens().keys()
    assert {"hertz", "linear", "rigid:0..1"} <= said["contact_laws"].keys()
    assert all(said["specimens"].values())
    assert all(said["contact_laws"].values())


@pytest.mark.parametrize("gap_m", [[30e-6, 60e-6], [30e-6, inf]])
def test_a_printed_specimen_is_a_valid_file(output_of, tmp_path, gap_m):
    given = "asymmetric" if isfinite(gap_m[1]) else one_sided_specimen(tmp_path)
    own = tmp_path / "own.toml"
    own.write_text(output_of("specimen", given, "--toml"), encoding="utf-8")
    assert [float(gap) for gap in tomllib.loads(own.read_text(encoding="utf-8"))["gap_m"]] == gap_m
    assert load_specimen(own).specimen() == load_specimen(given).specimen()


def test_the_specimen_command_prints_the_resonances_of_the_paper(output_of):
    said = output_of("specimen", "gong2025", "--json")
    assert said["resonances_without_contact_hz"] == pytest.approx([94.6, 266.2, 499.6], abs=0.05)
    assert said["resonances_with_m1_held_hz"] == pytest.approx([201.5, 436.0], abs=0.05)


@pytest.mark.parametrize("command", [("predict", *ASKED), ("specimen",)])
def test_an_unknown_specimen_is_reported_in_one_sentence(vibench_here, tmp_path, command):
    name, *rest = command
    options = ("--specimen", "nowhere.toml") if rest else ("nowhere.toml",)
    ended = vibench_here(name, *rest, *options, cwd=tmp_path)
    assert ended.returncode != 0
    assert ended.stderr.count("\n") == 1
    assert "nowhere.toml" in ended.stderr
    assert "gong2025" in ended.stderr


def test_the_force_of_the_nearer_stop_is_drawn_on_the_side_of_that_stop(output_of, tmp_path):
    output_of("specimen", "asymmetric", "--forces", "drawn")
    (table,) = (tmp_path / "drawn").glob("contact_forces_hertz*.csv")
    text = table.read_text(encoding="utf-8")
    p_m, pressed_n, let_go_n = np.genfromtxt(text.splitlines(), delimiter=",", names=True).view((float, 3)).T
    is_beyond = p_m < -30e-6
    assert is_beyond.any()
    assert np.all(p_m < 0.0)
    for force_n in (pressed_n, let_go_n):
        # Only the restoring force of m1 acts before the stop is reached.
        assert np.all(force_n[is_beyond] < 0.0)
        assert np.all(force_n[~is_beyond] == 0.0)
    assert "-0.0," not in text
    assert "-0," not in text


def test_a_gap_in_micrometres_typed_as_metres_gives_a_warning(vibench_here, tmp_path):
    (tmp_path / "wide.toml").write_text('name = "wide"\nmodel = "gong2025"\ngap_m = 30\n')
    said = vibench_here("specimen", "wide.toml", cwd=tmp_path).stderr
    assert "if 30 micrometres were meant, give 3e-05" in said


def test_the_forces_of_all_contact_laws_are_drawn(output_of, tmp_path):
    output_of("specimen", "--forces", "drawn")
    assert (tmp_path / "drawn" / "contact_forces.png").stat().st_size > 10_000


@pytest.mark.parametrize("name", shipped_specimens())
def test_every_shipped_specimen_is_reported(output_of, name):
    assert "contact law: " in output_of("specimen", name)


def test_a_specimen_is_printed_with_units_and_contact_law(output_of, tmp_path):
    said = output_of("specimen", "gong2025")
    assert "masses [kg]: 0.0058, 0.0021, 0.002" in said
    assert "stiffnesses [N/m]: 23741" in said
    assert "dampings [N s/m]:" in said
    assert "contact law: hertz, stiffness 4.89108e+09" in said
    nameless = random_specimen(tmp_path, np.random.default_rng(1))
    assert output_of("specimen", nameless).splitlines()[0] == "random"
