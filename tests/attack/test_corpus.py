"""Files found by attacks: each is refused in one sentence, quickly and without leftovers.

Files of `corpus/campaign` and `corpus/study` are read as TOML, files of `corpus/imports` by `vibench import`.
A file found by an attack is reduced and stored there, with a name that states its fault.
"""

from pathlib import Path

import pytest

from . import imported_files, toml_files
from .command_runner import CommandRunner
from .limits import Case

CORPUS = Path(__file__).with_name("corpus")


def files_in(folder: str) -> list[Path]:
    return sorted((CORPUS / folder).iterdir())


@pytest.fixture(scope="module")
def runner():
    with CommandRunner() as one:
        yield one


@pytest.mark.thorough
@pytest.mark.parametrize("path", [*files_in("campaign"), *files_in("study")], ids=lambda path: path.stem)
def test_a_broken_toml_file_is_refused_with_its_name_in_the_error(runner, path):
    ending = runner.run(toml_files.reading(path.parent.name, path.read_bytes()))
    assert (ending.code, ending.faults, ending.made) == (1, (), ())
    assert ending.err.startswith("error: broken.toml: ")


@pytest.mark.thorough
@pytest.mark.parametrize("path", files_in("imports"), ids=lambda path: path.stem)
def test_a_broken_imported_file_is_refused_with_its_name_in_the_error(runner, path):
    case = imported_files.reading(path.suffix, path.read_bytes(), *imported_files.MAKING)
    ending = runner.run(case)
    assert (ending.code, imported_files.faults(case, ending)) == (1, ())
    assert ending.err.startswith((f"error: broken{path.suffix} ", f"error: broken{path.suffix}: "))
    assert ("largest number" in ending.err) == (path.stem == "largest_number_of_all")


@pytest.mark.thorough
@pytest.mark.parametrize("suffix", imported_files.WRITERS)
def test_the_valid_files_from_which_mutants_are_made_can_be_imported(runner, suffix):
    ending = runner.run(
        imported_files.reading(suffix, imported_files.good_files()[suffix], *imported_files.MAKING)
    )
    assert (ending.code, ending.err) == (0, "")


LONG = "x" * 300


@pytest.mark.thorough
@pytest.mark.parametrize(
    "arguments",
    [
        ("analyse", LONG),
        ("export", f"{LONG}.h5", "--to", "csv"),
        ("import", f"{LONG}.csv"),
        ("measure", "good.toml", "--out", LONG, "--estimate"),
        ("catalogue", LONG),
        ("recover", f"{LONG}.h5.part"),
        ("figure", "2", "--out", LONG),
    ],
    ids=lambda arguments: arguments[0],
)
def test_an_impossible_file_name_gives_a_one_sentence_error(runner, arguments):
    ending = runner.run(Case(arguments, toml_files.GOOD))
    assert (ending.code, ending.faults) == (1, ())
    assert "is too long" in ending.err
