"""Names, paths, links and examples in documents and docstrings are correct."""

import ast
import importlib
import importlib.util
import re
import shlex
import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import typer

from benchmarks.sample_texts import comments, docstrings, product_sources
from vibench.acquisition import open_bench, run_measurement
from vibench.acquisition.instruments import PlugInKind
from vibench.acquisition.plan import Measurement, WhiteNoise
from vibench.analysis import analyse
from vibench.cli.__main__ import COMMANDS, app
from vibench.stop_files import SWITCH_OFF

ROOT = Path(__file__).resolve().parent.parent
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
FOLDERS = (
    "sim|acquisition|virtual_rig|analysis|gui|cli|"
    "tests|docs|examples|benchmarks|campaigns|studies|hardware_configs|extensions"
)

NAME = re.compile(r"(?<![\w./-])vibench(?:_fast_loop|_more_drivers)?(?:\.[A-Za-z_]\w*)+")
PATH = re.compile(rf"(?<![\w./-])(?:{FOLDERS})/[\w.*/-]*\w")
LINK = re.compile(r"\]\(([^)#:]+)(?:#[^)]*)?\)")
CODE = re.compile(r"^```python\n(.*?)^```", flags=re.DOTALL | re.MULTILINE)

PLAIN = {
    "anew": "again",
    "bears": "has",
    "begun": "started",
    "but for": "except",
    "held against": "compared with",
    "in the mean": "on average",
    "is told": "is reported",
    "are told": "are reported",
    "laid over": "overlaid",
    "lottery": "several attractors",
    "mended": "fixed",
    "minded": "checked",
    "so many": "this number of",
    "surely": "certainly",
    "there and back": "up and down",
    "whoever": "anyone who",
}
"""Words that are hard to read, and their plain replacements."""
WORN = re.compile(rf"\b(?:{'|'.join(PLAIN)})\b", flags=re.I)


def every_document(faults):
    """Turn a function that returns the faults of one document into a test of all documents."""

    def check():
        found = {path.relative_to(ROOT).as_posix(): faults(path) for path in DOCUMENTS}
        assert {name: wrong for name, wrong in found.items() if wrong} == {}

    return check


@cache
def text_of(document):
    return document.read_text(encoding="utf-8")


def resolves(dotted):
    """Return whether a dotted name is a module, an attribute of a module, or an entry point group."""
    name, *rest = dotted.split(".")
    if dotted in {each.value for each in PlugInKind} or importlib.util.find_spec(name) is None:
        return True
    module = None
    while rest:
        try:
            module = importlib.import_module(f"{name}.{rest[0]}")
        except ModuleNotFoundError:
            break
        name = f"{name}.{rest.pop(0)}"
    for attribute in rest:
        if not hasattr(module, attribute):
            return False
        module = getattr(module, attribute)
    return module is not None


@every_document
def test_every_dotted_name_in_a_document_resolves(document):
    return [name for name in sorted(set(NAME.findall(text_of(document)))) if not resolves(name)]


@every_document
def test_every_path_in_a_document_exists(document):
    named = sorted(set(PATH.findall(text_of(document))))
    return [path for path in named if not list(ROOT.glob(path))]


@every_document
def test_every_link_in_a_document_points_to_a_file(document):
    links = sorted(set(LINK.findall(text_of(document))))
    return [link for link in links if not (document.parent / link).exists()]


@every_document
def test_every_vibench_import_in_a_document_works(document):
    missing = []
    for code in CODE.findall(text_of(document)):
        for node in ast.walk(ast.parse(code)):
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("vibench"):
                missing += [
                    f"{node.module}.{each.name}"
                    for each in node.names
                    if not resolves(f"{node.module}.{each.name}")
                ]
    return missing


def test_the_page_named_in_the_message_on_a_drive_that_may_be_on_explains_this_message():
    (page,) = PATH.findall(SWITCH_OFF)
    assert SWITCH_OFF.split(":")[0] in text_of(ROOT / page)


BLOCK = re.compile(r"^```\n(.*?)^```", flags=re.DOTALL | re.MULTILINE)
COMMAND = re.compile(r"^(vibench [^#\n]*)", flags=re.MULTILINE)
TYPED = re.compile(r"^\$ (vibench .*)|`(vibench [^`]*)`", flags=re.MULTILINE)


def commands_of(document):
    """Return the words of every command in a document: in plain blocks, transcripts and running text."""
    text = text_of(document).replace("\\\n", " ")
    found = [each for block in BLOCK.findall(text) for each in COMMAND.findall(block)]
    found += [first or other for first, other in TYPED.findall(text)]
    return [shlex.split(each) for each in found]


def option_names(command):
    return {each for parameter in command.params for each in (*parameter.opts, *parameter.secondary_opts)}


@every_document
def test_every_command_in_a_document_exists_with_all_its_options(document):
    wrong = []
    for words in commands_of(document):
        known = option_names(typer.main.get_command(app)) | {"--help"}
        name = next((each for each in words if each in COMMANDS), None)
        if name is None and words[1][0].islower():
            wrong.append(words)
        if name is not None:
            command = typer.main.get_command(COMMANDS[name].load())
            known |= option_names(command)
            for each in getattr(command, "commands", {}).values():
                known |= option_names(each)
        asked = {each.split("=")[0].rstrip(".,") for each in words if each.startswith("--")}
        if not asked <= known:
            wrong.append(words)
    return wrong


