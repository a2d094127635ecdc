"""`vibench spectrum`: all Lyapunov exponents over frequency or level, with intervals, sum and dimension."""

from pathlib import Path
from typing import Annotated

from vibench.analysis import InvalidRequest
from vibench.analysis.dynamics import ExponentSpectrum, SpectrumRequest, spectrum_points, write_spectrum
from vibench.sim import Parameter

from .dynamics_answer import SHOWN, compute_parts, keep, leave, print_answer, room_for
from .options import Fields, RequestOptions, option
from .output import console
from .paths import AsJson
from .range_option import axis_fields, range_of
from .specimen_option import SPECIMEN, specimen_request

FILE = "spectrum.h5"
OPTIONS = (*SPECIMEN, "duration_s", "settle_s", "accuracy", "confidence")


def spectrum(
    amplitude: Annotated[str, option("Amplitude of the base displacement.", "M|START:STOP:STEP")],
    frequency: Annotated[str, option("One drive frequency or a range [Hz].", "F|START:STOP:STEP")],
    options: Annotated[RequestOptions[SpectrumRequest], Fields(OPTIONS)],
    out: Annotated[Path | None, option("Folder for spectrum.h5, figure and table.", "DIR")] = None,
    as_json: AsJson = False,
) -> None:
    """Compute all Lyapunov exponents over frequency or level, their sum, and the Kaplan-Yorke dimension."""
    a, f = range_of(amplitude, Parameter.AMPLITUDE, (1, 3)), range_of(frequency, Parameter.FREQUENCY, (1, 3))
    if a.stop is not None and f.stop is not None:
        raise InvalidRequest(
            "--amplitude and --frequency were both given as ranges; give one of them as one number"
        )
    drive = axis_fields(a, f) | {"step": a.step or f.step or 1.0}
    request = specimen_request(options, options.typed.get("specimen"), amplitude, None, **drive)
    from vibench.analysis.report import exponent_spectrum_figure

    room_for(FILE, out)
    points, elapsed_s, _ = compute_parts(spectrum_points(request), lambda _number, _point: None)
    is_complete = len(points) == len(request.values)
    found = ExponentSpectrum(request, points, elapsed_s)
    if as_json:
        print_answer(found.to_dict(), is_complete=is_complete)
    else:
        _print_result(found)
    if points:
        keep(
            out,
            lambda folder: write_spectrum(found, folder / FILE),
            lambda: exponent_spectrum_figure(found),
            is_path_printed=not as_json,
        )
    leave(is_complete=is_complete)


def _print_result(found: ExponentSpectrum) -> None:
    along = found.request.along
    console.print(f"All exponents [1/s] with {found.request.confidence:.0%} intervals: {found.request.title}")
    step = max(1, -(-len(found.points) // SHOWN))
    for each in found.points[::step]:
        place = (
            f"{each.frequency_hz:g} Hz" if along is Parameter.FREQUENCY else f"{1e6 * each.amplitude_m:g} µm"
        )
        six = ", ".join(
            f"{value:.4g} ± {0.5 * (high - low):.2g}"
            for value, low, high in zip(each.exponents_per_s, each.low_per_s, each.high_per_s, strict=True)
        )
        console.print(
            f"{place}: {six}; sum {each.sum_per_s:.9g}; dimension {each.dimension:.3g} "
            f"({each.dimension_low:.3g} to {each.dimension_high:.3g}); {each.observation}"
        )
    if step > 1:
        console.print(f"one in {step} points is shown (of {len(found.points)}); --json or --out gives all")
    console.print(found.cost_sentence)
