"""What a report says of each recording and of the bench it was made on."""

from collections.abc import Mapping
from datetime import datetime, timedelta
from typing import Any

from ..recordings.checks import Check
from ..recordings.facts import RecordingFacts
from ._page import ReportTable


def measured_table(facts: RecordingFacts) -> ReportTable:
    """Say what was played, when, and how it ended."""
    plan = facts.measurement
    reason = f": {facts.reason}" if facts.reason else ""
    rows = (
        ("excitation", excitation_text(plan.excitation.model_dump(mode="json"))),
        ("ramps", f"{plan.ramp_s:g} s, half cosine"),
        ("started", f"{facts.started_utc} UTC"),
        ("length", f"{facts.duration_s:.2f} s, {facts.sample_rate_hz:.6g} samples/s"),
        ("ended", f"{facts.state.value}{reason}"),
        ("file", f"{facts.path.name}, id {facts.recording_id}"),
        *((("notes", plan.notes),) if plan.notes else ()),
    )
    return ReportTable("Recording", (), rows)


def excitation_text(plan: Mapping[str, Any]) -> str:
    """Say a plan in one line, all its numbers included."""
    rest = [
        f"{key} = {value}" for key, value in plan.items() if key != "kind" and not isinstance(value, list)
    ]
    return f"{str(plan['kind']).replace('_', ' ')}: {', '.join(rest)}"


def bench_table(facts: RecordingFacts) -> ReportTable:
    """Say which bench it was, who answered, and what was confirmed by hand."""
    rows = [("bench", str(facts.bench.get("name", "not named")))]
    rows += [
        (part, f"{who.maker} {who.model}, serial {who.serial}, firmware {who.firmware}")
        for part, who in facts.instruments.items()
    ]
    rows += [(name, str(value)) for name, value in facts.confirmations.items()]
    rows += [
        (part, _named(facts.bench[part]))
        for part in ("amplifier", "shaker", "vibrometer", "accelerometer")
        if part in facts.bench
    ]
    specimen = facts.bench.get("specimen")
    if specimen:
        rows.append(
            (
                "specimen",
                ", ".join(
                    f"{k} = {_value(v)}" for k, v in specimen.items() if v is not None and k != "sources"
                ),
            )
        )
    rows.append(("bench check", bench_check_text(facts)))
    rate = f"{facts.sample_rate_hz:.6g} samples/s, {facts.requested_sample_rate_hz:.6g} asked for"
    rows.append(("sample rate", rate))
    return ReportTable("Bench", (), tuple(rows))


def bench_check_text(facts: RecordingFacts) -> str:
    """Say how the last check of the whole bench came out, how long before, and what it did not like."""
    check = facts.bench_check
    if not check:
        return "none"
    before = datetime.fromisoformat(facts.started_utc) - datetime.fromisoformat(str(check["checked"]))
    odd = [
        f"{each['name']} {each['value']} ({each['verdict']}; expected {each['expected']})"
        for each in check["findings"]
        if each["verdict"] != "ok"
    ]
    head = f"{check['verdict']}, {before / timedelta(hours=1):.1f} h before"
    return ": ".join([head, "; ".join(odd)]) if odd else head


def _named(part: Mapping[str, Any]) -> str:
    plain = [f"{key} = {value}" for key, value in part.items() if isinstance(value, (int, float))]
    head = f"{part.get('model', '')}, serial {part.get('serial') or 'not given'}"
    return ", ".join([head, *plain])


def _value(value: Any) -> str:
    match value:
        case {"value": number, "source": source}:
            return f"{number:g} ({source})"
        case _:
            return str(value)


_HEADINGS = "channel, input, sensor, serial, sensitivity, range, coupling, calibrated, delay"


def channel_table(facts: RecordingFacts) -> ReportTable:
    """Say how every channel was set and calibrated."""
    rows = tuple(
        (
            each.header.role.replace("_", " "),
            each.header.physical_channel,
            each.header.long_name,
            each.header.serial or "–",
            "–"
            if each.header.sensitivity is None
            else f"{each.header.sensitivity:.5g} {each.header.sensitivity_unit}",
            f"±{each.header.range_v:g} V",
            each.header.coupling,
            each.header.calibration_date or "–",
            f"{1e6 * each.header.delay_s:g} µs",
        )
        for each in facts.channels
    )
    return ReportTable("Channels", tuple(_HEADINGS.split(", ")), rows)


def version_table(facts: RecordingFacts) -> ReportTable:
    """Say which programs made the recording."""
    provenance = facts.provenance
    packages = ", ".join(f"{name} {which}" for name, which in dict(provenance.get("packages", {})).items())
    rows = (
        ("packages", packages),
        ("commit", str(provenance.get("commit") or "not from a checkout")),
        ("python", str(provenance.get("python", ""))),
        ("platform", str(provenance.get("platform", ""))),
    )
    return ReportTable("Versions that made the recordings", (), rows)


def check_table(checks: tuple[Check, ...]) -> ReportTable:
    """Verdict, what, and text of each check."""
    rows = tuple((each.verdict.value, each.what, each.text) for each in checks)
    return ReportTable("Checks", (), rows)
