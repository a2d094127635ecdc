"""`vibench map`: map the kinds of motion over one or two parameters."""

from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition import file_path, load_toml
from vibench.analysis import InvalidRequest, recorded_response
from vibench.analysis.dynamics import (
    BranchDiagram,
    map_caption,
    motion_words,
    read_diagram,
    specimen_difference,
)
from vibench.analysis.report import SHOWN, ImageKind
from vibench.sim import Observable, Parameter
from vibench.sim.maps import (
    KickStability,
    Map,
    MapResults,
    Range,
    UncertaintyExponent,
    estimate_map,
    kick_stability,
    solve_map,
    uncertainty_exponent,
)
from vibench.sim.study import ExistingStudy, plausibility_warnings

from .options import option
from .output import bold, console, print_json, print_warnings
from .paths import AllowExternal, AsJson, room_for_folder
from .progress_bars import study_bar, watch_interrupt
from .scene_options import Cluster, Workers, complain_about_points

FILE = "map.h5"
SHOWN_MOTIONS = 12


def map_motions(
    plan: Annotated[
        Path,
        typer.Argument(
            metavar="MAP", help="TOML file of the parameters, or a shipped name: map, basin, diagram."
        ),
    ],
    out: Annotated[Path, option("Folder for map.h5, figure and table.", "DIR")],
    resume: Annotated[bool, option("Compute the points missing in DIR/map.h5.")] = False,
    workers: Workers = None,
    cluster: Cluster = None,
    only_estimate: Annotated[
        bool, option("Print the number of points, the time and the size; compute nothing.", name="--estimate")
    ] = False,
    show: Annotated[
        str | None, option(f"Quantity drawn with the kinds of motion: {', '.join(SHOWN)}.", "QUANTITY")
    ] = None,
    branches: Annotated[
        Path | None, option("Overlay computed branches on a one-parameter map.", "BRANCHES.h5")
    ] = None,
    like: Annotated[
        list[Path] | None, option("Overlay level and responses of a recording on the map.", "RECORDING.h5")
    ] = None,
    kicks: Annotated[
        int, option("For maps of initial states: number of kicks of each size to each motion.", "N", min=0)
    ] = 0,
    _allow_external: AllowExternal = False,
    as_json: AsJson = False,
) -> None:
    """Map the motions over two parameters or two start coordinates, or along one parameter."""
    request = load_toml(file_path(plan, "studies/maps"), Map)
    gaps_m = request.specimen.specimen().gaps_m if request.gap_m is None else _ends(request.gap_m)
    print_warnings(plausibility_warnings(_ends(request.amplitude_m), gaps_m))
    if show not in (None, *SHOWN):
        raise InvalidRequest(f"--show was given as {show!r}; give one of {', '.join(SHOWN)}")
    if kicks:
        request.require_kicks_allowed()
    if show == Observable.LYAPUNOV and Observable.LYAPUNOV not in request.observe:
        raise InvalidRequest(
            "--show lyapunov needs a map with exponents, but this map has observe = "
            f'{", ".join(request.observe)}; give observe = ["response", "lyapunov"]'
        )
    if like and not request.is_over_drive:
        raise InvalidRequest(
            "--like needs a map over frequency_hz and amplitude_m; give ranges for these two"
        )
    diagram = None if branches is None else _branches_along(request, branches)
    if only_estimate:
        estimate = estimate_map(request, workers)
        print_json(estimate.to_dict()) if as_json else console.print(estimate.sentence)
        return
    room_for_folder(out)
    levels = [recorded_response(path) for path in like or ()]
    print_warnings(each.difference(request.scene((0, 0, 0)).specimen) for each in levels)
    out.mkdir(parents=True, exist_ok=True)
    existing = ExistingStudy.RESUME if resume else ExistingStudy.REFUSE
    with watch_interrupt() as is_stopped, study_bar(request.grid.size) as observer:
        results = solve_map(request, out / FILE, existing, workers, cluster, observer, is_stopped)
    stability = kick_stability(results, kicks=kicks, workers=workers) if kicks and results.is_complete else ()
    from vibench.analysis.report import map_figure

    drawn = map_figure(results, show, diagram, levels).save(out, (ImageKind.PNG, ImageKind.SVG))
    if as_json:
        print_json(document(results, stability, out / FILE))
    else:
        print_result(results, stability)
        console.print("The figure:", bold(drawn[0].resolve()))
    complain_about_points(request, list(results.failures()), results.done)


