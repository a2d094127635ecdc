"""`vibench bench new`: the configuration and the page that it writes, and refusals."""

import re
import shlex
import signal
from importlib.metadata import EntryPoints
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from tests.full_disk import full_disk
from vibench.acquisition import CheckStopped, StopSwitch, stop_on_signal
from vibench.acquisition.bench import InstrumentList
from vibench.acquisition.errors import ConfigurationError
from vibench.acquisition.first_day import QUESTIONS, configure, value_in, with_answer
from vibench.acquisition.instruments import FoundDevice, _guarded
from vibench.acquisition.rig import confirm_at_terminal, load_rig
from vibench.cli.__main__ import app
from vibench.cli.bench import _configure, _confirm_wire, _operator_at_terminal
from vibench.sim import UnreadableTomlError

ROOT = Path(__file__).resolve().parents[2]
LAB, VIRTUAL = (ROOT / "hardware_configs" / f"{name}.toml" for name in ("lab_rig", "virtual_rig"))
ANSWERS = """
operator = "A. Student"
wired = "by eye"
name = "bench by the window"
[amplifier]
serial = "12"
current_limit_a = 1.8
"""


def found_instruments(*resources, device="cDAQ9Mod2", product="NI 9234"):
    inputs = tuple(f"{device}/ai{number}" for number in range(4))
    return InstrumentList(resources, (FoundDevice(device, product, "1", inputs, ()),), ())


def begin_configuration(folder, name="mine.toml", template=VIRTUAL, answers=ANSWERS):
    """Begin a configuration in a folder, with these answers or an existing file of answers."""
    path = folder / "answers.toml"
    if answers is not None:
        path.write_text(answers)
    words = ["bench", "new", folder / name, "--from", template, "--answers", path]
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.mark.thorough
def test_a_bench_configuration_is_created_checked_and_documented(tmp_path, monkeypatch):
    done = begin_configuration(tmp_path)
    assert done.exit_code == 0, done.output
    rig = load_rig(tmp_path / "mine.toml")
    assert (rig.name, rig.amplifier.serial) == ("bench by the window", "12")
    assert rig.amplifier.current_limit_a.value == 1.8
    assert "A. Student" in rig.amplifier.current_limit_a.source
    page = (tmp_path / "mine.first_day.md").read_text()
    for part in ("TEKTRONIX,AFG1022", "a first sine of 5 mVpp: ok", "per cent of the amplitude limit: ok"):
        assert part in page
    assert page.count(": by eye") == len(rig.daq.channels)
    (told,) = re.findall("^    vibench (.*)", page, re.MULTILINE)
    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(app, [*shlex.split(told), "--estimate"]).exit_code == 0
    again = begin_configuration(tmp_path)
    assert again.exit_code == 1
    assert "exists already" in str(again.exception)


@pytest.mark.thorough
def test_unconfirmed_wiring_ends_the_procedure_before_output(tmp_path):
    done = begin_configuration(tmp_path, answers='operator = "A. Student"')
    assert done.exit_code == 1
    assert "Nothing was played" in str(done.exception)
    assert not list(tmp_path.glob("*.md"))
    assert f"--from {tmp_path / 'mine.toml'}" in str(done.exception)
    again = begin_configuration(tmp_path, "again.toml", tmp_path / "mine.toml")
    assert again.exit_code == 0, again.output


@pytest.mark.thorough
@pytest.mark.parametrize("wired", ["false", '" No "', '""'])
def test_a_missing_wire_ends_the_procedure(tmp_path, wired):
    done = begin_configuration(tmp_path, answers=f"wired = {wired}")
    assert done.exit_code == 1
    assert "Nothing was played" in str(done.exception)


def test_a_draft_file_beside_the_new_configuration_is_kept(tmp_path):
    (tmp_path / "lab.toml.draft").write_text("mine")
    configure(LAB, tmp_path / "lab.toml", found_instruments(), lambda *_: "", "note")
    assert (tmp_path / "lab.toml.draft").read_text() == "mine"


@pytest.mark.parametrize(("answer", "gain_db"), [(".5", 0.5), ("010", 10.0), ("1e1", 10.0), ("-3", -3.0)])
def test_common_number_formats_are_accepted(tmp_path, answer, gain_db):
    rig, wrong = answer_repeatedly(tmp_path, {"amplifier.gain_db": [answer]})
    assert (rig.amplifier.gain_db, wrong) == (gain_db, [])


SENSITIVITY = "accelerometer.sensitivity_v_per_m_per_s2"


def test_a_sensitivity_is_accepted_in_the_unit_of_its_certificate(tmp_path):
    rig, wrong = answer_repeatedly(tmp_path, {SENSITIVITY: ["10 pC/g", "10 mV/m/s2", "much", "100 mV/g"]})
    assert rig.accelerometer.sensitivity_v_per_m_per_s2 == pytest.approx(0.1 / 9.80665)
    for part, told in zip(("charge", "two ways", "not a number"), wrong, strict=True):
        assert part in told


