"""A packed folder passes the validator of the RO-Crate community, which runs in a separate environment.

roc-validator needs older versions of some of our libraries. It looks up the meaning of terms on the web;
here its page cache is filled from a file of another library of the same authors.
"""

import os
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path
from zipfile import ZipFile

import pytest

from vibench.analysis.exchange import CrateFacts, pack_folder

rocrate = pytest.importorskip("rocrate", reason="pip install vibench[test] brings rocrate")

VALIDATOR = "roc-validator>=0.13,<0.14"
TERMS = Path(rocrate.__file__).parent / "data" / "ro-crate.jsonld"
TO_CACHE = """
import sys
from pathlib import Path
from requests.adapters import HTTPAdapter
from requests_cache import CachedSession
from urllib3 import HTTPResponse

class FromFile(HTTPAdapter):
    def send(self, request, **_):
        page = HTTPResponse(body=open(sys.argv[2], "rb"), status=200, preload_content=False,
                            headers={"Content-Type": "application/ld+json"})
        return self.build_response(request, page)

session = CachedSession(sys.argv[1])
session.mount("https://", FromFile())
session.get("https://w3id.org/ro/crate/1.1/context").raise_for_status()
"""

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.skipif(os.name == "nt", reason="the validator's programs lie elsewhere there"),
]


@pytest.fixture(scope="module")
def validate(tmp_path_factory):
    """Return a function that runs the validator offline and returns its exit code and output."""
    folder = tmp_path_factory.mktemp("validator")
    venv.create(folder, with_pip=False)
    programs = Path(sysconfig.get_path("scripts", "venv", {"base": str(folder), "platbase": str(folder)}))
    python = programs / Path(sys.executable).name
    install = [sys.executable, "-m", "pip", "--quiet", "--python", python, "install", VALIDATOR]
    subprocess.run(install, check=True, timeout=300)
    subprocess.run([python, "-c", TO_CACHE, folder / "pages", TERMS], check=True, timeout=100)

    def run(crate, severity):
        command = [
            programs / "rocrate-validator", "-y", "--disable-color", "validate", "--no-paging", "--verbose",
            "--offline", "--cache-path", folder / "pages", "--no-auto-profile", "-p", "ro-crate-1.1",
            "-l", severity, crate,
        ]  # fmt: skip
        ended = subprocess.run(command, capture_output=True, text=True, check=False, timeout=100)
        return ended.returncode, ended.stdout + ended.stderr

    return run


@pytest.fixture
def folder(known_file, tmp_path):
    """Make a campaign folder: a recording, a report, an unreadable file and a name with spaces."""
    made = tmp_path / "a campaign"
    (made / "report").mkdir(parents=True)
    (made / "known.h5").write_bytes(Path(known_file).read_bytes())
    (made / "report" / "results and bounds.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    (made / "broken.h5").write_bytes(b"no recording")
    return made


def test_a_crate_meets_the_requirements_and_the_recommendations_of_the_standard(validate, folder, tmp_path):
    facts = CrateFacts(
        "https://creativecommons.org/licenses/by/4.0/",
        ("Ada L.", "Grace H."),
        organisation="Institute",
        organisation_url="https://example.org/institute",
    )
    pack_folder(folder, tmp_path / "crate.zip", facts, {"broken.h5": "it is broken"})
    code, said = validate(tmp_path / "crate.zip", "recommended")
    assert code == 0, said


def test_a_crate_without_authors_meets_the_requirements_of_the_standard(validate, folder, tmp_path):
    (folder / "broken.h5").unlink()
    (folder / "report" / "results and bounds.csv").unlink()
    pack_folder(folder, tmp_path / "crate.zip", CrateFacts("https://example.org/our-licence"), {})
    code, said = validate(tmp_path / "crate.zip", "required")
    assert code == 0, said


def test_the_validator_refuses_a_crate_without_a_licence(validate, folder, tmp_path):
    """This shows that the validator checks the contents."""
    pack_folder(folder, tmp_path / "crate.zip", CrateFacts("https://example.org/our-licence"), {})
    with ZipFile(tmp_path / "crate.zip") as whole, ZipFile(tmp_path / "worse.zip", "w") as worse:
        for name in whole.namelist():
            kept = whole.read(name)
            if name == "ro-crate-metadata.json":
                kept = kept.replace(b'"license"', b'"unknownTerm"')
            worse.writestr(name, kept)
    code, said = validate(tmp_path / "worse.zip", "required")
    assert code != 0
    assert "license" in said
