"""May this bench be armed? Only on a check that is recent, passed, and of the same configuration."""

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import assert_never

from ..bench import Bench, BenchReport, CheckResult, Reality, Verdict, rig_digest
from ..errors import CheckFailed
from ..rig import Rig
from ..stopping import StopSwitch
from ._archive import keep, last_result
from ._bench_report import check_bench
from ._drift import drift
from ._rule import CheckRule

Clock = Callable[[], datetime]


def utc_now() -> datetime:
    """Tell the computer's time."""
    return datetime.now(UTC)


def check_and_keep(
    bench: Bench, folder: Path, clock: Clock = utc_now, switch: StopSwitch | None = None
) -> CheckResult:
    """Check a bench, compare with the last time, and keep the result for later; see `check_bench`."""
    report, at = check_bench(bench, folder, switch), clock()
    last = last_result(bench.rig.name)
    if last is not None and last.rig_digest == rig_digest(bench.rig):
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
    """Admit a bench to be armed, on its last check or on one made now; recordings then carry the result.

    A virtual rig without a check that holds is checked at once; a real one plays nothing unasked.

    Parameters
    ----------
    bench
        Open, and not sampling.
    folder
        Where recordings will go.
    switch
        Lets others end a check that is made now.

    Raises
    ------
    CheckFailed
        When the last check is missing, old, of another configuration, or did not pass; nothing was
        played then. Or when the check made now does not pass.
    InstrumentError
        When an instrument fails while the bench is checked.

    """
    match rule:
        case CheckRule.WAIVED:
            bench.last_check = last_result(bench.rig.name)
            return bench.last_check
        case CheckRule.NOW:
            return _passed(check_and_keep(bench, folder, clock, switch))
        case CheckRule.FRESH:
            return _fresh(bench, folder, clock, switch)
        case _:
            assert_never(rule)


def _fresh(bench: Bench, folder: Path, clock: Clock, switch: StopSwitch | None) -> CheckResult:
    last = last_result(bench.rig.name)
    complaint = why_not(last, bench.rig, clock())
    if last is not None and complaint is None:
        bench.last_check = last
        return last
    match bench.reality:
        case Reality.SIMULATED:
            return _passed(check_and_keep(bench, folder, clock, switch))
        case Reality.REAL:
            raise CheckFailed(
                f"{complaint}. Nothing was played; check it with 'vibench bench check' or --check now, or go "
                "on without with --check waived"
            )


def require_on_record(bench: Bench, clock: Clock = utc_now) -> None:
    """Admit a bench on its last check without playing anything; a virtual one needs none.

    Raises
    ------
    CheckFailed
        When a real bench has no check that holds.

    """
    last = last_result(bench.rig.name)
    complaint = why_not(last, bench.rig, clock())
    if complaint is None:
        bench.last_check = last
    elif bench.reality is Reality.REAL:
        raise CheckFailed(f"{complaint}. Nothing was armed; check the bench first")


def why_not(last: CheckResult | None, rig: Rig, now: datetime) -> str | None:
    """Say why a check does not hold for a rig, in one clause; None when it does."""
    if last is None:
        return f"the bench {rig.name!r} was never checked on this account"
    when = f"the last check of {rig.name!r}, at {last.checked:%Y-%m-%d %H:%M %Z},"
    if last.rig_digest != rig_digest(rig):
        return f"{when} was of another configuration"
    if not 0 <= last.age_h(now) <= rig.check_valid_h:
        return f"{when} is {last.age_h(now):.1f} h old, {rig.check_valid_h:g} h are allowed (check_valid_h)"
    if last.verdict is Verdict.FAIL:
        return f"{when} did not pass: {_failures(last)}"
    return None


def _passed(result: CheckResult) -> CheckResult:
    if result.verdict is Verdict.FAIL:
        raise CheckFailed(
            f"the bench {result.rig!r} did not pass its check: {_failures(result)}. The output is off; "
            "put right what 'vibench bench check' advises, and check again"
        )
    return result


def _failures(result: CheckResult) -> str:
    failed = [finding for finding in result.findings if finding.verdict is Verdict.FAIL]
    return "; ".join(f"{each.name} is {each.value}, expected {each.expected}" for each in failed)
