"""RO-Crates of folders are complete, described correctly and leave the folder unchanged."""

import hashlib
import json
import shutil
from zipfile import ZipFile

import pytest

from vibench.analysis import InvalidRequest, NotEnoughData
from vibench.analysis.exchange import CrateFacts, pack_folder

LICENCE = "https://creativecommons.org/licenses/by/4.0/"


@pytest.fixture
def folder(known_file, tmp_path):
    made = tmp_path / "campaign"
    (made / "report").mkdir(parents=True)
    shutil.copy(known_file, made / "known.h5")
    (made / "report" / "table.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    (made / "broken.h5").write_bytes(b"no recording")
    (made / "unfinished.h5.part").write_bytes(b"left out")
    return made


@pytest.fixture
def crate(folder, tmp_path):
    pack_folder(folder, tmp_path / "crate.zip", CrateFacts(LICENCE, ("Ada L.",), "Known"), {})
    return tmp_path / "crate.zip"


def entities(crate):
    """Return the entities of a crate by their names."""
    with ZipFile(crate) as archive:
        graph = json.loads(archive.read("ro-crate-metadata.json"))["@graph"]
    return {each["@id"]: each for each in graph}


def test_every_file_of_a_folder_is_packed_unchanged_and_described(folder, crate):
    graph = entities(crate)
    with ZipFile(crate) as archive:
        for name in ("known.h5", "report/table.csv", "broken.h5"):
            assert archive.read(name) == (folder / name).read_bytes()
            assert graph[name]["sha256"] == hashlib.sha256((folder / name).read_bytes()).hexdigest()
        assert "unfinished.h5.part" not in archive.namelist()
    assert "m0_velocity [m s-1]" in graph["known.h5"]["description"]
    assert graph["broken.h5"]["description"].startswith("Cannot be read as a recording")
    assert graph["./"]["author"] == {"@id": "#author-1"}
    assert not (folder / "ro-crate-metadata.json").exists()


def test_files_outside_the_folder_are_not_published_through_links(folder, tmp_path):
    """A link in a received folder may point to a private key of the person who packs it."""
    (tmp_path / "private").write_text("a key")
    (folder / "notes.txt").symlink_to(tmp_path / "private")
    with pytest.raises(InvalidRequest, match="outside of the folder"):
        pack_folder(folder, tmp_path / "crate.zip", CrateFacts(LICENCE), {})
    assert not (tmp_path / "crate.zip").exists()


def test_a_crate_is_never_overwritten(folder, crate):
    with pytest.raises(InvalidRequest, match="exists"):
        pack_folder(folder, crate, CrateFacts(LICENCE), {})


def test_an_invalid_deposit_is_refused(folder, tmp_path):
    with pytest.raises(InvalidRequest, match="is not the address of a licence"):
        pack_folder(folder, tmp_path / "x.zip", CrateFacts("CC-BY"), {})
    with pytest.raises(InvalidRequest, match="without the name"):
        pack_folder(
            folder, tmp_path / "x.zip", CrateFacts(LICENCE, organisation_url="https://example.org"), {}
        )
    wrong = CrateFacts(LICENCE, organisation="Institute", organisation_url="example")
    with pytest.raises(InvalidRequest, match="'example' is not the address of an organisation"):
        pack_folder(folder, tmp_path / "x.zip", wrong, {})
    with pytest.raises(NotEnoughData, match="no recording"):
        pack_folder(folder / "report", tmp_path / "x.zip", CrateFacts(LICENCE), {})
    assert not (tmp_path / "x.zip").exists()


@pytest.mark.parametrize(
    ("address", "name"),
    [
        (LICENCE, "CC BY 4.0"),
        ("http://creativecommons.org/licenses/by-nc-sa/3.0", "CC BY-NC-SA 3.0"),
        ("https://creativecommons.org/publicdomain/zero/1.0/", "CC0 1.0"),
        ("https://creativecommons.org/licenses/by/4.0/deed.en", "CC BY 4.0"),
        ("https://creativecommons.org/publicdomain/zero/1.0/legalcode", "CC0 1.0"),
        ("https://creativecommons.org/licenses/by", "CC BY"),
        ("https://spdx.org/licenses/BSD-3-Clause", "BSD-3-Clause"),
        ("https://example.org", "example.org"),
    ],
)
def test_licences_may_be_given_by_common_names(folder, tmp_path, address, name):
    pack_folder(folder, tmp_path / "crate.zip", CrateFacts(address), {})
    assert entities(tmp_path / "crate.zip")[address]["name"] == name


def test_a_crate_names_the_organisation_as_publisher_and_affiliation(folder, tmp_path):
    pack_folder(folder, tmp_path / "crate.zip", CrateFacts(LICENCE, ("A", "B"), organisation="Institute"), {})
    graph = entities(tmp_path / "crate.zip")
    assert graph["./"]["publisher"] == {"@id": "#organisation"}
    assert graph["#organisation"] == {"@id": "#organisation", "@type": "Organization", "name": "Institute"}
    assert [graph[f"#author-{number}"]["affiliation"]["@id"] for number in (1, 2)] == ["#organisation"] * 2


def test_the_rocrate_library_finds_every_file_of_a_crate(crate, tmp_path):
    rocrate = pytest.importorskip("rocrate.rocrate", reason="pip install vibench[test] brings rocrate")
    with ZipFile(crate) as archive:
        archive.extractall(tmp_path / "unpacked")
    read = rocrate.ROCrate(tmp_path / "unpacked")
    assert read.name == "Known"
    assert {each.id for each in read.data_entities} == {"known.h5", "report/table.csv", "broken.h5"}