def test_a_number_without_a_unit_replaces_a_sensitivity_with_a_unit(tmp_path):
    text = with_answer(LAB.read_text(encoding="utf-8"), SENSITIVITY, "100 mV/g", "note")
    assert value_in(text, SENSITIVITY) == '"100 mV/g"'
    assert value_in(with_answer(text, SENSITIVITY, "0.0102", "note"), SENSITIVITY) == "0.0102"


@pytest.mark.parametrize("name", ["B\udce9nch", "a\x7fb", "two\nlines"])
def test_a_question_is_repeated_after_input_that_cannot_be_decoded(tmp_path, name):
    rig, wrong = answer_repeatedly(tmp_path, {"name": [name, "Bénch"]})
    assert rig.name == "Bénch"
    assert "is not printable" in wrong[0]


@pytest.mark.thorough
@pytest.mark.parametrize("content", [None, b"\xff\xfe", b"operator = ", b"nonsense.key = 3"])
def test_an_answers_file_that_cannot_be_used_gives_a_one_sentence_error(tmp_path, content):
    if content is not None:
        (tmp_path / "answers.toml").write_bytes(content)
    done = begin_configuration(tmp_path, answers=None)
    assert isinstance(done.exception, (ConfigurationError, UnreadableTomlError))
    assert not list(tmp_path.glob("mine*"))


def test_ctrl_c_at_a_wiring_question_ends_the_procedure(monkeypatch):
    """The signal handler of a check would only request a stop, while the question would go on waiting."""
    monkeypatch.setattr("typer.confirm", lambda _: signal.raise_signal(signal.SIGINT))
    switch = StopSwitch()
    with stop_on_signal(switch), pytest.raises(CheckStopped, match=r'signal was played.*--bench "my own'):
        _confirm_wire(Path("my own.toml"), "the T-piece")
    assert switch.request is None


def test_ctrl_c_at_a_question_ends_the_procedure_and_nothing_is_written(tmp_path, monkeypatch):
    def abort(*_given, **_named):
        raise typer.Abort

    monkeypatch.setattr("typer.prompt", abort)
    with pytest.raises(CheckStopped, match="nothing was written"):
        _configure(LAB, tmp_path / "lab.toml", found_instruments(), "note")
    with pytest.raises(CheckStopped, match="nothing was written"):
        _operator_at_terminal()
    assert not list(tmp_path.iterdir())


def test_ctrl_c_at_a_question_about_a_knob_ends_the_procedure_before_output(monkeypatch):
    def abort(_question):
        raise KeyboardInterrupt

    monkeypatch.setattr("sys.stdin.isatty", lambda: True)
    monkeypatch.setattr("builtins.input", abort)
    with pytest.raises(CheckStopped, match="nothing was energised"):
        confirm_at_terminal(())


def test_a_configuration_that_cannot_be_written_completely_is_removed(tmp_path):
    """The disk is full. If the file were kept, a second attempt would find its name in use."""
    with full_disk(), pytest.raises(ConfigurationError, match="File too large"):
        configure(LAB, tmp_path / "lab.toml", found_instruments(), lambda *_: "", "note")
    assert not list(tmp_path.iterdir())


@pytest.mark.thorough
def test_a_target_that_is_not_a_folder_is_reported_before_any_question(tmp_path):
    done = begin_configuration(tmp_path, "no/mine.toml")
    assert isinstance(done.exception, ConfigurationError)
    assert "is not a folder" in str(done.exception)


@pytest.mark.thorough
def test_a_wrong_gain_is_found_with_an_output_of_5_mv_and_no_larger_output(tmp_path):
    (tmp_path / "faults.toml").write_text(
        '[[faults]]\nat_s = 0.0\nfault = "turn_amplifier_gain"\ngain_db = 16\n'
    )
    scripted = VIRTUAL.read_text() + f"faults = '{tmp_path / 'faults.toml'}'\n"
    (tmp_path / "template.toml").write_text(scripted)
    done = begin_configuration(tmp_path, template=tmp_path / "template.toml")
    page = (tmp_path / "mine.first_day.md").read_text()
    assert done.exit_code == 1
    assert "set the gain of the Bruel & Kjaer 2706 to 10 dB" in page
    assert "The bench check was not run" in page
    assert "two per cent" not in page


def test_the_only_instrument_that_was_found_is_the_default_answer(tmp_path):
    pytest.importorskip("vibench_more_drivers", reason="pip install -e extensions/more_drivers brings it")
    only = found_instruments("USB0::2391::11271::MY5::0::INSTR")
    rig = configure(LAB, tmp_path / "lab.toml", only, lambda *_: "", "note")
    assert rig.generator.resource == "USB0::2391::11271::MY5::0::INSTR"
    assert rig.generator.driver == "keysight33500b"
    assert (rig.daq.device, rig.daq.product) == ("cDAQ9Mod2", "NI 9234")
    text = (tmp_path / "lab.toml").read_text()
    assert "# CONFIRM: input of the 2706" in text, "comments on what was not asked stay"


