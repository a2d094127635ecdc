"""`vibench analyse`: analyse one recording or a folder, and write figures, tables and a report."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition import open_recording, save_toml
from vibench.analysis import (
    DRAWS,
    FEWEST_DRAWS,
    MOST_DRAWS,
    AnalysisError,
    AnalysisOptions,
    CampaignResults,
    FailedStep,
    InvalidRequest,
    MagnitudeScale,
    Parameter,
    Simulation,
    UpdatedSpecimen,
    analyse_files,
    budget_sentences,
    campaign_summary,
    merge_results,
    other_responses,
    parse_view,
    recordings_in,
    update_model,
)
from vibench.analysis.dynamics import read_diagram
from vibench.analysis.hidden_motion import HiddenMotion, hidden_motion, keep_hidden_motion, tracked_specimen
from vibench.sim import Specimen
from vibench.sim.background import Observer
from vibench.sim.maps import open_map

from .options import Fields, RequestOptions, option
from .output import ExitCode, bold, console, errors, print_json
from .paths import AllowExternal, AsJson, free_path, room_for_folder
from .progress_bars import reading_bar
from .scene_options import SpecimenOption, read_specimen


class DrivenBy(StrEnum):
    """Base motion or drive signal that the overlaid simulation uses as its input."""

    VOLTAGE = "voltage"
    BASE = "base"


NOISE = "Transmission of noise"
OPTIONS = ("estimator", "noise_ratio", "resolution_hz", "averages", "window", "overlap", "confidence")


def analyse(
    recording: Annotated[
        Path, typer.Argument(metavar="RECORDING.h5", help="A recording, or a folder of recordings.")
    ],
    out: Annotated[
        Path | None, option("Folder for the report; by default beside the recording.", "DIR")
    ] = None,
    simulate: Annotated[
        bool,
        option(
            "Overlay a simulation on the measurement; this takes seconds to minutes.",
            name="--simulate/--no-simulate",
        ),
    ] = True,
    driven_by: Annotated[
        DrivenBy,
        option(
            "voltage: simulate rig and specimen several times (also valid in chaos); base: simulate the "
            "specimen under the recorded base motion."
        ),
    ] = DrivenBy.VOLTAGE,
    draws: Annotated[
        int, option("Number of simulations of motions with contact.", "N", min=FEWEST_DRAWS, max=MOST_DRAWS)
    ] = DRAWS,
    fit: Annotated[
        bool,
        option(
            "Fit damping, frequencies and gaps to the recordings, and overlay the fitted specimen; if the "
            "fit fails, report which assumption to change."
        ),
    ] = False,
    free: Annotated[
        list[Parameter] | None,
        option("With --fit: also fit this parameter to noise tests; repeatable, one mass at most.", "NAME"),
    ] = None,
    hidden: Annotated[
        bool,
        option("Also estimate the hidden motion p of m1, impacts, gaps, the mass m1 and the contact law."),
    ] = False,
    keep: Annotated[
        bool, option("With --hidden: store the hidden motion in the recording, for vibench export --results.")
    ] = False,
    specimen: SpecimenOption = None,
    branches: Annotated[
        list[Path] | None,
        option(
            "Overlay branches (file of vibench branches) on stepped sines and sweeps; may be repeated.",
            "BRANCHES.h5",
        ),
    ] = None,
    maps: Annotated[
        list[Path] | None,
        option("Draw levels of stepped sines and sweeps on this map (vibench map).", "MAP.h5", name="--map"),
    ] = None,
    quantity: Annotated[
        str,
        option(
            "Quantity of m0 / quantity of the base, such as velocity/acceleration; one word applies to both.",
            "Q[/Q]",
            panel=NOISE,
        ),
    ] = "displacement",
    scale: Annotated[
        MagnitudeScale, option("Scale of magnitudes in figures.", panel=NOISE)
    ] = MagnitudeScale.LOG,
    segment: Annotated[
        float | None, option("Segment length of spectra, instead of a resolution.", "S", panel=NOISE)
    ] = None,
    *,
    options: Annotated[RequestOptions[AnalysisOptions], Fields(OPTIONS, NOISE)],
    _allow_external: AllowExternal = False,
    as_json: AsJson = False,
) -> None:
    """Analyse complete, interrupted or still growing recordings, and write one HTML report."""
    request = options.request().request
    request = replace(request, segment_s=segment, view=parse_view(quantity, scale))
    _require_partners(specimen, free, fit=fit, hidden=hidden, keep=keep)
    overlay = None if specimen is None else read_specimen(specimen).specimen()
    if hidden and overlay is not None:
        tracked_specimen(overlay)
    diagrams, opened_maps = (
        [read_diagram(each) for each in branches or ()],
        [open_map(each) for each in maps or ()],
    )
    under = Simulation.UNDER_VOLTAGE if driven_by is DrivenBy.VOLTAGE else Simulation.UNDER_BASE
    simulation = under if simulate else Simulation.LEFT_OUT
    paths = recordings_in(recording) if recording.is_dir() else (recording,)
    # The path "." has no name, so use the absolute path.
    place = recording if recording.name.strip(".") else recording.resolve()
    name = place.name.removesuffix(".part").removesuffix(".h5")
    folder = free_path(place.parent / f"{name}_analysis") if out is None else out
    has_report = out is not None or not as_json
    if has_report:
        room_for_folder(folder)
    with reading_bar() as observer:
        updated = fit_specimen(paths, name, observer, free or ()) if fit else None
        overlay = overlay if updated is None else updated.specimen
        results = analyse_files(paths, name, simulation, request, observer, overlay, draws)
        motions = list(hidden_motions(results, overlay, observer, is_kept=keep)) if hidden else []
        others = {
            role: analyse_files(
                having, f"{name}, {role}", Simulation.LEFT_OUT, request, observer, response=role
            )
            for role, having in other_responses(paths).items()
        }
    if updated is not None:
        results = replace(results, model_sentences=(updated := updated.confirm(results)).sentences)
    from vibench.analysis.report import write_report

    if as_json:
        fitted = {} if updated is None else {"specimen_fit": updated.to_dict()}
        motion_document = {"hidden_motion": {each.name: each.to_dict() for each in motions}} if hidden else {}
        further = {"responses": {role: campaign_summary(each) for role, each in others.items()}}
        print_json({**campaign_summary(results), **fitted, **motion_document, **(further if others else {})})
    else:
        _print_findings(results, motions, others)
    if results.results and has_report:
        place = free_path(folder / "report.html")
        report = write_report(results, place, folder / "figures", diagrams, motions, opened_maps)
        if not as_json:
            console.print("The report:", bold(report.resolve()))
        if updated is not None and updated.is_fitted:
            specimen_file = free_path(folder / "specimen.toml")
            save_toml(updated.description, specimen_file)
            if not as_json:
                console.print("The specimen:", bold(specimen_file.resolve()))
    if has_report:
        _write_reports(others, folder, as_json=as_json)
    complain_about(merge_results(name, (results, *others.values())))


def _require_partners(
    specimen: str | None, free: list[Parameter] | None, *, fit: bool, hidden: bool, keep: bool
) -> None:
    """Refuse options that exclude each other, and options without another option that they require."""
    if fit and specimen is not None:
        raise InvalidRequest(
            "--fit and --specimen were given; give only one of them, to select the overlaid specimen"
        )
    if free and not fit:
        raise InvalidRequest(
            f"--free {free[0].value} was given without --fit, which it needs; give both, or neither"
        )
    if keep and not hidden:
        raise InvalidRequest("--keep was given without --hidden, which it needs; give both, or neither")


def _print_findings(
    results: CampaignResults, motions: Sequence[HiddenMotion], others: Mapping[str, CampaignResults]
) -> None:
    from vibench.analysis.report import check_warnings, findings

    for sentence in (
        *findings(results),
        *(f"warning: {each}" for each in check_warnings(results)),
        *(s for each in motions for s in each.sentences),
        *budget_sentences(results),
        *(f"{role}: {text}" for role, each in others.items() for text in budget_sentences(each)),
    ):
        console.print(sentence)


def _write_reports(others: Mapping[str, CampaignResults], folder: Path, *, as_json: bool) -> None:
    """Write a further report for each channel except the channel of m0."""
    from vibench.analysis.report import write_report

    for role, results in others.items():
        if results.results:
            place = free_path(folder / f"report_{role}.html")
            report = write_report(results, place, folder / f"figures_{role}")
            if not as_json:
                console.print(f"The report of {role}:", bold(report.resolve()))


def hidden_motions(
    results: CampaignResults, specimen: Specimen | None, observer: Observer, *, is_kept: bool
) -> Iterator[HiddenMotion]:
    """Yield the estimated motion of m1 for each recording; print an error if the estimate fails."""
    for facts in results.facts:
        with open_recording(facts.path) as recording:
            try:
                motion = hidden_motion(recording, specimen, observer=observer)
                if is_kept:
                    keep_hidden_motion(recording, motion)
                yield motion
            except AnalysisError as error:
                errors.print(f"error: {facts.name}: no hidden motion: {error}")


def fit_specimen(
    paths: Sequence[Path], name: str, observer: Observer, also_free: Sequence[Parameter] = ()
) -> UpdatedSpecimen:
    """Return the specimen fitted to recordings; the fit does not depend on the report's options."""
    measured = analyse_files(paths, name, Simulation.LEFT_OUT, observer=observer)
    return update_model(measured, also_free, observer)


def complain_about(results: CampaignResults) -> None:
    """Print each failed analysis and simulation; exit with an error code if an analysis failed."""
    for failure in results.failures:
        word = "error" if failure.what is FailedStep.ANALYSIS else "note"
        errors.print(f"{word}: {failure.with_recording}")
    if any(failure.what is FailedStep.ANALYSIS for failure in results.failures):
        raise typer.Exit(ExitCode.FAILED)
