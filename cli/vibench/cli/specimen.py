"""`vibench specimen`: list specimens and contact laws, or describe one specimen."""

import math
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition import schema_line, shipped_folder, toml_text
from vibench.analysis import InvalidRequest
from vibench.sim import CONTACT_LAWS, Specimen, shipped_specimens
from vibench.sim.study import plausibility_warnings

from .options import option
from .output import bold, console, paragraph, print_json, print_warnings
from .paths import AsJson, room_for_folder
from .scene_options import read_specimen


def show_specimen(
    specimen: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME|FILE.toml", help="Shipped specimen or a file; by default, list all specimens."
        ),
    ] = None,
    forces: Annotated[
        Path | None,
        option("Draw the stop force over p = y - z, for the specimen or for every contact law.", "DIR"),
    ] = None,
    as_toml: Annotated[bool, option("Print the whole file, as a template.", name="--toml")] = False,
    as_json: AsJson = False,
) -> None:
    """List the specimens and contact laws, or describe one specimen."""
    if forces is not None:
        _draw(specimen, forces)
        return
    if specimen is None and as_toml:
        raise InvalidRequest(
            f"--toml was given without a specimen; give a file, or one of {', '.join(shipped_specimens())}"
        )
    if specimen is None:
        _list(as_json)
        return
    table = read_specimen(specimen)
    facts = figures_of(table.specimen())
    print_warnings(plausibility_warnings((), table.specimen().gaps_m))
    if as_json:
        gaps_m = [gap_m if math.isfinite(gap_m) else str(gap_m) for gap_m in table.specimen().gaps_m]
        print_json({**table.model_dump(mode="json", exclude_none=True), **facts, "gaps_m": gaps_m})
    elif as_toml:
        console.print(paragraph(schema_line(table, shipped_folder("schemas")) + toml_text(table)), end="")
    else:
        console.print(": ".join(filter(None, (table.name, table.about))))
        for name, value in facts.items():
            console.print(f"  {_heading(name)}: {_text(value)}")


def figures_of(specimen: Specimen) -> dict[str, object]:
    """Return quantities computed from a specimen: stiffnesses, resonances, damping ratios."""
    return {
        "masses_kg": specimen.masses,
        "stiffnesses_n_per_m": specimen.stiffnesses,
        "dampings_ns_per_m": specimen.dampings,
        "resonances_without_contact_hz": specimen.natural_frequencies_hz.tolist(),
        "damping_ratios": specimen.damping_ratios.tolist(),
        "resonances_with_m1_held_hz": specimen.bound_frequencies_hz.tolist(),
        "gaps_m": specimen.gaps_m,
        "contact_law": asdict(specimen.contact),
    }


def _draw(specimen: str | None, folder: Path) -> None:
    from vibench.analysis.report import contact_forces_figure

    table = read_specimen(specimen)
    laws = [each.example for each in CONTACT_LAWS.values()] if specimen is None else [table.contact]
    drawn = contact_forces_figure({law: table.specimen(law) for law in laws})
    room_for_folder(folder)
    console.print("The forces of the stops:", bold(drawn.save(folder)[0]))


def _list(as_json: bool) -> None:
    specimens = {name: each.about for name, each in shipped_specimens().items()}
    laws = {law.form: law.about for law in CONTACT_LAWS.values()}
    if as_json:
        print_json({"specimens": specimens, "contact_laws": laws})
        return
    for title, rows in (("Specimens (--specimen)", specimens), ("Contact laws (--model)", laws)):
        console.print(title)
        for name, about in rows.items():
            console.print(f"  {name:42} {about}")


_UNITS = {"_kg": "kg", "_ns_per_m": "N s/m", "_n_per_m": "N/m", "_hz": "Hz", "_m": "m"}


def _heading(name: str) -> str:
    """Return the table heading for a quantity's name in code: ``"gaps [m]"`` for ``gaps_m``."""
    ending = next((each for each in _UNITS if name.endswith(each)), "")
    words = name.removesuffix(ending).replace("_", " ")
    return f"{words} [{_UNITS[ending]}]" if ending else words


def _text(value: object) -> str:
    match value:
        case {"kind": kind, **numbers}:
            return ", ".join([str(kind), *(f"{name} {_text(each)}" for name, each in numbers.items())])
        case list() | tuple():
            return ", ".join(f"({_text(each)})" if isinstance(each, tuple) else _text(each) for each in value)
        case float():
            return f"{value:.6g}"
        case _:
            return str(value)
