"""Compare two versions of the analysis on the same recordings: withheld results, and growth of bounds.

    python benchmarks/kept_answers.py make FOLDER --count 200 --seed 1 --shard 1/4   # record on random rigs
    python benchmarks/kept_answers.py answers FOLDER --save before.json              # once with each version
    python benchmarks/kept_answers.py compare before.json after.json

Existing recordings, and results that are stored in the file, are used again.
"""

import argparse
import json
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from report_coverage import random_plan
from twin_agreement import random_rig

import vibench.cli.environment  # noqa: F401 - one thread, as for the command, before numpy works
from vibench.acquisition import LimitExceeded, open_bench, run_measurement
from vibench.acquisition.plan import Measurement
from vibench.analysis import Simulation, analyse_files, budgets_of

KINDS = ("dwell", "sweep", "steps")
WITHHELD = None


def make(folder: Path, count: int, seed: int, shard: tuple[int, int]) -> None:
    """Record one plan on each of ``count`` random rigs; a quarter are so weak that the motion is linear."""
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(shard[0] - 1, count, shard[1]):
        path = folder / f"r{number:04d}.h5"
        rng = np.random.default_rng((seed, number))
        rig, _ = random_rig(rng)
        plan = random_plan(rng, KINDS[number % len(KINDS)], is_weak=number // len(KINDS) % 4 == 0)
        while not path.exists():
            try:
                with open_bench(rig) as bench:
                    run_measurement(bench, Measurement(name="sound", excitation=plan, ramp_s=0.3), path)
            except LimitExceeded:
                path.unlink(missing_ok=True)
                path.with_name(f"{path.name}.part").unlink(missing_ok=True)
                plan = plan.model_copy(update={"amplitude_vpp": 0.5 * plan.amplitude_vpp})


def answers(path: Path) -> dict[str, float | str | None]:
    """Return relative expanded uncertainties and verdicts by quantity; None for withheld results."""
    done = analyse_files([path], "sound", Simulation.LEFT_OUT)
    if not done.results:
        return {"refused": str(done.failures)}
    (result,) = done.results
    said: dict[str, float | str | None] = {}
    for each in budgets_of(result):
        untold = {one.cause.value for one in each.contributions if one.relative is None}
        is_told = not untold & {"noise", "chance"} and np.isfinite(each.value)
        said[re.sub(r",? at .*", "", each.quantity)] = each.expanded / each.value if is_told else WITHHELD
    analysis = result.analysis
    if hasattr(analysis, "motion"):
        kind = analysis.motion.verdict.kind.value
        said["motion"] = WITHHELD if kind == "undecided" else kind
    if hasattr(analysis, "collisions"):
        said["collisions"] = "collides" if analysis.collisions.regions else "does not collide"
        if getattr(analysis.collisions, "too_fast_hz", ()):
            said["collisions"] = WITHHELD
    return said


def compare(before: dict[str, dict], after: dict[str, dict]) -> Iterator[str]:
    """Yield for each quantity the numbers of newly withheld and newly given results, and growth of bounds."""
    count: Counter[tuple[str, str]] = Counter()
    growth: dict[str, list[float]] = {}
    for name in sorted(before.keys() & after.keys()):
        old, new = before[name], after[name]
        for what, value in old.items():
            now = new.get(what, WITHHELD)
            if value is WITHHELD:
                count[what, "withheld in both" if now is WITHHELD else "told now"] += 1
            elif now is WITHHELD:
                count[what, "withheld now"] += 1
                yield f"{name}: {what} was {value}"
            elif isinstance(value, str):
                count[what, "same" if now == value else "other"] += 1
                if now != value:
                    yield f"{name}: {what} was {value}, is {now}"
            else:
                count[what, "same"] += 1
                growth.setdefault(what, []).append(now / value if value else 1.0)
    told = withheld = 0
    for what in sorted({each for each, _ in count}):
        mine = {word: number for (each, word), number in count.items() if each == what}
        told += sum(mine.values()) - mine.get("withheld in both", 0) - mine.get("told now", 0)
        withheld += mine.get("withheld now", 0)
        grown = growth.get(what)
        quantiles = np.quantile(grown, (0.5, 0.9, 1.0)) if grown else ()
        factor = f"; bounds grew by {', '.join(f'{each:.2f}' for each in quantiles)} (median, 90 %, largest)"
        yield f"{what}: {mine}{factor if grown else ''}"
    yield f"withheld now: {withheld} of {told} ({100 * withheld / max(told, 1):.1f} %)"


def main() -> None:
    """Record, analyse or compare, as requested."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("what", choices=("make", "answers", "compare"))
    parser.add_argument("paths", type=Path, nargs="+", metavar="PATH")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--shard", default="1/1", help="which part: 3/10 is the third of ten")
    parser.add_argument("--save", type=Path, metavar="FILE.json")
    asked = parser.parse_args()
    part, of = (int(each) for each in asked.shard.split("/"))
    if asked.what == "make":
        make(asked.paths[0], asked.count, asked.seed, (part, of))
    elif asked.what == "answers":
        is_begun = asked.save is not None and asked.save.exists()
        found = json.loads(asked.save.read_text("utf-8")) if is_begun else {}
        for path in sorted(asked.paths[0].glob("*.h5"))[part - 1 :: of]:
            if path.name not in found:
                found[path.name] = answers(path)
                if asked.save is not None:
                    asked.save.write_text(json.dumps(found), encoding="utf-8")
        print(json.dumps(found, indent=1) if asked.save is None else f"{len(found)} recordings answered")
    else:
        before, after = (json.loads(path.read_text("utf-8")) for path in asked.paths)
        print("\n".join(compare(before, after)))


if __name__ == "__main__":
    main()
