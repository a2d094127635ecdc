"""Test that simulations with extreme parameters give finite numbers or one sentence of refusal, in time.

``python benchmarks/extremes.py --seed S --cases 150 [--shard 1/4] [--targets [COMMAND ...]]``. Each case
draws a specimen and a drive from the ranges below, writes the specimen as a file, and calls a command of
vibench. A prediction is correct when the exit code is 0 and the four responses and their error are finite. A
refusal is correct when the exit code is 1 and standard error has one sentence without a traceback. With
``--targets``, a case requests a computing time and perhaps an error, and must also end in time. Other
results are listed, and the script ends with exit code 1. A case that takes too long ends it at once.
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

ERRORS = ("1e-15", "1e-9", "1e-6", "0.1%", "1%", "10%", "99%")
TIMES_S = (1e-3, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
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
CELLS = (1, 2, 8, 30)
MASSES_KG = (5.8e-3, 2.1e-3, 2.0e-3)
SHOWN = 70
"""Number of letters shown of a refusal."""
STORED_S, DRAWN_S = 0.5, 2.0
"""Allowed time for the file of a study, and for the file and figure of a map [s]."""
LIMIT_S = 300
"""Longest time of one case [s]."""
TIMED = ("predict", "study", "map", "chain", "branches", "tradeoff")
"""Commands with a computing time limit."""
NUMBERS = ("response_i", "response_ii", "relative_i", "relative_ii", "error_estimate")


def targets(rng):
    """Return a random requested computing time, and mostly an error, by option name."""
    time_s = float(rng.choice(TIMES_S))
    return {"time": f"{time_s:g}s", **({"error": str(rng.choice(ERRORS))} if rng.random() < 0.8 else {})}


def draw_case(rng, folder, commands):
    """Draw a case and write its files; return the arguments of its command and its time limit [s]."""
    # Half of the commands with a time limit get the paper's masses, because many others are refused at once.
    factors = MASS_FACTORS if not commands or rng.random() < 0.5 else (1.0,)
    masses = [mass * float(rng.choice(factors)) for mass in MASSES_KG]
    stiffness, frequency_hz = float(rng.choice(STIFFNESSES)), float(rng.choice(FREQUENCIES_HZ))
    # At 0.001 Hz, one drive period lasts a hundred thousand cycles of the specimen.
    periods = int(rng.integers(2, MOST_PERIODS)) if frequency_hz >= 1.0 else 1
    specimen = folder / "specimen.toml"
    specimen.write_text(
        f'model = "gong2025"\nmasses_kg = {masses}\nhertz_stiffness = {stiffness}\n', encoding="utf-8"
    )
    command = str(rng.choice(commands)) if commands else "predict"
    options = {
        "specimen": str(specimen),
        "model": str(rng.choice(LAWS)).format(stiffness),
        "amplitude": str(rng.choice(AMPLITUDES_M)),
        "frequency": f"{frequency_hz:.6g}",
        "gap": str(rng.choice(GAPS_M[1:-1] if commands else GAPS_M)),
        "damping-time": str(rng.choice(DAMPING_TIMES_S)),
    }
    window = {"window": repr(max(1, periods // 2) / frequency_hz)}
    if not commands:
        level = str(rng.choice(LEVELS))
        options |= {**window, "duration": repr(periods / frequency_hz), "accuracy": level}
        return words_of(command, options), math.inf
    options |= targets(rng)
    limit_s = float(options["time"].removesuffix("s"))
    match command:
        case "study":
            return as_file(command, folder, options), limit_s + STORED_S
        case "map":
            return as_file(command, folder, options), 2.0 * limit_s + DRAWN_S
        case "branches":
            options["frequency"] = f"{frequency_hz:g}:{1.5 * frequency_hz:g}"
            options["method"] = "balance" if "error" in options else "shooting"
        case "chain":
            options["cells"] = str(rng.choice(CELLS))
        case "predict":
            options |= window
        case _:
            pass
    return words_of(command, options), limit_s


def words_of(command, options):
    """Return the arguments of a command with these options."""
    return (command, "--json", *(word for name, value in options.items() for word in (f"--{name}", value)))


def as_file(command, folder, options):
    """Write the file of a study of one point or a map of two, and return the arguments of its command."""
    amplitude_m = float(options["amplitude"])
    span = f"{{ start = {amplitude_m}, stop = {1.01 * amplitude_m}, points = 2 }}"
    one, axis = ("{}", span) if command == "map" else ("[{}]", f"[{amplitude_m}]")
    values = {
        "model": json.dumps(options["model"]),
        "frequency_hz": options["frequency"],
        "gap_m": options["gap"],
        "damping_time_s": options["damping-time"],
    }
    names = values if command == "map" else ("models", "frequencies_hz", "gaps_m", "damping_times_s")
    lines = [f"{name} = {one.format(value)}" for name, value in zip(names, values.values(), strict=True)]
    lines += [f"{'amplitude_m' if command == 'map' else 'amplitudes_m'} = {axis}"]
    lines += [f"specimen = {json.dumps(options['specimen'])}", f'time_s = "{options["time"]}"']
    lines += [f'error = "{options["error"]}"'] if "error" in options else []
    (folder / "plan.toml").write_text("\n".join(lines), encoding="utf-8")
    out = folder / ("found" if command == "map" else "found.h5")
    return (command, str(folder / "plan.toml"), "--json", "--workers", "1", "--out", str(out))


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


def complaint(words, late_s, code, out, err):
    """Return a description of the fault in a command's result; None if there is none."""
    said = [line for line in err.splitlines() if line.startswith("error:")]
    if "Traceback" in err or isinstance(code, str):
        return f"a traceback: {code} {err[-300:]}"
    if late_s > 0.0:
        return f"later than allowed by {late_s:.2f} s: {out[-300:]} {err[-300:]}"
    if code == 0 and words[0] == "predict":
        (point,) = json.loads(out, parse_constant=lambda word: word)["points"]
        wrong = [name for name in NUMBERS if not isinstance(point[name], float) or point[name] < 0.0]
        return f"exit code 0 with {', '.join(f'{name} {point[name]}' for name in wrong)}" if wrong else None
    if code not in (0, 1) or (code == 1 and len(said) not in (1, 2 if words[0] == "map" else 1)):
        return f"exit code {code} and {len(said)} sentences: {err[-300:]}"
    return None


