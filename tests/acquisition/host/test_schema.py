"""JSON Schemas of the TOML files accept every file that loads, and find errors."""

import json
import shutil
import subprocess
import sys
import tomllib
from importlib.resources import files
from pathlib import Path

import pytest

from vibench.acquisition import (
    ConfigurationError,
    all_shipped,
    json_schema,
    load_campaign,
    load_toml,
    save_toml,
    shipped_folder,
)
from vibench.acquisition.plan import Campaign
from vibench.acquisition.rig import Rig
from vibench.analysis.exchange import ImportMapping
from vibench.sim import SpecimenDescription, SpecimenTable, load_specimen, shipped_specimens
from vibench.sim.maps import Map
from vibench.sim.study import Study

jsonschema = pytest.importorskip("jsonschema", reason="pip install vibench[test] brings jsonschema")

MODELS = {
    "campaign": Campaign,
    "rig": Rig,
    "study": Study,
    "map": Map,
    "mapping": ImportMapping,
    "specimen": SpecimenDescription,
}
FOLDERS = {"campaign": "campaigns", "rig": "hardware_configs", "study": "studies", "map": "studies/maps"}
MAPPING = """
specimen = "gong2025"
origin = "real"
started_utc = 2026-01-01T00:00:00Z
[measurement]
name = "dwell"
excitation = { kind = "dwell", amplitude_vpp = 1, frequency_hz = 260, settle_s = 1, duration_s = 2 }
[[channels]]
source = "1"
role = "base_acceleration"
[[channels]]
source = "2"
role = "m0_velocity"
scale = 0.125
"""


def as_json(text):
    """Convert TOML to JSON data as an editor does for a schema: dates are strings."""
    return json.loads(json.dumps(tomllib.loads(text), default=str))


def schema_errors(kind, text):
    return list(jsonschema.Draft4Validator(json_schema(kind)).iter_errors(as_json(text)))


@pytest.mark.parametrize("kind", MODELS)
def test_a_schema_uses_draft_4_and_equals_the_shipped_file(kind):
    pytest.importorskip(
        "vibench_fast_loop", reason="pip install -e extensions/fast_loop brings a kind of plan"
    )
    schema = json_schema(kind)
    jsonschema.Draft4Validator.check_schema(schema)
    newer = {"$defs", "const", "prefixItems", "if", "contains", "propertyNames", "discriminator"}
    assert newer.isdisjoint(keys(schema))
    written = shipped_folder("schemas") / f"{kind}-1.schema.json"
    # vibench schema KIND > schemas/KIND-1.schema.json
    assert json.loads(written.read_text(encoding="utf-8")) == schema


def keys(part):
    """Return all keywords of a schema, without names of properties and definitions."""
    match part:
        case list():
            return {key for each in part for key in keys(each)}
        case dict():
            named = part.keys() & {"properties", "definitions"}
            inner = [each for key in named for each in part[key].values()]
            inner += [each for key, each in part.items() if key not in named]
            return set(part) | {key for each in inner for key in keys(each)}
        case _:
            return set()


@pytest.mark.parametrize("kind", FOLDERS)
def test_every_shipped_file_names_its_schema_and_is_valid_under_it(kind):
    if kind == "campaign":
        pytest.importorskip("vibench_fast_loop", reason="pip install -e extensions/fast_loop brings a kind")
    for path in all_shipped(FOLDERS[kind]):
        text = path.read_text(encoding="utf-8")
        up = "../" * (1 + FOLDERS[kind].count("/"))
        assert text.startswith(f"#:schema {up}schemas/{kind}-1.schema.json\n"), path
        assert (path.parent / text.split()[1]).is_file()
        assert schema_errors(kind, text) == [], path


@pytest.mark.parametrize("package", ["controller_package", "instrument_package"])
def test_the_bench_of_an_example_names_its_schema_and_is_valid_under_it(package):
    path = shipped_folder("examples") / package / "bench.toml"
    text = path.read_text(encoding="utf-8")
    assert text.startswith("#:schema ")
    assert (path.parent / text.split()[1]).resolve() == shipped_folder("schemas") / "rig-1.schema.json"
    assert schema_errors("rig", text) == []


