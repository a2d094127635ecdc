"""A report states the result, the age and the warnings of the last bench check."""

from types import SimpleNamespace

import pytest

from vibench.analysis.report._report import bench_check_text

STARTED = "2026-05-04T12:30:00+00:00"
BEFORE = "before this recording"
GOOD = {"name": "amplifier gain", "value": "10 dB", "expected": "10 dB within 1 dB", "verdict": "ok"}
ODD = {
    "name": "base acceleration since last time",
    "value": "-0.80 dB in 2 days",
    "expected": "0 dB within 0.5 dB",
    "verdict": "warn",
}


@pytest.mark.parametrize(
    ("check", "said"),
    [
        ({}, "none"),
        ({"checked": "2026-05-04T09:00:00Z", "verdict": "ok", "findings": [GOOD]}, f"ok, 3.5 h {BEFORE}"),
        (
            {"checked": "2026-05-04T12:00:00Z", "verdict": "warn", "findings": [GOOD, ODD]},
            f"warn, 0.5 h {BEFORE}: {ODD['name']} -0.80 dB in 2 days (warn; expected 0 dB within 0.5 dB)",
        ),
    ],
)
def test_the_report_states_the_last_bench_check_in_one_line(check, said):
    assert bench_check_text(SimpleNamespace(bench_check=check, started_utc=STARTED)) == said
