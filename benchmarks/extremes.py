"""Test that `vibench predict` gives finite numbers or one sentence of refusal for extreme parameters.

``python benchmarks/extremes.py --seed S --cases 150 [--shard 1/4] [--targets]``. Each case draws a specimen
and a drive from the ranges below, writes the specimen as a file, and calls ``vibench predict``. A prediction
is correct when the exit code is 0 and the four responses and their error are finite. A refusal is correct
when the exit code is 1 and standard error has one sentence without a traceback. Other results are listed, and
the script ends with exit code 1. A case that takes too long ends it at once.
"""

import argparse
import faulthandler
import json
import math
import resource
import sys
import tempfile
import time
import traceback
from collections import Counter
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np

from vibench.cli import main as vibench

ERRORS = ("1e-15", "1e-9", "1e-6", "0.1%", "1%", "10%", "100%")
TIMES_S = (1e-3, 1e-3, 0.1, 1.0, 3.0)
"""Requested times [s]."""
LATE, LATE_S = 1.5, 0.2
"""Allowed time: LATE times the requested time, or LATE_S longer, whichever is more [s]."""
AMPLITUDES_M = (1e-300, 1e-120, 1e-100, 1e-30, 1e-12, 1e-9, 1e-6, 1e-5, 1e-4, 1e-2, 1.0)
FREQUENCIES_HZ = (1e-3, 1.0, 94.6, 130.0, 266.0, 1e3, 1e4, 1e6)
MASS_FACTORS = (1e-9, 1e-6, 1e-3, 1.0, 1.0, 1.0, 1e3, 1e6, 1e9)
STIFFNESSES = (1e3, 1e6, 1e9, 1e12, 1e15)
GAPS_M = (0.0, 1e-12, 1e-9, 5e-6, 45e-6, 45e-6, 1e-2, 1.0, math.inf)
DAMPING_TIMES_S = (0.0, 0.0, 1e-9, 2e-5, 1e-2, 10.0)
LEVELS = ("quick", "standard", "reference")
LAWS = ("hertz", "linear", "linear_gap:{:g}", "rigid:0", "rigid:0.5", "rigid:1", "power:3", "power:47")
MOST_PERIODS = 40
MASSES_KG = (5.8e-3, 2.1e-3, 2.0e-3)
SHOWN = 70
"""Number of letters shown of a refusal."""
LIMIT_S = 300
"""Longest time of one case [s]."""
NUMBERS = ("response_i", "response_ii", "relative_i", "relative_ii", "error_estimate")


def targets(rng):
    """Return a random requested error and time, as options."""
    time = ("--time", f"{rng.choice(TIMES_S):g}s")
    return (*time, "--error", str(rng.choice(ERRORS))) if rng.random() < 0.8 else time


def draw_case(rng, folder, is_target):
    """Draw a case: write its specimen file, and return the arguments of its command."""
    masses = [mass * float(rng.choice(MASS_FACTORS)) for mass in MASSES_KG]
    stiffness, frequency_hz = float(rng.choice(STIFFNESSES)), float(rng.choice(FREQUENCIES_HZ))
    # At 0.001 Hz, one drive period lasts a hundred thousand cycles of the specimen.
    periods = int(rng.integers(2, MOST_PERIODS)) if frequency_hz >= 1.0 else 1
    specimen = folder / "specimen.toml"
    specimen.write_text(
        f'model = "gong2025"\nmasses_kg = {masses}\nhertz_stiffness = {stiffness}\n', encoding="utf-8"
    )
    return (
        *("predict", "--json", "--specimen", str(specimen)),
        *("--model", str(rng.choice(LAWS)).format(stiffness)),
        *("--amplitude", str(rng.choice(AMPLITUDES_M)), "--frequency", f"{frequency_hz:.6g}"),
        *("--gap", str(rng.choice(GAPS_M)), "--damping-time", str(rng.choice(DAMPING_TIMES_S))),
        *("--window", repr(max(1, periods // 2) / frequency_hz)),
        *(
            targets(rng)
            if is_target
            else ("--duration", repr(periods / frequency_hz), "--accuracy", str(rng.choice(LEVELS)))
        ),
    )


def run_command(words):
    """Call the command; return exit code, standard output and standard error."""
    out, err = StringIO(), StringIO()
    before = sys.argv
    sys.argv = ["vibench", *words]
    try:
        with redirect_stdout(out), redirect_stderr(err):
            vibench()
            code = 0
    except SystemExit as end:
        code = end.code or 0
    except Exception:  # noqa: BLE001 - whatever a user would see as a traceback is what is looked for
        code = traceback.format_exc()
    finally:
        sys.argv = before
    return code, out.getvalue(), err.getvalue()


def complaint(code, out, err):
    """Return a description of the fault in a command's result; None if there is none."""
    said = [line for line in err.splitlines() if line.startswith("error:")]
    if "Traceback" in err or isinstance(code, str):
        return f"a traceback: {code} {err[-300:]}"
    if code == 0:
        (point,) = json.loads(out, parse_constant=lambda word: word)["points"]
        late_s = lateness_s(point["target"])
        if late_s > 0.0:
            return f"later than allowed by {late_s:.2f} s: {point['target']}"
        wrong = [name for name in NUMBERS if not isinstance(point[name], float) or point[name] < 0.0]
        return f"exit code 0 with {', '.join(f'{name} {point[name]}' for name in wrong)}" if wrong else None
    if code != 1 or len(said) != 1:
        return f"exit code {code} and {len(said)} sentences: {err[-300:]}"
    return None


def lateness_s(target):
    """Return how much longer than allowed a prediction took [s]; zero without a requested time."""
    if target is None or target["wanted_time_s"] is None:
        return 0.0
    wanted_s = target["wanted_time_s"]
    return max(0.0, target["time_s"] - max(LATE * wanted_s, wanted_s + LATE_S))


def main():
    """Draw cases, call the command and check its results."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=2025)
    parser.add_argument("--cases", type=int, default=150)
    parser.add_argument("--shard", default="1/1", help="i/n: every nth case, from the ith")
    parser.add_argument("--targets", action="store_true", help="ask for errors and times")
    parser.add_argument("--only", type=int, help="one case")
    arguments = parser.parse_args()
    shard, shards = (int(part) for part in arguments.shard.split("/"))
    cases = range(shard - 1, arguments.cases, shards) if arguments.only is None else [arguments.only]
    answered, refused, wrong, longest_s = 0, Counter[str](), 0, 0.0
    for case in cases:
        with tempfile.TemporaryDirectory() as folder:
            words = draw_case(np.random.default_rng([arguments.seed, case]), Path(folder), arguments.targets)
            # Print the case first, so that a case that hangs can be identified.
            print(f"case {case}: {' '.join(words)}", file=sys.stderr, flush=True)
            faulthandler.dump_traceback_later(LIMIT_S, exit=True)
            began = time.process_time()
            code, out, err = run_command(words)
            longest_s = max(longest_s, time.process_time() - began)
            faulthandler.cancel_dump_traceback_later()
        answered += code == 0
        refused.update([err.partition("error: ")[2][:SHOWN].strip()] if code == 1 else [])
        found = complaint(code, out, err)
        if found is not None or arguments.only is not None:
            wrong += found is not None
            print(f"case {case}: {' '.join(words)}\n    {found or (code, err[-400:])}", flush=True)
    for sentence, count in refused.most_common():
        print(f"{count:4} refused: {sentence} ...")
    print(f"{answered} answered, {refused.total()} refused in a sentence, {wrong} wrong")
    most_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"longest {longest_s:.1f} s; most memory {most_mb:.0f} MB")
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
