"""Single flipped bits in recordings: each is detected, or changes no result of the analysis.

Each flip is judged in a forked process: the file is refused, or its results are compared with those of the
intact file, bit for bit. Even numbers flip a bit of the whole file, odd numbers a bit outside the samples.
"""

import hashlib
import json
import os
import pickle
import random
import resource
import signal
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import h5py

from vibench.acquisition import RecordingError, open_recording
from vibench.analysis import AnalysisError, Simulation, analyse_files, campaign_summary

from .limits import HANGS_S, LONGEST_S, MOST_BYTES
from .recordings_corpus import good_recordings
from .tally import Finding, Shard, Tally

FINISHED = ("dwell.h5", "sweep.h5", "noise.h5", "with_result.h5", "recovered.h5")


@cache
def ranges_without_samples(name: str) -> tuple[range, ...]:
    """Return the byte ranges of a file that contain no samples."""
    content = good_recordings()[name]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, name)
        path.write_bytes(content)
        chunks: list[tuple[int, int]] = []
        with h5py.File(path) as file:
            for dataset in file.values():
                if isinstance(dataset, h5py.Dataset) and dataset.chunks:
                    found = [dataset.id.get_chunk_info(k) for k in range(dataset.id.get_num_chunks())]
                    chunks += [(each.byte_offset, each.byte_offset + each.size) for each in found]
    edges = [0, *(edge for chunk in sorted(chunks) for edge in chunk), len(content)]
    return tuple(
        range(start, stop) for start, stop in zip(edges[::2], edges[1::2], strict=True) if stop > start
    )


def flip_bit(number: int, chance: random.Random) -> tuple[str, int, bytes]:
    """Flip a bit; return the file name, the position, and the content."""
    name = chance.choice(FINISHED)
    data = bytearray(good_recordings()[name])
    if number % 2:
        parts = ranges_without_samples(name)
        place = chance.choice(chance.choices(parts, [len(each) for each in parts])[0])
    else:
        place = chance.randrange(len(data))
    data[place] ^= 1 << chance.randrange(8)
    return name, place, bytes(data)


def numbers_of(path: Path) -> str:
    """Return a checksum of all results of a recording, or the sentence that refuses it."""
    results = analyse_files((path,), "flips", Simulation.LEFT_OUT)
    if results.failures:
        return f"refused: {results.failures[0].sentence}"
    summary = campaign_summary(results)
    for each in summary["results"]:
        each["checks"] = [check for check in each["checks"] if check["what"] != "Seal"]
    try:
        with open_recording(path) as recording:
            saved = recording.results
    except RecordingError as error:
        return f"refused: {error}"
    arrays = [
        (name, key, array.values.tobytes())
        for name, each in saved.items()
        for key, array in each.arrays.items()
    ]
    content = [
        json.dumps(summary, sort_keys=True),
        arrays,
        [each.analysis.response for each in results.results],
    ]
    return hashlib.sha256(pickle.dumps(content)).hexdigest()


def verdict_of_file(path: Path) -> tuple[str, float, int]:
    """Return checksum or error of a file, processor time [s] and memory [bytes], from a forked process."""
    reading, writing = os.pipe()
    before_bytes = resident_bytes()
    number = os.fork()
    if number == 0:
        os.close(reading)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        signal.alarm(round(2 * HANGS_S))
        try:
            said = numbers_of(path)
        except (AnalysisError, RecordingError) as error:
            said = f"refused: {error}"
        except BaseException as error:
            said = f"traceback: {type(error).__name__}: {error}"
        os.write(writing, said.encode()[:4000])
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as pipe:
        said = pipe.read().decode()
    _, status, usage = os.wait4(number, 0)
    if os.WIFSIGNALED(status):
        said = f"died: signal {os.WTERMSIG(status)}"
    # A forked process begins with the memory of its parent, for example of a whole test run.
    return said, usage.ru_utime + usage.ru_stime, max(0, usage.ru_maxrss * 1024 - before_bytes)


def resident_bytes() -> int:
    """Return the resident memory of this process [bytes]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize()


def faults(said: str, expected: str, took_s: float, peak_bytes: int) -> tuple[str, ...]:
    """Return the faults of an outcome."""
    found: list[tuple[str, bool]] = [
        (said[:300], said.startswith(("traceback", "died"))),
        (
            "other numbers, unnoticed",
            said[:9] not in {"refused: ", "traceback", "died: sig"} and said != expected,
        ),
        (f"took {took_s:.1f} s", took_s > LONGEST_S),
        (f"took {peak_bytes / 1e6:.0f} MB", peak_bytes > MOST_BYTES),
    ]
    return tuple(text for text, is_so in found if is_so)


def attack(shard: Shard) -> Tally:
    """Flip bits."""
    tally = shard.tally("flips")
    with tempfile.TemporaryDirectory(prefix="vibench_flips_") as folder:
        expected: dict[str, Any] = {}
        for name, content in good_recordings().items():
            path = Path(folder, name)
            path.write_bytes(content)
            if name in FINISHED:
                numbers_of(path)  # modules imported and compiled here are available in every fork
                expected[name] = verdict_of_file(path)[0]
                if expected[name].startswith(("refused", "traceback", "died")):
                    raise RuntimeError(f"{name} should be good, and was {expected[name]}")
        for number, chance in shard.chances(tally):
            name, place, content = flip_bit(number, chance)
            path = Path(folder, name)
            path.write_bytes(content)
            said, took_s, peak_bytes = verdict_of_file(path)
            kind = "noticed" if said.startswith("refused") else "same numbers"
            if found := faults(said, expected[name], took_s, peak_bytes):
                kind = "found"
                tally.findings.append(
                    Finding("flips", shard.seed, number, (f"{name} byte {place}", *found), said[-300:])
                )
            tally.count(kind, took_s, peak_bytes)
    return tally