@pytest.mark.parametrize("name", shipped_specimens())
def test_every_shipped_specimen_names_its_schema_and_is_valid_under_it(name):
    path = Path(str(files("vibench.sim") / "specimens" / f"{name}.toml"))
    text = path.read_text(encoding="utf-8")
    assert text.startswith("#:schema ../../../../schemas/specimen-1.schema.json\n")
    assert (path.parent / text.split()[1]).is_file()
    assert schema_errors("specimen", text) == []


def test_a_specimen_may_state_its_format_version(tmp_path):
    path = tmp_path / "mine.toml"
    text = 'format_version = 1\nmodel = "gong2025"\nname = "mine"\n'
    path.write_text(text, encoding="utf-8")
    assert load_specimen(path).name == "mine"
    assert schema_errors("specimen", text) == []
    for wrong in ("2", "true", '"1"', "0"):
        path.write_text(text.replace("= 1", f"= {wrong}"), encoding="utf-8")
        with pytest.raises(ValueError, match="is not version 1, which this vibench reads") as refused:
            load_specimen(path)
        assert "\n" not in str(refused.value)
        assert schema_errors("specimen", path.read_text(encoding="utf-8")) != []


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        ("mapping", MAPPING),
        ("study", "amplitudes_m = [1e-6]\nfrequencies_hz = [10, {start = 20, stop = 30, step = 5}]"),
        ("study", 'structure = "heavy"\namplitudes_m = [1e-6]\nfrequencies_hz = {start=9,stop=30,step=5}'),
        (
            "campaign",
            (
                'name = "x"\n[defaults]\nramp_s = 0.2\n[defaults.dwell]\namplitude_vpp = 1\nduration_s = 2\n'
                '[[measurements]]\nname = "d"\nexcitation = {kind = "dwell", frequency_hz = 260, settle_s=1}'
            ),
        ),
        (
            "campaign",
            (
                'name = "x"\n[[sweeps]]\nname = "s"\nfrequency_hz = [200, 210]\namplitude_vpp = [1.0]\n'
                'measurement = {excitation = {kind = "dwell", settle_s = 1, duration_s = 2}}'
            ),
        ),
    ],
)
def test_every_file_that_can_be_loaded_is_valid_under_the_schema(kind, text, tmp_path):
    path = tmp_path / "file.toml"
    path.write_text(text, encoding="utf-8")
    load_toml(path, MODELS[kind])
    assert schema_errors(kind, text) == []


@pytest.mark.parametrize(
    ("kind", "old", "new"),
    [
        ("campaign", "ramp_s = 0.3", "ramp = 0.3"),
        ("campaign", "realisations = 2", 'realisations = "two"'),
        ("campaign", 'kind = "dwell"', 'kind = "dwel"'),
        ("campaign", "attempts = 2", "attempts = 0"),
        ("rig", "amplitude_limit_vpp = 10.0", "amplitude_limit = 10.0"),
        ("rig", "connected_ohm = 15000", "connected_ohm = -15000"),
        ("study", 'accuracy = "standard"', 'accuracy = "better"'),
        ("study", "step = 1", "steps = 1"),
        ("study", 'accuracy = "standard"', "error = 0"),
        ("study", 'accuracy = "standard"', "time_s = -1"),
        ("map", 'spacing = "logarithmic" }', 'spacing = "logarithmic" }\nerror = 2'),
        ("campaign", "realisations = 2", "realisations = 4\nuntil = { resonance_hz = 0 }"),
        ("map", "amplitude_m = {", "amplitude = {"),
        ("map", 'spacing = "logarithmic"', 'spacing = "log"'),
        ("mapping", 'role = "m0_velocity"', 'role = "m0 velocity"'),
        ("mapping", 'source = "1"', 'sauce = "1"'),
    ],
)
def test_the_schema_finds_the_errors_for_which_loading_refuses_a_file(kind, old, new, tmp_path):
    named = {"campaign": "quick", "rig": "virtual_rig", "study": "paper", "map": "map"}
    right = (
        MAPPING
        if kind == "mapping"
        else (shipped_folder(FOLDERS[kind]) / f"{named[kind]}.toml").read_text(encoding="utf-8")
    )
    wrong = right.replace(old, new, 1)
    assert wrong != right
    path = tmp_path / "wrong.toml"
    path.write_text(wrong, encoding="utf-8")
    with pytest.raises(ConfigurationError):
        load_toml(path, MODELS[kind])
    assert schema_errors(kind, wrong) != []