def test_an_unusual_usb_name_keeps_the_driver_of_the_template(tmp_path):
    only = found_instruments("USB0::0699::0353::MY5::0::INSTR")
    rig = configure(LAB, tmp_path / "lab.toml", only, lambda *_: "", "note")
    assert (rig.generator.resource, rig.generator.driver) == ("USB0::0699::0353::MY5::0::INSTR", "afg1022x")


@pytest.mark.parametrize(
    ("key", "answer", "said"),
    [
        ("amplifier.gain_db", "ten", r"amplifier\.gain_db: 'ten' is not a number"),
        ("generator.settle_s", "-5", r"generator\.settle_s"),
    ],
)
def test_an_impossible_value_of_a_bench_is_refused_and_nothing_is_written(tmp_path, key, answer, said):
    def ask(question, choices, held):
        return answer if question.key == key else ""

    with pytest.raises(ConfigurationError, match=said):
        configure(LAB, tmp_path / "lab.toml", found_instruments(), ask, "note")
    assert not list(tmp_path.iterdir())


def answer_repeatedly(tmp_path, given):
    """Answer each question from its list, then with the default; return the rig and the errors."""
    wrong = []
    rig = configure(
        LAB,
        tmp_path / "lab.toml",
        found_instruments(),
        lambda question, _choices, _held: given[question.key].pop(0) if given.get(question.key) else "",
        "note",
        refuse=lambda error: wrong.append(str(error)),
    )
    return rig, wrong


def test_a_question_is_repeated_immediately_after_a_wrong_answer(tmp_path):
    rig, wrong = answer_repeatedly(
        tmp_path, {"amplifier.gain_db": ["ten", "700", "1e300", "12"], "generator.settle_s": ["-1", "0.2"]}
    )
    assert (rig.amplifier.gain_db, rig.generator.settle_s) == (12.0, 0.2)
    assert len(wrong) == 4
    for words in ("'ten' is not a number", "gain_db = 700", "gain_db = 1", "settle_s = -1"):
        assert any(words in each for each in wrong)
    assert load_rig(tmp_path / "lab.toml") == rig


def test_only_questions_with_contradictory_answers_are_repeated(tmp_path):
    place = "daq.channels.{}.physical".format
    rig, wrong = answer_repeatedly(
        tmp_path,
        {place("m0_velocity"): ["ai1", "ai3"], place("amplifier_voltage"): ["ai1"], "name": ["my bench"]},
    )
    assert rig.name == "my bench"
    assert {each.role: each.physical for each in rig.daq.channels}["m0_velocity"] == "ai3"
    assert len(wrong) == 1
    assert ".draft" not in wrong[0]


def test_a_generator_whose_driver_is_in_a_missing_package_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(_guarded, "entry_points", EntryPoints)
    monkeypatch.syspath_prepend(tmp_path)
    only = found_instruments("USB0::2391::11271::MY5::0::INSTR")
    said = r"MY5::0::INSTR': .*'0x0957' needs vibench-more-drivers, which is not installed: run 'pip install"
    with pytest.raises(ConfigurationError, match=said):
        configure(LAB, tmp_path / "lab.toml", only, lambda *_: "", "note")
    assert not list(tmp_path.iterdir())


def test_a_broken_third_party_package_does_not_end_the_procedure(tmp_path, monkeypatch):
    pytest.importorskip("vibench_more_drivers", reason="pip install -e extensions/more_drivers brings it")
    metadata = tmp_path / "somebody-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: somebody\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text("[vibench.generators]\nbroken = no_such_module:Driver\n")
    monkeypatch.syspath_prepend(tmp_path)
    only = found_instruments("USB0::2391::11271::MY5::0::INSTR")
    rig = configure(LAB, tmp_path / "lab.toml", only, lambda *_: "", "note")
    assert rig.generator.driver == "keysight33500b"


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda each: each.key)
@pytest.mark.parametrize("template", [LAB, VIRTUAL], ids=["lab", "virtual"])
def test_every_question_sets_one_key_of_the_template(template, question):
    text = template.read_text()
    held = value_in(text, question.key)
    answer = {"{": "1.25", '"': "word"}.get(held[:1], "2026-03-04" if held.count("-") == 2 else "0.125")
    changed = with_answer(text, question.key, answer, "note")
    assert answer in value_in(changed, question.key)
    same = [line for line in changed.splitlines() if line in text.splitlines()]
    assert len(same) >= len(text.splitlines()) - 1
