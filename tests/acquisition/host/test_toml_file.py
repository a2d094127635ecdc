"""Errors in a TOML file name the keys of the file."""

import re
from typing import Annotated

import pytest
from pydantic import AwareDatetime, Field, PositiveFloat

from vibench.acquisition import load_campaign
from vibench.acquisition.errors import ConfigurationError
from vibench.acquisition.host.toml_file import FrozenModel, load_toml


def refusal(load, path, text, *kind):
    """Return the error message of loading a file with this text."""
    path.write_text(text)
    with pytest.raises(ConfigurationError) as refused:
        load(path, *kind)
    return str(refused.value)


class Steps(FrozenModel):
    start: PositiveFloat
    step: PositiveFloat


class Plan(FrozenModel):
    values: tuple[PositiveFloat, ...] | Steps


@pytest.mark.parametrize("key", ["Float", "Range", "float", "Masses", "str", "dict[str,Any]"])
def test_an_unknown_key_named_like_a_type_is_reported_by_its_own_name(tmp_path, key):
    for text, told in (
        (f'values = [1.0]\n"{key}" = 1\n', f"{key} is not a known key"),
        (f'[values]\nstart = 1.0\nstep = 1.0\n"{key}" = 1\n', f"values.{key} is not a known key"),
    ):
        said = refusal(load_toml, tmp_path / "plan.toml", text, Plan)
        assert told in said
        assert said.count("known key") == 1


@pytest.mark.parametrize(
    ("excitation", "told"),
    [
        ('{ kind = "dwel" }', "'kind' = 'dwel' is not known; allowed are 'white_noise', "),
        ("{ amplitude_vpp = 1.0 }", "'kind' is missing"),
        ("3", "give a table"),
    ],
)
def test_an_unknown_kind_of_excitation_is_refused_with_the_known_kinds(tmp_path, excitation, told):
    text = f'name = "c"\n[[measurements]]\nname = "m"\nexcitation = {excitation}\n'
    said = refusal(load_campaign, tmp_path / "campaign.toml", text)
    assert f": {told}" in said
    assert "tag" not in said


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[values]\nstart = 1.0\n", "values.step is missing"),
        ("values = [1.0, -2.0]\n", "values.1 = -2.0: input should be greater than 0"),
        ("values = { start = 1.0, step = -1.0 }\n", "values.step = -1.0: input should be greater than 0"),
        ("", "values is missing"),
        ("values = 3\n", "values = 3: give a list, in square brackets"),
        ("values = [1.0, true]\n", "values.1 = true: give a number"),
        ("values = { start = 1.0, step = true }\n", "values.step = true: give a number"),
        ('values = [1.0, "fast"]\n', "values.1 = 'fast': give a number"),
    ],
)
def test_errors_name_the_key_of_the_variant_that_the_file_uses(tmp_path, text, told):
    file = tmp_path / "plan.toml"
    said = refusal(load_toml, file, text, Plan)
    assert said.startswith(f"{file}: {told}")
    assert ";" not in said


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("name", '"my campaign"'), "name = 'my campaign': a file name has 1 to 64 letters, digits"),
        (("name", '""'), "name = '': a file name has"),
        (("name", '"mine."'), "name = 'mine.': a file name has"),
        (("name", '"mine "'), "name = 'mine ': a file name has"),
        (("name", "3"), "name = 3: give text, in quotes"),
        (("rest_s", "2026-01-01"), "rest_s = 2026-01-01: "),
    ],
)
def test_common_beginner_mistakes_in_a_campaign_are_refused_in_toml_terms(tmp_path, change, told):
    given = {"name": '"mine"', change[0]: change[1]}
    text = "\n".join(f"{key} = {value}" for key, value in given.items())
    said = refusal(load_campaign, tmp_path / "campaign.toml", text)
    assert told in said
    assert "pattern" not in said


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("few = []\n", "few = []: give 1 or more entries, not 0"),
        ("few = [1.0, 2.0, 3.0]\n", "few = [1.0, 2.0, 3.0]: give 2 entries or fewer, not 3"),
        ("pair = [1.0, 2.0, 3.0]\n", "pair = [1.0, 2.0, 3.0]: give 2 entries, not 3"),
        ("pair = [1.0]\n", "pair = [1.0]: give 2 entries, not 1"),
        ('label = ""\n', "label = '': give text of 1 or more letters"),
        ('label = "abcd"\n', "label = 'abcd': give 3 letters or fewer"),
        ("number = 2.5\n", "number = 2.5: give a whole number"),
        ("began = 2026-01-01\n", "began = 2026-01-01: give a date, time and time zone, such as 2026-"),
        ("began = 2026-01-01T00:00:00\n", "began = 2026-01-01T00:00:00: give a date, time and time zone"),
        ('began = "yesterday"\n', "began = 'yesterday': give a date, time and time zone"),
        ("began = 1\n", "began = 1: give a date, time and time zone"),
        ('began = "-1.5"\n', "began = '-1.5': give a date, time and time zone"),
    ],
)
def test_errors_describe_wrong_values_without_python_terms(tmp_path, text, told):
    class Words(FrozenModel):
        few: Annotated[tuple[float, ...], Field(min_length=1, max_length=2)] = (1.0,)
        pair: tuple[float, float] = (1.0, 2.0)
        label: Annotated[str, Field(min_length=1, max_length=3)] = "a"
        number: int = 1
        began: AwareDatetime | None = None

    file = tmp_path / "words.toml"
    assert refusal(load_toml, file, text, Words).startswith(f"{file}: {told}")


@pytest.mark.parametrize(
    ("content", "said"), [(b"\x89HDF\r\n\x1a\n\0", "is an HDF5 file"), (b"\xff\xfe\0", "is not UTF-8 text")]
)
def test_a_binary_file_is_refused_without_advice_to_save_it_as_text(tmp_path, content, said):
    path = tmp_path / "c.h5"
    path.write_bytes(content)
    with pytest.raises(ConfigurationError, match=f"{said}; give a TOML file, saved as UTF-8"):
        load_campaign(path)


DWELL = 'excitation = { kind = "dwell", amplitude_vpp = 1.0, frequency_hz = 260, duration_s = 1 }'


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (
            ("frequency_hz", "frequencyhz"),
            r"\.frequencyhz is not a known key \(did you mean frequency_hz\?\)",
        ),
        (("duration_s", "duration_ms"), r"\.duration_ms is not a known key \(did you mean duration_s\?\)"),
        (
            ("[[measurements]]", "[[measurement]]"),
            r"measurement is not a known key \(did you mean measurements\?",
        ),
        (("excitation", "exitation"), r"measurements\.0\.exitation .*\(did you mean excitation\?\)"),
        (('"m"', '"m"\ncolour = 1'), "colour is not a known key: check its spelling"),
    ],
)
def test_the_error_for_an_unknown_key_names_a_known_key_only_if_both_are_similar(tmp_path, change, told):
    text = f'name = "c"\n[[measurements]]\nname = "m"\n{DWELL}\n'
    said = refusal(load_campaign, tmp_path / "campaign.toml", text.replace(*change))
    assert re.search(told, said)
    assert "missing" not in said
