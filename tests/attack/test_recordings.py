"""Attacks on recordings: short in every test run, longer with ``-m attack``, for hours by `tests.attack`."""

import random
import shutil
import sys

import pytest

from . import recordings_flips, recordings_kills, recordings_mutants
from .command_runner import CommandRunner
from .recordings_corpus import good_recordings
from .tally import Shard, Tally

FOUND = (("recordings", 1, 40), ("recordings", 2, 361))
"""Mutants that once caused a fault: sentences of 50,000 characters."""


def faults_of_mutant(name, seed, number):
    """Run one mutant that an attack has found."""
    case = recordings_mutants.mutant(random.Random(f"{seed}:{number}"))
    with CommandRunner() as runner:
        return runner.run(case).faults


@pytest.mark.parametrize(("name", "seed", "number"), FOUND)
@pytest.mark.attack
def test_faults_found_by_earlier_attacks_stay_fixed(name, seed, number):
    assert faults_of_mutant(name, seed, number) == ()


@pytest.mark.thorough
def test_an_intact_recording_gives_reproducible_results(tmp_path):
    for name in ("dwell.h5", "with_result.h5"):
        path = tmp_path / name
        path.write_bytes(good_recordings()[name])
        said, _, _ = recordings_flips.verdict_of_file(path)
        assert len(said) == 64, said
        assert recordings_flips.verdict_of_file(path)[0] == said


def test_a_bit_flip_that_no_check_detects_would_be_reported():
    assert recordings_flips.faults("1234", "5678", 0.1, 1) == ("other numbers, unnoticed",)
    assert recordings_flips.faults("refused: it is damaged", "5678", 0.1, 1) == ()
    assert recordings_flips.faults("5678", "5678", 0.1, 1) == ()


@pytest.mark.thorough
@pytest.mark.parametrize(
    "count", [20, pytest.param(60, marks=pytest.mark.attack), pytest.param(10_000, marks=pytest.mark.slow)]
)
@pytest.mark.timeout(7200)
def test_a_bit_flip_is_detected_or_changes_no_result(count):
    tally = recordings_flips.attack(Shard(seed=3, count=count))
    assert tally.findings == []
    assert tally.tried == count
    assert tally.codes["noticed"] > count / 5


@pytest.mark.parametrize("count", [pytest.param(12, marks=pytest.mark.attack)])
@pytest.mark.timeout(1800)
def test_a_broken_recording_gives_a_one_sentence_error(count):
    tally = recordings_mutants.attack(Shard(seed=3, count=count))
    assert tally.findings == []
    assert tally.codes["1"] > count / 2


@pytest.mark.skipif(sys.platform != "linux" or shutil.which("cc") is None, reason="preloads a C library")
@pytest.mark.parametrize(
    "faults", [pytest.param(6, marks=pytest.mark.attack), pytest.param(200, marks=pytest.mark.slow)]
)
@pytest.mark.timeout(7200)
def test_faults_at_exact_system_calls_lose_or_repeat_no_point(faults):
    tally, number, kinds = Tally("calls"), 0, recordings_kills.CALL_KINDS
    while sum(tally.codes.get(kind, 0) for kind in kinds) < faults:
        tally.add(recordings_kills.attack_calls(Shard(seed=42, count=number + 1, part=number)))
        number += 1
    assert tally.findings == []


@pytest.mark.attack
@pytest.mark.timeout(1800)
def test_twelve_kills_of_a_campaign_lose_or_repeat_no_point():
    tally = Tally("kills")
    number = kills = 0
    # Whether a campaign ends before its kill depends on the computer, so the number of kills varies.
    while kills < 12:
        tally.add(recordings_kills.attack(Shard(seed=3, count=number + 1, part=number)))
        kills = sum(tally.codes.get(kind, 0) for kind in recordings_kills.KINDS)
        number += 1
    assert tally.findings == []
