"""A repeatedly killed campaign ends like an uninterrupted one."""

import random
import subprocess

import numpy as np
import pytest

from vibench.acquisition.campaign import JournalPointState, read_journal

from .conftest import ENVIRONMENT
from .killed_campaign import amplitudes, branches, command, done_points, kill_at, short_points, slow_rig


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("points", "kills"),
    [pytest.param(8, 2, id="8"), pytest.param(200, 10, id="200", marks=pytest.mark.slow)],
)
@pytest.mark.timeout(1500)
def test_a_killed_and_resumed_campaign_records_every_point_once(tmp_path, points, kills):
    chance = random.Random(points)
    plan, bench = short_points(tmp_path, points), slow_rig(tmp_path)
    left_alone, disturbed = tmp_path / "left_alone", tmp_path / "disturbed"
    subprocess.run(command(plan, bench, left_alone), env=ENVIRONMENT, check=True, stdout=subprocess.DEVNULL)

    reached = 0
    for number in range(kills):
        options = ["--resume"] if number else []
        reached = kill_at(command(plan, bench, disturbed, *options), disturbed, points // (kills + 2), chance)
        assert reached == done_points(disturbed) < points
    resumed = command(plan, bench, disturbed, "--resume")
    ended = subprocess.run(resumed, env=ENVIRONMENT, check=True, capture_output=True, text=True)
    assert ended.stdout.count("kept") >= reached

    journal = read_journal(disturbed / "points.campaign.sqlite")
    assert [point.state for point in journal] == [JournalPointState.DONE] * points
    assert all(point.attempts <= 1 + kills for point in journal)
    expected, found = amplitudes(left_alone), amplitudes(disturbed)
    assert list(found) == list(expected)
    assert len(found) == points
    assert found == pytest.approx(expected, rel=0.02)


@pytest.mark.thorough
def test_a_sweep_resumed_after_a_kill_stays_on_its_branch(tmp_path):
    plan, bench, out = branches(tmp_path), slow_rig(tmp_path), tmp_path / "out"
    reached = kill_at(command(plan, bench, out), out, 4, random.Random(1))
    assert 4 <= reached < 7, "killed on the way up"
    subprocess.run(
        command(plan, bench, out, "--resume"), env=ENVIRONMENT, check=True, stdout=subprocess.DEVNULL
    )
    displacement = {
        name: velocity / (2 * np.pi * float(name.rsplit("-", 1)[1].removesuffix("hz")))
        for name, velocity in amplitudes(out).items()
    }
    up = [displacement[f"line-0p5vpp-up-{frequency}hz"] for frequency in range(150, 201, 10)]
    down = [displacement[f"line-0p5vpp-down-{frequency}hz"] for frequency in range(200, 169, -10)]
    assert all(each > 35e-6 for each in up), "on the branch that collides, to its end"
    assert all(each < 25e-6 for each in down)
    # At one frequency there are two motions: without lead-in, the other motion is found.
    assert displacement["alone-190hz"] < 25e-6 < up[4]
