"""An export, called in another process: matplotlib and reports are loaded there, never by the window."""

from pathlib import Path

from vibench.analysis import ComparedRecording, Trace


def exported_elsewhere(
    path: Path,
    traces: tuple[Trace, ...],
    recordings: tuple[ComparedRecording, ...],
    pair: tuple[Trace, Trace] | None,
    markers_hz: tuple[float, ...],
) -> Path:
    """Write what the path's ending names, and give the path written, as `exported` does."""
    from vibench.analysis.report import exported  # noqa: PLC0415 - loading it takes most of a second

    return exported(path, traces, recordings, pair, markers_hz)
