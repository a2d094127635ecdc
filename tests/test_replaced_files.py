"""Files are replaced as a whole: a failed write leaves the earlier file, or none."""

import ast
import errno
import re
import subprocess
import sys
from pathlib import Path

import pytest

from vibench.sim.operating_system.this import replace_file

SHEET = """
from datetime import UTC, datetime
from vibench.acquisition.rig import KnobSheet, save_knob_sheet
def sheet(text): return KnobSheet(operator=text, confirmed=datetime.now(UTC), knobs=())
"""
WRITERS = {
    "knobs": SHEET + "def write(path, text): save_knob_sheet(sheet(text), path)",
    "table": """
from vibench.analysis.tables import Table, write_csv
def write(path, text): write_csv(Table("table", ((text, (1.0,)),)), path)
""",
}
REFUSED = """
import resource, sys
from pathlib import Path
path = Path(sys.argv[1])
write(path, "first")
whole = path.read_bytes()
resource.setrlimit(resource.RLIMIT_FSIZE, (20, resource.RLIM_INFINITY))
try:
    write(path, "second" * 9)
except Exception as error:
    print(type(error).__name__)
print(path.read_bytes() == whole, [each.name for each in path.parent.iterdir()])
"""


@pytest.mark.skipif(sys.platform == "win32", reason="limits on file size exist on POSIX only")
@pytest.mark.parametrize(("writer", "error"), [("knobs", "ConfigurationError"), ("table", "OSError")])
def test_a_failed_write_leaves_the_existing_file_unchanged(tmp_path, writer, error):
    script = [sys.executable, "-c", WRITERS[writer] + REFUSED, str(tmp_path / "file")]
    ended = subprocess.run(script, capture_output=True, text=True, check=False)
    assert (ended.stdout, ended.stderr) == (f"{error}\nTrue ['file']\n", "")


@pytest.mark.parametrize("named", [None, "another"])
def test_a_failed_write_names_the_file_in_the_error(tmp_path, named):
    """The exception of a failed write contains no file name."""
    with pytest.raises(OSError, match="full") as refused, replace_file(tmp_path / "file"):
        raise OSError(errno.ENOSPC, "full", named)
    assert refused.value.filename == (named or str(tmp_path / "file"))


def test_a_failed_rename_names_the_file_in_the_error(tmp_path):
    """The error names the final file and not the temporary file."""
    with pytest.raises(FileNotFoundError) as refused, replace_file(tmp_path / "file") as coming:
        coming.unlink(missing_ok=True)
    assert refused.value.filename == str(tmp_path / "file")


def test_writing_to_a_link_keeps_the_link_and_replaces_its_target(tmp_path):
    (tmp_path / "target").write_text("first")
    (tmp_path / "link").symlink_to(tmp_path / "target")
    with replace_file(tmp_path / "link") as coming:
        coming.write_text("second")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "target").read_text() == "second"


ROOT = Path(__file__).parents[1]
WRITING = ("write_text", "write_bytes", "savefig", "copyfile", "copytree")
UNFINISHED = {"coming", "unfinished", "tmp"}
"""Names of a file before it is complete."""
UNFINISHED_FOR_CALLER = {"_wav.py", "_csv.py", "_uff.py", "_mat.py", "_excerpt.py"}
"""Modules that write exports: `new_file` passes them the temporary name."""
NO_FILE_OF_A_USER = {
    "installation.py: shutil.copytree(shipped_folder(folder), root / folder, ignore=NOT_A_SOURCE)": "scratch",
    "installation.py: shutil.copytree(root / 'site', target, ignore=shutil.ignore_patterns('.doctrees'), "
    "dirs_exist_ok=True)": "a site is built again",
    "_log.py: path.open('a', encoding='utf-8')": "a log grows by whole lines",
    "_log.py: self._path.open('a', encoding='utf-8')": "likewise",
    "_style.py: self.figure.savefig(target, format=kind, dpi=PNG_DPI, metadata=metadata)": "memory",
    "screenshots.py: small.save(str(path), None, _SMALLEST_FILE)": "made again with the documents",
    "_file_store.py: path.open('xb')": "claims the name while the file is made",
    "tasks.py: self._path.write_bytes(b'')": "the laboratory's converter writes it, as the real one does",
}


def writes(source):
    """Yield each call that writes a file, and the variable names in it."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            call, names = (
                ast.unparse(node),
                {each.id for each in ast.walk(node) if isinstance(each, ast.Name)},
            )
            opens = node.func.attr == "open" and re.search(r"open\('[wax]", call)
            if opens or node.func.attr in WRITING or ".save(str(" in call:
                yield call, names


@pytest.mark.thorough
def test_user_files_are_never_written_directly_under_their_final_name():
    found = [
        f"{path.name}: {call}"
        for package in ("acquisition", "analysis", "cli", "gui", "sim", "virtual_rig", "extensions")
        for path in (ROOT / package).rglob("*.py")
        if path.name not in UNFINISHED_FOR_CALLER
        for call, names in writes(path.read_text(encoding="utf-8"))
        if not names & UNFINISHED
    ]
    assert sorted(each for each in found if each not in NO_FILE_OF_A_USER) == []
