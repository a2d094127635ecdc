"""The attack harness: numbered mutants, shards, sums of results, and limits of commands."""

import random
import time
from dataclasses import replace

import pytest

from .byte_mutants import mutate_bytes
from .command_runner import CommandRunner
from .limits import HANGS_S, LONGEST_COMPLAINT, LONGEST_S, MOST_BYTES, Case, Ending
from .tally import Finding, Shard, Tally, read_tallies, save
from .text_mutants import mutate_toml
from .toml_files import CAMPAIGNS, ROOT, reading

GOOD = Ending(code=0, out="{}", err="", took_s=1.0, clock_s=1.0, peak_bytes=200_000_000)
REFUSED = replace(GOOD, code=1, err="error: what was given is not allowed; give another\n")


@pytest.mark.parametrize("ending", [GOOD, REFUSED, replace(GOOD, code=2, err="Usage: vibench ...")])
def test_results_and_one_sentence_errors_do_not_count_as_faults(ending):
    assert ending.faults == ()


@pytest.mark.parametrize(
    "ending",
    [
        replace(GOOD, took_s=LONGEST_S + 1),
        replace(GOOD, clock_s=HANGS_S + 1),
        replace(GOOD, peak_bytes=MOST_BYTES + 1),
        replace(GOOD, code=-11),
        replace(GOOD, code=137),
        replace(GOOD, err="error: all is lost\n"),
        replace(GOOD, code=1),
        replace(REFUSED, err="Traceback (most recent call last):\n" + REFUSED.err),
        replace(REFUSED, err=2 * REFUSED.err),
        replace(REFUSED, err=REFUSED.err + "x" * LONGEST_COMPLAINT),
    ],
)
def test_every_violation_of_the_limits_is_a_fault(ending):
    assert len(ending.faults) == 1


def test_a_mutant_depends_only_on_its_seed_and_its_number():
    def mutants(shard):
        return {number: mutate_toml(CAMPAIGNS[0], chance) for number, chance in shard.chances(Tally("toml"))}

    whole = mutants(Shard(7, 40))
    parts = [mutants(Shard(7, 40, part, 3)) for part in range(3)]
    assert whole == {number: text for part in parts for number, text in part.items()}
    assert sum(len(part) for part in parts) == 40
    assert len(set(whole.values())) > 30
    assert whole != mutants(Shard(8, 40))
    assert mutants(Shard(7, 40, until_s=time.monotonic() - 1)) == {}


def test_the_tallies_of_the_shards_of_an_attack_are_added_up(tmp_path):
    first, second = Tally("toml"), Tally("toml")
    first.count(0, took_s=2.0, peak_bytes=5)
    second.count(0, took_s=1.0, peak_bytes=7)
    second.count(1)
    second.findings.append(Finding("toml", 1, 2, ("a traceback",), "TypeError"))
    save(second, tmp_path / "second.json")
    first.add(*read_tallies(tmp_path / "second.json"))
    assert first == Tally("toml", 3, {"0": 2, "1": 1}, 2.0, 7, second.findings)
    with pytest.raises(ValueError, match="different targets"):
        first.add(Tally("imports"))


def test_a_shard_of_an_attack_continues_from_its_file(tmp_path):
    path = tmp_path / "shard.json"

    def tally_after(count, part=0):
        shard = Shard(7, count, part, 2, saved=path)
        tally = shard.tally("toml")
        for number, _ in shard.chances(tally):
            tally.count(number)
            assert tally.done == (read_tallies(path)[0].done if path.exists() else 0)
        return tally

    assert tally_after(3).codes == {"0": 1, "2": 1}
    assert tally_after(7).codes == {"0": 1, "2": 1, "4": 1, "6": 1}
    assert tally_after(7) == read_tallies(path)[0]
    with pytest.raises(ValueError, match="holds shard 1/2 of seed 7, not 2/2 of seed 7; give another file"):
        tally_after(7, part=1)


def test_an_empty_document_can_be_mutated():
    for number in range(200):
        chance = random.Random(number)
        assert isinstance(mutate_bytes(b"", chance, (b"abc",)), bytes)
        assert isinstance(mutate_toml("", chance, ("a = 1",)), bytes)


@pytest.mark.thorough
def test_a_command_runs_in_a_separate_process():
    with CommandRunner() as runner:
        good = runner.run(reading("campaign", (ROOT / "campaigns" / "paper.toml").read_bytes()))
        bad = runner.run(reading("campaign", b"name = 3"))
        none = runner.run(Case(("measure", "no.toml", "--out", "x")))
    assert (good.code, good.faults, good.made) == (0, (), ())
    assert '"recordings": 7' in good.out
    assert (bad.code, none.code) == (1, 1)
    assert bad.err.startswith("error: broken.toml: name = 3")
    assert bad.faults == none.faults == ()
    assert all(50e6 < each.peak_bytes < 500e6 for each in (good, bad, none))
