"""What the banner and the status line show of what the engine says."""

from datetime import datetime


def clock(seconds: float) -> str:
    """Write a time as people read it on a clock."""
    whole = max(0, round(seconds))
    hours, minutes = whole // 3600, whole // 60 % 60
    return f"{hours}:{minutes:02}:{whole % 60:02}" if hours else f"{minutes}:{whole % 60:02}"


def moment_text(utc: str) -> str:
    """Write when a recording began, by this machine's clock: ``"2026-03-01 13:00:05"``."""
    try:
        return datetime.fromisoformat(utc).astimezone().strftime("%Y-%m-%d %H:%M:%S")
    except ValueError:
        return utc
