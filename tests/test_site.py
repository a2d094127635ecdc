"""The documentation site: its texts, links, and tutorials as notebooks."""

import json
import re
import subprocess
import sys
from html import unescape
from pathlib import Path

import pytest

from tests.test_tutorials import CELL, TUTORIALS

pytestmark = [pytest.mark.thorough, pytest.mark.slow, pytest.mark.timeout(900)]
pytest.importorskip("myst_nb", reason="pip install 'vibench[docs]'")
SHORTEST = "how_accurate"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Build the site without results of tutorials; the build creates only the folder `html`."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "vibench.cli", "docs", "--quick", "--out", "html"]
    ended = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    assert [path.name for path in folder.iterdir()] == ["html"]
    return folder / "html"


def notebook(site, name):
    page = (site / "tutorials" / f"{name}.html").read_text(encoding="utf-8")
    (link,) = re.findall(r'href="\.\./(_downloads/\w+/[\w.]+\.ipynb)"', page)
    assert link.endswith(f"/{name}.ipynb")
    return site / link


def test_text_in_the_reference_pages_is_not_rendered_as_a_type(site):
    pages = sorted((site / "reference").glob("*.html"))
    assert len(pages) > 15
    assert [page.name for page in pages if ">Type<" in page.read_text(encoding="utf-8")] == []
    page = (site / "reference" / "vibench.acquisition.plan.html").read_text(encoding="utf-8")
    assert "Which motion of m0 that is: the one against the base, or the absolute one" in unescape(page)


def test_paths_of_pages_are_rendered_as_links(site):
    for page in site.rglob("*.html"):
        text = re.sub(r"<(a|code|pre|title)\b.*?</\1>", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
        assert re.findall(r"\bdocs/[\w/-]+\.md", text) == [], page.name


@pytest.mark.parametrize("tutorial", TUTORIALS, ids=lambda path: path.stem)
def test_a_tutorial_is_offered_as_a_notebook(site, tutorial):
    cells = json.loads(notebook(site, tutorial.stem).read_text(encoding="utf-8"))["cells"]
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    assert code == [cell.rstrip("\n") for cell in CELL.findall(tutorial.read_text(encoding="utf-8"))]


def test_the_shortest_notebook_runs(site, tmp_path):
    copy = tmp_path / "notebook.ipynb"
    copy.write_bytes(notebook(site, SHORTEST).read_bytes())
    program = "import sys; from nbclient.cli import main; sys.argv = sys.argv[1:]; main()"
    command = [sys.executable, "-c", program, "execute", "--inplace", str(copy)]
    ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    cells = json.loads(copy.read_text(encoding="utf-8"))["cells"]
    assert any(cell.get("outputs") for cell in cells)


@pytest.mark.parametrize("tutorial", TUTORIALS, ids=lambda path: path.stem)
def test_tutorial_code_lines_fit_the_page_width(tutorial):
    lines = "".join(CELL.findall(tutorial.read_text(encoding="utf-8"))).splitlines()
    assert [line for line in lines if len(line) > 100] == []


def test_the_docs_extra_installs_everything_needed_to_build_the_site():
    program = Path(__file__).parent.parent / "pyproject.toml"
    (extra,) = re.findall(r"^docs = (\[.*\])$", program.read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert {"vibench[bench]", "myst-nb>=1.2,<2"} <= set(json.loads(extra))