@every_document
def test_commands_in_a_document_work_outside_a_checkout(document):
    """Shipped files are found by name everywhere, but by path in a checkout only."""
    paths = re.compile(r"(campaigns|hardware_configs|studies)/")
    wrong = [words for words in commands_of(document) if any(map(paths.match, words))]
    return [] if "decisions" in document.parts else wrong


def code_of_the_readme(saying):
    """Compile the only code example of the README that contains `saying`."""
    (code,) = (code for code in CODE.findall(text_of(ROOT / "README.md")) if saying in code)
    return compile(code, "README.md", "exec")


def test_the_simulation_in_the_readme_runs(capsys):
    exec(code_of_the_readme("steady_response"), {})
    assert capsys.readouterr().out


@pytest.mark.slow
def test_the_measurement_in_the_readme_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    exec(code_of_the_readme("run_campaign"), {})
    assert "Resonance" in capsys.readouterr().out


def ordered_subpackages():
    """Yield each package with its subpackages, highest first, in the order of pyproject.toml."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    for contract in contracts["contracts"]:
        for package in contract.get("containers", ()):
            layers = " | ".join(contract["layers"])
            yield pytest.param(package, layers.split(" | "), id=package)


@pytest.mark.parametrize(("package", "rooms"), list(ordered_subpackages()))
def test_the_architecture_page_lists_subpackages_in_order_with_their_docstrings(package, rooms):
    _, section = text_of(ROOT / "docs" / "architecture.md").split(f"### `{package}`\n")
    listed = re.findall(r"^\| `(\w+)` \| (.+) \|$", section.split("\n### ")[0].split("\n## ")[0], flags=re.M)
    said = [importlib.util.find_spec(f"{package}.{room}") for room in rooms]
    first_lines = [ast.get_docstring(ast.parse(Path(spec.origin).read_text("utf-8"))) for spec in said]
    assert listed == [(room, text.split("\n")[0]) for room, text in zip(rooms, first_lines, strict=True)]


def worn_words(text):
    """Return the words of `PLAIN` in a text, outside code."""
    prose = re.sub(r"`[^`]*`", "", re.sub(r"^```.*?^```", "", text, flags=re.S | re.M))
    return {word: PLAIN[word] for word in map(str.lower, WORN.findall(prose))}


@every_document
def test_documents_contain_only_plain_words(document):
    return worn_words(text_of(document))


@pytest.mark.thorough
@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="this is a copy, not a checkout")
@pytest.mark.parametrize("read", [docstrings, comments])
def test_docstrings_and_comments_use_plain_words(read):
    texts = [text for path in product_sources() for text in read(path)]
    found = {place: words for place, text in texts if (words := worn_words(text))}
    assert len(texts) > 500
    assert found == {}, f"write instead: {found}"


def test_the_readme_has_at_most_120_lines():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 120


def test_the_changelog_of_the_version_has_a_date_and_takes_at_most_three_minutes_to_read():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    section = re.search(
        rf"^## {re.escape(version)} - \d{{4}}-\d\d-\d\d\n(.*?)^## ", changes, re.DOTALL | re.MULTILINE
    )
    assert section is not None
    assert len(section[1].split()) <= 3 * 200


def test_the_readme_links_to_tasks_and_verdicts_and_units_and_a_glossary_that_defines_undecided():
    linked = LINK.findall((ROOT / "README.md").read_text(encoding="utf-8"))
    assert {"docs/tasks.md", "docs/verdicts.md", "docs/sensor-units.md", "docs/glossary.md"} <= {*linked}
    assert "| undecided |" in (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")


def test_pyproject_states_systems_and_status_and_no_version_limit_expires_within_a_year():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert [each for each in project["classifiers"] if each.startswith("Operating System ::")]
    assert [each for each in project["classifiers"] if each.startswith("Development Status ::")]
    wanted = [
        *project["dependencies"],
        *(each for group in project["optional-dependencies"].values() for each in group),
    ]
    years = [int(year) for each in wanted for year in re.findall(r"<(20\d\d)\b", each)]
    assert min(years, default=2100) > 2027


@pytest.mark.thorough
def test_the_analysis_gives_the_same_transmissibility_as_a_calculation_by_hand(tmp_path, monkeypatch):
    path = tmp_path / "noise_recordings" / "weak.h5"
    path.parent.mkdir()
    band = {"band_start_hz": 50, "band_stop_hz": 600, "repetition_hz": 1}
    noise = WhiteNoise(amplitude_vpp=0.05, realisations=2, periods=2, settle_s=3, **band)
    with open_bench("virtual_rig") as bench:
        run_measurement(bench, Measurement(name="weak", excitation=noise), path)
    monkeypatch.chdir(tmp_path)
    (code,) = CODE.findall((ROOT / "docs" / "by-hand.md").read_text(encoding="utf-8"))
    names = {}
    exec(code, names)
    found = analyse(path).response.frequency_response
    places = np.searchsorted(found.frequency_hz, names["LINES_HZ"] - 0.5)
    by_hand = np.abs(names["transmissibility"](names["error"]))
    np.testing.assert_allclose(by_hand, found.magnitude[places], rtol=2e-3)