def _branches_along(request: Map, path: Path) -> BranchDiagram:
    """Return branches to overlay; refuse another parameter, and warn of another drive or specimen."""
    diagram, scene = read_diagram(path), request.scene((0, 0, 0))
    theirs, along = diagram.request, diagram.request.along
    if [each.axis for each in request.varying] != [along]:
        raise InvalidRequest(
            f"--branches {path} contains branches over {along}; give a map with a range of {along} only"
        )
    drive = scene.drive.frequency_hz, scene.drive.amplitude_m
    varied = drive[0] if along is Parameter.FREQUENCY else drive[1]
    if theirs.resonance_band_hz is not None or theirs.path.drive(varied) != drive:
        print_warnings([f"the drive of the map differs from the drive of the branches ({theirs.title})"])
    print_warnings([specimen_difference(scene.specimen, theirs.chosen_specimen, path.name)])
    return diagram


def _ends(given: float | Range) -> tuple[float, ...]:
    return (given.start, given.stop) if isinstance(given, Range) else (given,)


def print_result(results: MapResults, stability: tuple[KickStability, ...]) -> None:
    """Print a map's caption and motions; for initial states, add the basin boundary and effects of kicks."""
    console.print(map_caption(results))
    for number, motion in enumerate(results.motions[:SHOWN_MOTIONS]):
        console.print(f"{number}: {motion_words(results, motion)}")
    if len(results.motions) > SHOWN_MOTIONS:
        console.print(f"{len(results.motions) - SHOWN_MOTIONS} rarer motions are in the table and in --json.")
    if results.plan.is_basin:
        console.print(_boundary_words(results))
    for each in stability:
        console.print(
            f"Motion {each.motion}, kicked by {each.size:g} gaps: returns after {each.returned.share:.0%} "
            f"({each.returned.low:.0%} to {each.returned.high:.0%}) of the kicks"
        )


def _boundary_words(results: MapResults) -> str:
    unknown = "The uncertainty exponent is not determined:"
    if len(results.plan.varying) == 1:
        return f"{unknown} ranges for two coordinates of the initial state are needed."
    rough = _roughness(results)
    if rough is None:
        return f"{unknown} too few or too many initial states are near a boundary."
    return (
        f"The uncertainty exponent of the boundary is {rough.exponent:.2f} ({rough.low:.2f} to "
        f"{rough.high:.2f}), so the boundary's dimension is {2.0 - rough.exponent:.2f}."
    )


def _roughness(results: MapResults) -> UncertaintyExponent | None:
    is_plane = results.plan.is_basin and len(results.plan.varying) == 2
    return uncertainty_exponent(results.motion_numbers[:, 0]) if is_plane else None


def document(results: MapResults, stability: tuple[KickStability, ...], file: Path) -> dict[str, object]:
    """Return a summary of a map as a JSON document; the HDF5 file contains the points."""
    audit = results.audit
    rough = _roughness(results)
    return {
        "file": str(file),
        "points": results.plan.grid.size,
        "computed": results.points,
        "is_complete": results.is_complete,
        "audit": None if audit is None else _values(audit, "filled audited wrong"),
        "motions": [
            {
                **_values(each, "motion period has_impacts response_i response_ii"),
                "share": each.share.share,
                "share_low": each.share.low,
                "share_high": each.share.high,
            }
            for each in results.motions
        ],
        "uncertainty_exponent": None if rough is None else _values(rough, "exponent low high steps"),
        "kicks": [
            {"motion": each.motion, "size": each.size, "returned": each.returned.share} for each in stability
        ],
        "failures": [{**where, "message": why} for where, why in results.failures()],
        "map": results.plan.model_dump(mode="json"),
    }


def _values(part: object, names: str) -> dict[str, object]:
    return {name: getattr(part, name) for name in names.split()}
