"""An attack on commands: numbered cases, each run in a separate process and judged by its result."""

import random
from collections.abc import Callable

from .command_runner import CommandRunner
from .limits import Case, Ending
from .tally import Finding, Shard, Tally

TOLD = 600
"""Number of characters of a command's output that are kept with a finding."""


def attack_commands(
    name: str,
    mutant: Callable[[random.Random], Case],
    shard: Shard,
    judge: Callable[[Case, Ending], tuple[str, ...]] = lambda _, ending: ending.faults,
) -> Tally:
    """Run the mutants of a shard, and return the tally with all findings."""
    tally = shard.tally(name)
    with CommandRunner() as runner:
        for number, chance in shard.chances(tally):
            case = mutant(chance)
            ending = runner.run(case)
            tally.count(ending.code, ending.took_s, ending.peak_bytes)
            if faults := judge(case, ending):
                told = (ending.err or ending.out)[-TOLD:]
                tally.findings.append(Finding(name, shard.seed, number, faults, told))
    return tally
