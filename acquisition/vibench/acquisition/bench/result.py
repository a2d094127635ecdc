"""Stored result of a bench check: findings, time, and the configuration that was checked."""

import hashlib
import json
from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum
from typing import Self

from pydantic import AwareDatetime, Field

from ..host.toml_file import FrozenModel
from ..rig import Rig


class Verdict(StrEnum):
    """Verdict on one finding of a bench check."""

    OK = "ok"
    WARN = "warn"
    """Warning: find the cause of the deviation, because measurements may be less accurate."""
    FAIL = "fail"
    """Failure: do not switch the drive on before the cause is removed."""


_ORDER = (Verdict.OK, Verdict.WARN, Verdict.FAIL)


class Finding(FrozenModel):
    """One result of a bench check."""

    name: str = Field(min_length=1)
    value: str
    """Measured value as text, with unit and uncertainty."""
    expected: str
    verdict: Verdict
    number: float | None = None
    """Measured value as a number in ``unit``; None if the value is only a text."""
    uncertainty: float | None = None
    """Standard uncertainty of the number, in ``unit``."""
    unit: str = ""
    advice: str = ""
    """Advice on what to do; empty if the finding is ok."""


@dataclass(frozen=True)
class Bounds:
    """Bounds on a deviation: ok up to ``well``, a warning up to ``fail``, and FAIL above ``fail``."""

    well: float
    fail: float

    def verdict(self, deviation: float) -> Verdict:
        """Return the verdict on a deviation; a NaN counts as FAIL."""
        if deviation <= self.well:
            return Verdict.OK
        return Verdict.WARN if deviation <= self.fail else Verdict.FAIL


def finding_of(
    name: str,
    number: float,
    unit: str,
    expected: str,
    verdict: Verdict,
    advice: str,
    uncertainty: float | None = None,
) -> Finding:
    """Return the finding for a measured number; it contains the advice only if the verdict is not ok."""
    spread = "" if uncertainty is None else f" +- {uncertainty:.1g}"
    return Finding(
        name=name,
        value=f"{number:.4g}{spread} {unit}".rstrip(),
        expected=expected,
        verdict=verdict,
        number=number,
        uncertainty=uncertainty,
        unit=unit,
        advice="" if verdict is Verdict.OK else advice,
    )


class BenchReport(FrozenModel):
    """All findings of a bench check."""

    findings: tuple[Finding, ...]

    @property
    def verdict(self) -> Verdict:
        """Worst verdict of the findings."""
        return max((finding.verdict for finding in self.findings), key=_ORDER.index, default=Verdict.OK)

    def __getitem__(self, name: str) -> Finding:
        """Return the finding ``name``; raises KeyError, whose text lists the existing names."""
        for finding in self.findings:
            if finding.name == name:
                return finding
        raise KeyError(f"no finding {name!r}; found: {', '.join(finding.name for finding in self.findings)}")

    def text(self) -> str:
        """Return the report as a table; advice stands below the line of its finding."""
        rows = [(f.verdict.upper(), f.name, f.value, f.expected) for f in self.findings]
        header = ("", "finding", "measured", "expected")
        widths = [max(len(row[column]) for row in (header, *rows)) for column in range(len(header))]
        lines = [_line(header, widths)]
        for row, finding in zip(rows, self.findings, strict=True):
            lines.append(_line(row, widths))
            if finding.advice:
                lines.append(f"{'':{widths[0]}}  -> {finding.advice}")
        return "\n".join(lines)


def _line(cells: tuple[str, ...], widths: list[int]) -> str:
    return "  ".join(f"{cell:{width}}" for cell, width in zip(cells, widths, strict=True)).rstrip()


_PACE = {"pace", "speed", "faults"}
"""Settings of a virtual rig that may change without a new bench check."""
_HOUR = timedelta(hours=1)
_DAY = timedelta(days=1)


class CheckResult(FrozenModel):
    """Findings of a bench check, with the data needed to decide whether the check is still valid."""

    rig: str
    """Name of the rig that was checked."""
    rig_digest: str
    """SHA-256 of the checked configuration; see `rig_digest`."""
    checked: AwareDatetime
    verdict: Verdict
    findings: tuple[Finding, ...]

    @classmethod
    def of(cls, rig: Rig, report: BenchReport, checked: datetime) -> Self:
        """Return the result to be stored for a report, with the name of the rig and the time of the check."""
        return cls(
            rig=rig.name,
            rig_digest=rig_digest(rig),
            checked=checked,
            verdict=report.verdict,
            findings=report.findings,
        )

    @property
    def report(self) -> BenchReport:
        """The findings of this check as a report."""
        return BenchReport(findings=self.findings)

    def age_h(self, now: datetime) -> float:
        """Return the time since the check [h]."""
        return (now - self.checked) / _HOUR


def rig_digest(rig: Rig) -> str:
    """Return the SHA-256 of a rig's configuration, except settings that may change without a new check."""
    content = rig.model_dump(mode="json", exclude={"check_valid_h": True, "virtual": _PACE})
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def age(age: timedelta) -> str:
    """Return an age as text: ``"3 hours"``, ``"2 days"``."""
    if age < 2 * _HOUR:
        return f"{max(age.total_seconds(), 0.0) / 60:.0f} minutes"
    return f"{age / _HOUR:.0f} hours" if age < 2 * _DAY else f"{age / _DAY:.0f} days"
