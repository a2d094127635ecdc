"""A third-party package adds a kind of measurement without changes to vibench."""

import os
import subprocess
import sys

import pytest

KIND = '''"""Two sines, one after the other."""

from typing import ClassVar, Literal

from vibench.acquisition.excitation.plan import AbstractExcitation, Family, FrequencyHz
from vibench.acquisition.excitation.steps import Segment, Step, Tone
from vibench.acquisition.recording import SegmentLabel


class TwoTones(AbstractExcitation):
    """Two sines, one after the other."""

    family: ClassVar[Family] = Family.STEPPED
    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.STEP,)
    kind: Literal["two_tones"] = "two_tones"
    first_hz: FrequencyHz
    second_hz: FrequencyHz
    record_s: float = 0.5

    @property
    def band_hz(self):
        return min(self.first_hz, self.second_hz), max(self.first_hz, self.second_hz)

    @property
    def playing_s(self):
        return 2 * (0.5 + self.record_s)

    def steps(self):
        for frequency_hz in (self.first_hz, self.second_hz):
            numbers = {"frequency_hz": frequency_hz, "direction": "up"}
            yield Step(Tone(frequency_hz), 0.5, self.record_s, Segment(SegmentLabel.STEP, numbers))
'''
PLAN = """name = "two"
[[measurements]]
name = "pair"
ramp_s = 0.5
[measurements.excitation]
kind = "two_tones"
amplitude_vpp = 0.1
first_hz = 160
second_hz = 180
"""


def install_kind(folder, target):
    """Install a package with an entry point into a folder, as pip does."""
    information = folder / "somebodys_kind-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: somebodys-kind\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text(f"[vibench.excitations]\ntwo_tones = {target}\n")
    (folder / "two_tones.py").write_text(KIND)
    (folder / "two.toml").write_text(PLAN)


def run_vibench(folder, *arguments):
    return subprocess.run(
        [sys.executable, "-m", "vibench.cli", *map(str, arguments)],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.thorough
def test_a_third_party_kind_of_excitation_is_planned_measured_and_reported(tmp_path):
    install_kind(tmp_path, "two_tones:TwoTones")
    measured = run_vibench(tmp_path, "measure", "two.toml", "--out", "two")
    assert measured.returncode == 0, measured.stderr
    analysed = run_vibench(tmp_path, "analyse", "two", "--out", "report")
    assert analysed.returncode == 0, analysed.stderr
    (page,) = (tmp_path / "report").glob("*.html")
    assert "Two tones at 0.1 Vpp: Response II up to" in page.read_text(encoding="utf-8")


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("target", "reason"),
    [
        ("no_such_module:TwoTones", "cannot be loaded (ModuleNotFoundError"),
        ("vibench.acquisition.plan:Dwell", "not the plan of that kind"),
        ("two_tones:Segment", "not the plan of that kind"),
    ],
)
def test_a_broken_third_party_kind_of_excitation_affects_only_its_own_plans(tmp_path, target, reason):
    install_kind(tmp_path, target)
    refused = run_vibench(tmp_path, "measure", "two.toml", "--out", "two", "--estimate")
    assert refused.returncode == 1
    assert "'two_tones' of vibench.excitations is" in refused.stderr
    assert reason in refused.stderr
    usual = run_vibench(tmp_path, "measure", "quick", "--out", "quick", "--estimate")
    assert usual.returncode == 0, usual.stderr
