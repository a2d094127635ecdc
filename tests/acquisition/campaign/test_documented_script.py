"""The script in docs/campaigns.md runs unchanged and refines a jump."""

import re
from pathlib import Path

import pytest

from vibench.acquisition.campaign import JournalPointState, read_journal
from vibench.acquisition.campaign._journal import journal_path

ROOT = Path(__file__).parents[3]
# By chance, collisions that cease may do so up to a second late.
CAMPAIGN = """
name = "jump"
[[sweeps]]
name = "line"
amplitude_vpp = [0.5]
frequency_hz = { start = 150, stop = 220, step = 10 }
continue_from_previous = "frequency_hz"
lead_s = 0.3
[sweeps.measurement]
ramp_s = 0.2
ramp_step_s = 0.02
excitation = { kind = "dwell", settle_s = 1.5, duration_s = 0.2 }
"""


@pytest.fixture
def script():
    page = (ROOT / "docs" / "campaigns.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    return compile(text, "docs/campaigns.md", "exec")


@pytest.mark.thorough
def test_the_documented_script_refines_a_jump_and_can_be_repeated(script, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rig = (ROOT / "hardware_configs" / "virtual_rig.toml").read_text(encoding="utf-8")
    # With seed 1 the collisions at 207.5 Hz cease during the recording.
    for given, other in (("sample_rate_hz = 51200", "sample_rate_hz = 5120"), ("seed = 1\n", "seed = 2\n")):
        assert given in rig
        rig = rig.replace(given, other)
    Path("bench.toml").write_text(rig)
    # Below 150 Hz there is one motion; from there the specimen follows the branch with collisions.
    Path("campaign.toml").write_text(CAMPAIGN)
    exec(script, {})
    points = read_journal(journal_path(Path("recordings"), "jump"))
    assert {point.state for point in points} == {JournalPointState.DONE}
    added = [point for point in points if point.added_after]
    assert len(added) == 3, "10 Hz are halved three times, to 1.25 Hz"
    for point in added:
        way = [tone.frequency_hz for tone in point.measurement.excitation.lead_in]
        assert way == sorted(way)
        assert way[0] == 150
        assert 200 < point.measurement.excitation.frequency_hz < 220
    before = sorted(Path("recordings").glob("*.h5"))
    exec(script, {})
    assert sorted(Path("recordings").glob("*.h5")) == before