def test_a_written_file_names_its_schema_and_loads_unchanged(tmp_path):
    campaign = load_campaign("paper")
    save_toml(campaign, tmp_path / "mine.toml")
    text = (tmp_path / "mine.toml").read_text(encoding="utf-8")
    uri = text.split("\n")[0].removeprefix("#:schema ")
    assert uri == (shipped_folder("schemas") / "campaign-1.schema.json").as_uri()
    assert load_campaign(tmp_path / "mine.toml") == campaign
    assert schema_errors("campaign", text) == []


ONE_SIDED = 'model = "gong2025"\ngap_m = [30e-6, inf]'


@pytest.mark.parametrize("kind", [SpecimenDescription, SpecimenTable])
def test_a_saved_specimen_names_its_schema_and_is_valid_under_it(kind, tmp_path):
    (tmp_path / "one_sided.toml").write_text(ONE_SIDED, encoding="utf-8")
    assert schema_errors("specimen", ONE_SIDED) == []
    for name in (*shipped_specimens(), str(tmp_path / "one_sided.toml")):
        described = kind.model_validate(load_specimen(name).model_dump())
        save_toml(described, tmp_path / "mine.toml")
        text = (tmp_path / "mine.toml").read_text(encoding="utf-8")
        schema = shipped_folder("schemas") / "specimen-1.schema.json"
        assert text.startswith(f"#:schema {schema.as_uri()}\n")
        assert schema_errors("specimen", text) == []
        assert load_specimen(str(tmp_path / "mine.toml")) == load_specimen(name)


@pytest.mark.parametrize("slip", ["gap = 3e-5", "gap_m = [3e-5]", 'gap_m = [3e-5, "open"]', "contact = 3"])
def test_the_schema_finds_errors_in_a_specimen(slip, tmp_path):
    (tmp_path / "mine.toml").write_text(f'model = "gong2025"\n{slip}\n', encoding="utf-8")
    with pytest.raises(ValueError, match=slip.split(" ", maxsplit=1)[0]):
        load_specimen(str(tmp_path / "mine.toml"))
    assert schema_errors("specimen", f'model = "gong2025"\n{slip}') != []


@pytest.mark.parametrize("version", ["2", "0", '"1"', "true", "1.0"])
def test_a_file_of_a_later_version_is_refused_with_advice(version, tmp_path):
    path = Path(tmp_path) / "later.toml"
    text = (shipped_folder("campaigns") / "quick.toml").read_text(encoding="utf-8")
    path.write_text(f"format_version = {version}\n{text}", encoding="utf-8")
    with pytest.raises(ConfigurationError, match="install a later version"):
        load_campaign(path)
    path.write_text(f"format_version = 1\n{text}", encoding="utf-8")
    assert load_campaign(path) == load_campaign("quick")


def test_an_editor_check_reports_an_error_and_accepts_a_valid_file(tmp_path):
    taplo = shutil.which("taplo", path=str(Path(sys.executable).parent))
    if taplo is None:
        pytest.skip("pip install vibench[test] brings taplo")

    def check(path):
        # Ignore a taplo.toml in the folder and catalogues on the web.
        command = [taplo, "check", "--no-auto-config", str(path)]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)

    save_toml(load_campaign("quick"), tmp_path / "mine.toml")
    right = check(tmp_path / "mine.toml")
    assert right.returncode == 0, right.stderr
    text = (tmp_path / "mine.toml").read_text(encoding="utf-8")
    (tmp_path / "mine.toml").write_text(text.replace("realisations = 2", "realisation = 2"), encoding="utf-8")
    wrong = check(tmp_path / "mine.toml")
    assert wrong.returncode != 0
    assert "realisation" in wrong.stderr
