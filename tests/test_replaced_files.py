"""A file that takes the place of an older one: a disk that refuses leaves the older one whole."""

import subprocess
import sys

import pytest

from vibench.sim.operating_system.this import replaced

SHEET = """
from datetime import UTC, datetime
from vibench.acquisition import save_toml
from vibench.acquisition.rig import KnobSheet, save_knob_sheet
def sheet(text): return KnobSheet(operator=text, confirmed=datetime.now(UTC), knobs=())
"""
WRITERS = {
    "knobs": SHEET + "def write(path, text): save_knob_sheet(sheet(text), path)",
    "toml": SHEET + "def write(path, text): save_toml(sheet(text), path)",
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
@pytest.mark.parametrize(
    ("writer", "error"),
    [("knobs", "ConfigurationError"), ("toml", "ConfigurationError"), ("table", "OSError")],
)
def test_a_refused_file_leaves_the_older_one_as_it_was(tmp_path, writer, error):
    script = [sys.executable, "-c", WRITERS[writer] + REFUSED, str(tmp_path / "file")]
    ended = subprocess.run(script, capture_output=True, text=True, check=False)
    assert (ended.stdout, ended.stderr) == (f"{error}\nTrue ['file']\n", "")


def test_a_link_stays_a_link_and_its_target_is_replaced(tmp_path):
    (tmp_path / "target").write_text("first")
    (tmp_path / "link").symlink_to(tmp_path / "target")
    with replaced(tmp_path / "link") as coming:
        coming.write_text("second")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "target").read_text() == "second"
