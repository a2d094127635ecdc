"""An export, called in another process: matplotlib and reports are loaded there, never by the window."""

from pathlib import Path

from vibench.analysis import ComparedRecording, Curve


def exported_elsewhere(
    path: Path,
    curves: tuple[Curve, ...],
    recordings: tuple[ComparedRecording, ...],
    pair: tuple[Curve, Curve] | None,
    markers_hz: tuple[float, ...],
) -> Path:
    """Write what the path's ending names, and give the path written, as `write_comparison` does."""
    from vibench.analysis.report import write_comparison  # noqa: PLC0415 - loading it takes most of a second

    return write_comparison(path, curves, recordings, pair, markers_hz)
