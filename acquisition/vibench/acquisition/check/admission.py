"""Admission of a bench to measurements, which requires a recent passed check of the same configuration.

The last check of each rig is stored as a JSON file in the user's state folder. The next check reports how the
gains (in decibels) and the clock (in ppm) have changed since then.
"""

import hashlib
import re
from collections.abc import Callable
from datetime import UTC, datetime
from enum import StrEnum
from math import inf, log10
from pathlib import Path

from pydantic import ValidationError

from vibench.sim.operating_system.this import replace_file, state_folder

from ..bench import (
    Bench,
    BenchKind,
    BenchReport,
    Bounds,
    CheckResult,
    Finding,
    Verdict,
    age,
    finding_of,
    rig_digest,
)
from ..errors import CheckFailed, RecordingError
from ..rig import Rig
from ..stopping.stop import StopSwitch
from .bench_report import bench_report
from .loop import DRIVE_LEFT, LASTING, Lasting


class CheckRule(StrEnum):
    """Rule for the bench check that is required before measurements."""

    FRESH = "fresh"
    """A check of the same configuration must have passed within the last ``check_valid_h`` hours."""
    NOW = "now"
    """A new check of the bench must pass before the measurement."""
    WAIVED = "waived"
    """No check is required; recordings contain the result of the last check, if any."""


FOLDER = "bench_checks"
_HASH_DIGITS = 8


def archive_path(rig_name: str, *, passed: bool = False) -> Path:
    """Return the path of a rig's last check; the file name contains the rig's name and a hash of the name.

    With ``passed``, return the path of the last check that did not fail.
    """
    plain = re.sub(r"[^A-Za-z0-9]+", "_", rig_name).strip("_")[:48]
    digest = hashlib.sha256(rig_name.encode()).hexdigest()[:_HASH_DIGITS]
    return state_folder() / FOLDER / f"{plain}-{digest}{'.passed' if passed else ''}.json"


def last_check(rig_name: str) -> CheckResult | None:
    """Return the last check of a rig; None if the check is missing, or if this version cannot read it.

    ``rig_name`` is the name in the hardware configuration.
    """
    return _read(archive_path(rig_name))


def last_passed_check(rig: Rig) -> CheckResult | None:
    """Return the last check without FAIL of a rig's current configuration; None if there is no such check."""
    for each in (_read(archive_path(rig.name, passed=True)), last_check(rig.name)):
        if each and each.verdict is not Verdict.FAIL and each.rig_digest == rig_digest(rig):
            return each
    return None


def _read(path: Path) -> CheckResult | None:
    try:
        return CheckResult.model_validate_json(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, ValidationError):
        return None


def keep(result: CheckResult) -> None:
    """Store a result atomically in place of the last result.

    Raises RecordingError when the state folder cannot be written.
    """
    if result.verdict is not Verdict.FAIL:
        _write(result, passed=True)
    _write(result, passed=False)


def _write(result: CheckResult, *, passed: bool) -> None:
    try:
        path = archive_path(result.rig, passed=passed)
        path.parent.mkdir(parents=True, exist_ok=True)
        with replace_file(path) as coming:
            coming.write_text(result.model_dump_json(indent=2), encoding="utf-8")
    except OSError as error:
        raise RecordingError(
            f"The result of the bench check cannot be saved as {error.filename} ({error.strerror}). The "
            "bench is unchanged; make that folder writable, or set VIBENCH_STATE_DIR to another folder"
        ) from error


DRIFT_DB = Bounds(0.5, 3.0)
"""Bounds on the drift of a gain between two checks of an unchanged configuration [dB]."""
CLOCK_PPM = Bounds(20.0, inf)
"""Bounds on the drift of the ratio of the two clocks [ppm]; oscillators age by a few ppm per year."""
_DECIBELS, _PPM = "dB", "ppm"
_ADVICE = (
    "the configuration has not changed: look for a changed knob, a bad cable, a loose sensor or a failing "
    "amplifier; if you changed something that is not in the configuration, run one check as the new "
    "reference (menu Test, or vibench bench check --new-reference)"
)


def drift(now: BenchReport, last: CheckResult, at: datetime) -> tuple[Finding, ...]:
    """Return findings on the changes of levels and clock since the last check.

    Both checks used the same sine level, because the configuration is the same.
    """
    before = {finding.name: finding for finding in last.findings}
    since = f"in {age(at - last.checked)}"
    found = [
        _change(finding, before[finding.name], since) for finding in now.findings if finding.name in before
    ]
    return tuple(finding for finding in found if finding is not None)


def _change(now: Finding, before: Finding, since: str) -> Finding | None:
    kind = LASTING.get(now.name)
    if kind is None or now.number is None or before.number is None:
        return None
    change, unit, bounds = now.number - before.number, _DECIBELS, DRIFT_DB
    if kind is Lasting.CLOCK:
        unit, bounds = _PPM, CLOCK_PPM
    elif kind is Lasting.LEVEL:
        if min(now.number, before.number) <= 0:
            return None
        change = 20 * log10(now.number / before.number)
    expected = f"0 {unit} within {bounds.well:g} {unit}"
    finding = finding_of(
        f"{now.name} since last time", change, unit, expected, bounds.verdict(abs(change)), _ADVICE
    )
    return finding.model_copy(update={"value": f"{change:+.2f} {unit} {since}"})


