"""Facts of a recording as a JSON file next to its samples, for formats that cannot store them."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ._excerpt import Excerpt

SUFFIX = ".facts.json"


def facts_path(path: Path) -> Path:
    """Return the path of the facts file: ``NAME.csv.facts.json`` for ``NAME.csv``."""
    return path.with_name(path.name + SUFFIX)


def facts_document(excerpt: Excerpt) -> dict[str, Any]:
    """Return the facts of an excerpt; sample numbers count from the first sample of the recording."""
    recording = excerpt.recording
    return {
        "recording": excerpt.name,
        "recording_id": recording.recording_id,
        "started_utc": recording.started_utc,
        "origin": recording.origin.value,
        "state": recording.state.value,
        "reason": recording.reason,
        "sample_rate_hz": recording.sample_rate_hz,
        "first_sample": excerpt.start,
        "last_sample": excerpt.stop - 1,
        "channels": [
            {
                **asdict(each),
                "scale_factor": each.scale_factor,
                "add_offset": each.add_offset,
                "full_scale": abs(each.physical_per_volt) * each.range_v,
            }
            for each in excerpt.channels
        ],
        "segments": [asdict(each) for each in recording.segments],
        "events": [asdict(each) for each in recording.events],
        "overloads": [asdict(each) for each in recording.overloads],
        "gaps": [asdict(each) for each in recording.gaps],
        "plan": recording.plan,
        "bench": recording.bench,
        "instruments": {name: asdict(each) for name, each in recording.instruments.items()},
        "confirmations": recording.confirmations,
        "provenance": recording.provenance,
        "bench_check": recording.bench_check,
    }


def write_facts(excerpt: Excerpt, path: Path) -> None:
    """Write the facts as JSON."""
    text = json.dumps(facts_document(excerpt), indent=2, allow_nan=False, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")
