"""What has changed since the last check of the same bench: gains in decibels, the clock in ppm."""

from datetime import datetime
from math import inf, log10

from ..bench import BenchReport, Bounds, CheckResult, Finding, ago, judged

DRIFT_DB = Bounds(0.5, 3.0)
"""Of a gain, from one check to the next on an unchanged configuration."""
CLOCK_PPM = Bounds(20.0, inf)
"""Of the ratio of two clocks: oscillators age by some ppm a year."""
SUFFIX = " since last time"
_DECIBELS, _PPM = "dB", "ppm"
_ADVICE = (
    "nothing in the configuration has changed: look for a knob, a cable, a loose sensor or a dying amplifier"
)


def drift(now: BenchReport, last: CheckResult, at: datetime) -> tuple[Finding, ...]:
    """Compare every level of a check with the same of the last one.

    The sine is equally loud in both, since the configuration is the same: whoever calls has seen to that.
    """
    before = {finding.name: finding for finding in last.findings}
    since = f"since {ago(at - last.checked)}"
    found = [
        _changed(finding, before[finding.name], since) for finding in now.findings if finding.name in before
    ]
    return tuple(finding for finding in found if finding is not None)


def _changed(now: Finding, before: Finding, since: str) -> Finding | None:
    if now.number is None or before.number is None or SUFFIX in now.name:
        return None
    match _quantity(now):
        case "gain in dB":
            return _judged(now.name, now.number - before.number, _DECIBELS, DRIFT_DB, since)
        case "level" if now.number > 0 and before.number > 0:
            change_db = 20 * log10(now.number / before.number)
            return _judged(now.name, change_db, _DECIBELS, DRIFT_DB, since)
        case "clock":
            return _judged(now.name, now.number - before.number, _PPM, CLOCK_PPM, since)
        case _:
            return None


def _quantity(finding: Finding) -> str:
    if finding.name in ("drive over setting", "base acceleration") or finding.name.endswith("hears the sine"):
        return "level"
    return {"amplifier gain": "gain in dB", "drive's clock": "clock"}.get(finding.name, "")


def _judged(name: str, change: float, unit: str, bounds: Bounds, since: str) -> Finding:
    finding = judged(
        f"{name}{SUFFIX}",
        change,
        unit,
        f"0 {unit} within {bounds.well:g} {unit}",
        bounds.verdict(abs(change)),
        _ADVICE,
    )
    return finding.model_copy(update={"value": f"{change:+.2f} {unit} {since}"})
