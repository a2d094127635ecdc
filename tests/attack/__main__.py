"""``python -m tests.attack TARGET``: long attacks in shards, and the sum of their results.

::

    python -m tests.attack toml --seed 7 --count 5000 --shard 1/4 --minutes 25 --save toml_1.json
    python -m tests.attack --sum toml_*.json
"""

import argparse
import sys
import time
from math import inf
from pathlib import Path

from . import (
    altered_recordings,
    doubtful_recordings,
    engine_messages,
    imported_files,
    instrument_messages,
    instrument_replies,
    recordings_flips,
    recordings_kills,
    recordings_mutants,
    toml_files,
)
from .tally import Attack, Shard, Tally, read_tallies

TARGETS: dict[str, Attack] = {
    "toml": toml_files.attack,
    "imports": imported_files.attack,
    "engine": engine_messages.attack,
    "instruments": instrument_messages.attack,
    "replies": instrument_replies.attack,
    "altered": altered_recordings.attack,
    "recordings": recordings_mutants.attack,
    "flips": recordings_flips.attack,
    "kills": recordings_kills.attack,
    "calls": recordings_kills.attack_calls,
    "dropouts": doubtful_recordings.attack_dropouts,
}
"""All targets; each is attacked by one module."""


def main() -> int:
    """Run an attack or add up saved results; the exit code is 1 if something was found."""
    options = _options()
    if options.sum:
        tallies = _summary([tally for path in options.sum for tally in read_tallies(path)])
    else:
        part, of = (int(each) for each in options.shard.split("/"))
        until_s = time.monotonic() + 60 * options.minutes
        shard = Shard(options.seed, options.count, part - 1, of, until_s, options.save)
        tallies = [TARGETS[name](shard) for name in options.target or TARGETS]
    for tally in tallies:
        print(tally.line())
        for finding in tally.findings:
            print(f"  seed {finding.seed}, number {finding.number}: {'; '.join(finding.faults)}")
            print("    " + finding.told.strip().replace("\n", "\n    "))
    return int(any(tally.findings for tally in tallies))


def _summary(tallies: list[Tally]) -> list[Tally]:
    sums: dict[str, Tally] = {}
    for tally in tallies:
        sums.setdefault(tally.target, Tally(tally.target)).add(tally)
    return list(sums.values())


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.attack", description=__doc__.split("\n")[0])
    parser.add_argument("target", nargs="*", choices=[[], *TARGETS], help="all of them if absent")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=500, help="mutants of all shards together")
    parser.add_argument(
        "--shard", default="1/1", metavar="I/N", help="only every Nth mutant, from the Ith on"
    )
    parser.add_argument("--minutes", type=float, default=inf, help="what is not begun by then is left out")
    parser.add_argument(
        "--save", type=Path, metavar="FILE.json", help="keep what was seen, and go on from it"
    )
    parser.add_argument(
        "--sum", type=Path, nargs="+", metavar="FILE.json", help="add up what shards have saved"
    )
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