def solve_case(seed, case, commands):
    """Draw a case and call its command; return the arguments, time limit and time [s], and the result."""
    with tempfile.TemporaryDirectory() as folder:
        words, limit_s = draw_case(np.random.default_rng([seed, case]), Path(folder), commands)
        # Print the case first, so that a case that hangs can be identified.
        print(f"case {case}: {' '.join(words)}", file=sys.stderr, flush=True)
        faulthandler.dump_traceback_later(LIMIT_S, exit=True)
        began_s, began_cpu_s = time.monotonic(), time.process_time()
        result = run_command(words)
        # On a busy machine, a command is late only if it also used too much processor time.
        took_s = min(time.monotonic() - began_s, time.process_time() - began_cpu_s)
        faulthandler.cancel_dump_traceback_later()
    return words, limit_s, took_s, result


def main():
    """Draw cases, call the command and check its results."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=2025)
    parser.add_argument("--cases", type=int, default=150)
    parser.add_argument("--shard", default="1/1", help="i/n: every nth case, from the ith")
    parser.add_argument("--targets", nargs="*", choices=TIMED, help="request errors and times")
    parser.add_argument("--only", type=int, help="one case")
    arguments = parser.parse_args()
    shard, shards = (int(part) for part in arguments.shard.split("/"))
    cases = range(shard - 1, arguments.cases, shards) if arguments.only is None else [arguments.only]
    commands = TIMED if arguments.targets == [] else arguments.targets
    answered, refused, wrong, longest_s = 0, Counter[str](), 0, 0.0
    for case in cases:
        words, limit_s, took_s, (code, out, err) = solve_case(arguments.seed, case, commands)
        late_s = max(LATE * limit_s, limit_s + LATE_S)
        if took_s > late_s:
            # The first call of a command includes the loading of modules; only a second late call counts.
            words, limit_s, took_s, (code, out, err) = solve_case(arguments.seed, case, commands)
        longest_s = max(longest_s, took_s)
        answered += code == 0
        refused.update([err.partition("error: ")[2][:SHOWN].strip()] if code == 1 else [])
        found = complaint(words, took_s - late_s, code, out, err)
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
