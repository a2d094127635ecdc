"""Measure planned over actual processor time of predictions, while the cost ledger learns from them.

``python benchmarks/planned_costs.py --seed S --count 200 [--save FILE]`` draws random scenes of all contact
laws as `error_targets.py` does, plans and runs each, and learns from it. The plans are evaluated again after
all learned costs were doubled. An existing file is continued: its runs are learned from again.
"""

import argparse
import json
import math
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from error_targets import random_scene

from vibench.sim import StartMemory, plan_scene, solve_scene
from vibench.sim.scene.cost import CostLedger

LEARNING = 0.4
"""Share of scenes from which the ledger learns before plans are counted."""


def run_scene(seed, index, budget_s):
    """Plan and run one scene; return plain values."""
    law, scene = random_scene(seed, index)
    scene = replace(scene, budget_s=budget_s)
    plan = plan_scene(scene)
    began_s = time.thread_time()
    found = solve_scene(scene)
    taken_s = time.thread_time() - began_s
    is_lost = found.memory is StartMemory.LOST
    return {"scene": index, "law": law, "kind": plan.kind, "planned_s": plan.planned_s} | {
        "taken_s": taken_s,
        "is_lost": is_lost,
    }


def double(path):
    """Double every learned cost in a ledger's file."""
    kinds = json.loads(path.read_text(encoding="utf-8"))
    for each in kinds.values():
        each["mean"] += math.log(2.0)
    path.write_text(json.dumps(kinds), encoding="utf-8")


def ratios(ledger, rows):
    """Return planned over actual time of each run, planned from the runs before it, shape (runs,)."""
    found = []
    for row in rows:
        found.append(ledger.expected_time(row["kind"], row["planned_s"]).time_s / row["taken_s"])
        ledger.learn(row["kind"], row["planned_s"], row["taken_s"])
    return np.array(found)


def report(name, values):
    """Print how well the plans match the actual times."""
    within = np.mean((values > 0.5) & (values < 2.0))
    print(f"{name}: {len(values)} plans, median {np.median(values):.2f}, within a factor of 2 {within:.0%}")


def main():
    """Measure all scenes, then evaluate the plans with learned and with doubled costs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=77)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--budget", type=float, default=0.1, help="of a scene [s]: cheap ones")
    parser.add_argument("--save", type=Path, help="file of JSON lines; it is continued")
    given = parser.parse_args()
    is_there = given.save is not None and given.save.exists()
    rows = [json.loads(line) for line in given.save.read_text().splitlines()] if is_there else []
    for index in range(len(rows), given.count):
        rows.append(run_scene(given.seed, index, given.budget))
        if given.save is not None:
            with given.save.open("a") as file:
                file.write(json.dumps(rows[-1]) + "\n")
    first = round(LEARNING * len(rows))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "costs.json"
        ledger = CostLedger(path)
        ratios(ledger, rows[:first])
        report("learned", ratios(ledger, rows[first:]))
        ledger.save()
        double(path)
        report("after doubling", ratios(CostLedger(path), rows[first:]))
    for kind in ("touching", "free"):
        own = [row["is_lost"] for row in rows if f"/{kind}" in row["kind"]]
        print(f"{kind}: {sum(own)} of {len(own)} forgot their start")


if __name__ == "__main__":
    main()