Clock = Callable[[], datetime]


def utc_now() -> datetime:
    """Return the present time in UTC by the computer's clock."""
    return datetime.now(UTC)


def check_bench(
    bench: Bench,
    folder: Path,
    clock: Clock = utc_now,
    switch: StopSwitch | None = None,
    *,
    new_reference: bool = False,
) -> CheckResult:
    """Check a bench, compare it with its last passed check, and store the result; see `bench_report`.

    Parameters
    ----------
    bench
        The open bench.
    folder
        Folder for recordings; the free space of its disk is checked.
    clock
        Function that returns the current time.
    switch
        Switch by which another thread can stop the check.
    new_reference
        Whether to skip the comparison with the last passed check, and so accept all changes since that check.
    """
    report, at = bench_report(bench, folder, switch), clock()
    last = None if new_reference else last_passed_check(bench.rig)
    if last is not None:
        report = BenchReport(findings=(*report.findings, *drift(report, last, at)))
    result = CheckResult.of(bench.rig, report, at)
    keep(result)
    bench.last_check = result
    return result


def require_fresh(
    bench: Bench,
    folder: Path,
    rule: CheckRule = CheckRule.FRESH,
    clock: Clock = utc_now,
    switch: StopSwitch | None = None,
) -> CheckResult | None:
    """Admit a bench to measurements by its last check or a new check; return this check for the recordings.

    A virtual rig without a valid check is checked at once; a real bench is checked only if ``rule`` is NOW. A
    rig that plays back a recording needs no check. ``bench`` must not be sampling; ``folder`` is for the
    recordings; another thread can stop the new check with ``switch``.

    Raises CheckFailed when the last check is missing, too old, failed or made for another configuration (then
    nothing was played), or when the new check fails. Raises InstrumentError when an instrument fails.
    """
    if bench.rig.plays_back:
        return None
    if rule is CheckRule.WAIVED:
        bench.last_check = last_check(bench.rig.name)
        return bench.last_check
    if rule is CheckRule.FRESH:
        complaint = _complaint_about_last_check(bench, clock())
        if complaint is None:
            return bench.last_check
        if bench.kind is BenchKind.REAL:
            raise CheckFailed(
                f"{complaint}. Nothing was played; run 'vibench bench check --bench FILE', or measure with "
                "'--check now', or skip the check with '--check waived'"
            )
    result = check_bench(bench, folder, clock, switch)
    if result.verdict is Verdict.FAIL:
        raise CheckFailed(
            f"the bench {result.rig!r} did not pass its check: {_failures(result)}. {_output_after(result)} "
            "fix what 'vibench bench check' reports, and check again"
        )
    return result


def require_on_record(bench: Bench) -> None:
    """Admit a bench by its last check without playing anything; a virtual bench needs no check.

    Raises CheckFailed when a real bench has no valid check.
    """
    if bench.rig.plays_back:
        return
    complaint = _complaint_about_last_check(bench, utc_now())
    if complaint is not None and bench.kind is BenchKind.REAL:
        raise CheckFailed(f"{complaint}. Nothing was armed; check the bench first")


def _complaint_about_last_check(bench: Bench, now: datetime) -> str | None:
    """Admit a bench by its last check, or return the reason why the check is not valid."""
    last = last_check(bench.rig.name)
    complaint = why_not(last, bench.rig, now)
    if complaint is None:
        bench.last_check = last
    return complaint


def why_not(last: CheckResult | None, rig: Rig, now: datetime) -> str | None:
    """Return the reason why a check is not valid for a rig; None if the check is valid."""
    if last is None:
        return f"the bench {rig.name!r} was never checked under this user account"
    when = f"the last check of {rig.name!r}, at {last.checked:%Y-%m-%d %H:%M %Z},"
    if last.rig_digest != rig_digest(rig):
        return f"{when} was made with another configuration"
    if not 0 <= last.age_h(now) <= rig.check_valid_h:
        return f"{when} is {last.age_h(now):.1f} h old; {rig.check_valid_h:g} h are allowed (check_valid_h)"
    if last.verdict is Verdict.FAIL:
        return f"{when} did not pass: {_failures(last)}"
    return None


def _output_after(result: CheckResult) -> str:
    """Return a clause that states whether the output was measured to be off."""
    left = next((each for each in result.findings if each.name == DRIVE_LEFT), None)
    if left is None or left.verdict is Verdict.FAIL:
        return "THE OUTPUT MAY STILL BE ON: switch the amplifier off by hand, then"
    return "The output is off;"


def _failures(result: CheckResult) -> str:
    failed = [finding for finding in result.findings if finding.verdict is Verdict.FAIL]
    return "; ".join(f"{each.name} is {each.value}, expected {each.expected}" for each in failed)
