"""`vibench catalogue`, `verify`, `pack`, `export` and `import`: recordings as files."""

import math
import shlex
from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition import load_toml, open_recording
from vibench.acquisition.campaign import CatalogueEntry, Refresh, list_recordings, verify_recordings
from vibench.acquisition.recording import SealDepth, SealState, seal_key
from vibench.analysis import (
    FrequencyResponseRequest,
    InvalidRequest,
    MagnitudeScale,
    parse_view,
    recordings_in,
    scan_files,
    spectral_functions,
)
from vibench.analysis.exchange import (
    CrateFacts,
    Format,
    ImportMapping,
    Results,
    excerpt,
    export_functions,
    export_samples,
    import_recording,
    open_source,
    pack_folder,
)
from vibench.sim import count_text

from .options import option
from .output import ExitCode, console, errors, print_json, print_warnings
from .paths import AllowExternal, AsJson, file_at
from .progress_bars import transfer_bar

COLUMNS = ("recording", "started (UTC)", "excitation", "level", "frequency", "length", "size", "verdict")


def show_catalogue(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of recordings.")],
    rebuild: Annotated[bool, option("Read all files again, not only the changed ones.")] = False,
    _allow_external: AllowExternal = False,
    as_json: AsJson = False,
) -> None:
    """List the recordings of a folder and its subfolders: excitation, date, outcome, size."""
    entries = list_recordings(folder, Refresh.ALL if rebuild else Refresh.CHANGED)
    if as_json:
        print_json({"folder": str(folder.resolve()), "recordings": [asdict(each) for each in entries]})
    elif entries:
        rows = [COLUMNS, *(_row(each) for each in entries)]
        widths = [max(len(row[column]) for row in rows) for column in range(len(COLUMNS))]
        for row in rows:
            line = "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))
            console.print(line.rstrip())
    else:
        console.print(f"{folder} contains no recordings")
    for each in entries:
        if each.is_bad:
            where = "" if each.path in each.reason else f"{each.path}: "
            errors.print(f"error: {where}{each.reason}")
    if any(each.is_bad for each in entries):
        raise typer.Exit(ExitCode.FAILED)


def _row(entry: CatalogueEntry) -> tuple[str, ...]:
    return (
        entry.path,
        entry.started_utc[:19].replace("T", " "),
        entry.kind.replace("_", " "),
        "" if entry.amplitude_vpp is None else f"{entry.amplitude_vpp:g} Vpp",
        _band(entry),
        "" if entry.duration_s is None else f"{entry.duration_s:.1f} s",
        f"{entry.size_bytes / 1e6:.1f} MB",
        entry.verdict,
    )


def _band(entry: CatalogueEntry) -> str:
    low_hz, high_hz = entry.frequency_low_hz, entry.frequency_high_hz
    if low_hz is None:
        return ""
    return f"{low_hz:g} Hz" if low_hz == high_hz else f"{low_hz:g} to {high_hz:g} Hz"


def verify(
    place: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder of recordings, or one recording, NAME.h5.")
    ],
    quick: Annotated[bool, option("Check only attributes, texts and tables, not every sample.")] = False,
    key: Annotated[
        Path | None,
        option("Key file of the signatures; by default the file named by VIBENCH_SEAL_KEY.", "FILE"),
    ] = None,
    _allow_external: AllowExternal = False,
    as_json: AsJson = False,
) -> None:
    """Check the seals of all recordings and journals in a folder, including every sample."""
    found = verify_recordings(place, SealDepth.QUICK if quick else SealDepth.WHOLE, seal_key(key))
    counts = Counter(each.verdict for each in found)
    if as_json:
        print_json(
            {
                "place": str(place.resolve()),
                "depth": "quick" if quick else "whole",
                "counts": dict(counts),
                "recordings": [asdict(each) | {"is_bad": each.is_bad} for each in found],
            }
        )
    else:
        for each in found:
            console.print(f"{each.verdict:10}  {each.path}: {each.sentence}")
        summary = [f"{count} {verdict}" for verdict, count in counts.items()] or ["no recordings"]
        console.print(", ".join([*summary, "samples not checked"] if quick else summary))
    bad = [each for each in found if each.is_bad]
    if bad:
        named = ", ".join(each.path for each in bad)
        errors.print(f"error: {len(bad)} of {len(found)} recordings cannot be trusted: {named}")
        raise typer.Exit(ExitCode.FAILED)


def pack(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder with recordings and other files.")],
    licence: Annotated[
        str, option("Licence, such as https://creativecommons.org/licenses/by/4.0/.", "URL", name="--license")
    ],
    out: Annotated[
        Path | None, option("Path of the new file or of its folder; default: DIR.zip by DIR.", "CRATE.zip")
    ] = None,
    author: Annotated[list[str] | None, option("Author; may be repeated.", "NAME")] = None,
    title: Annotated[str, option("Title of the package; by default the name of the folder.")] = "",
    description: Annotated[str, option("Description of the data in one or two sentences.")] = "",
    organisation: Annotated[str, option("Publisher, and the authors' affiliation.", "NAME")] = "",
    organisation_url: Annotated[str, option("Publisher's home page, or https://ror.org/...", "URL")] = "",
    as_json: AsJson = False,
) -> None:
    """Pack a folder of recordings as a Research Object Crate for a data repository."""
    here = folder.resolve()
    # Do not use with_suffix: a folder's name may contain a dot, such as "0.5Vpp".
    crate = file_at(out, here.parent / f"{here.name}.zip")
    facts = CrateFacts(licence, tuple(author or ()), title, description, organisation, organisation_url)
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    found = verify_recordings(folder, key=seal_key())
    untrusted = {
        each.path: f"{each.verdict.replace('_', ' ')}: {each.sentence}" for each in found if each.is_bad
    }
    with transfer_bar("pack", size) as observer:
        packed = pack_folder(folder, crate, facts, untrusted, observer)
    console.print(f"packed {count_text(len(packed), 'file')} into {crate}")
    unfinished = [each.path for each in found if each.verdict == SealState.UNFINISHED]
    if as_json:
        print_json(
            {"crate": str(crate), "files": len(packed), "unfinished": unfinished, "untrusted": untrusted}
        )
    for name in unfinished:
        errors.print(f"note: {name} is not finished and was omitted; vibench recover finishes it")
    for name, why in untrusted.items():
        way = "the crate notes this; restore the file and pack again, or deposit the crate as it is"
        errors.print(f"error: {name} cannot be trusted ({why.rstrip('.')}): {way}")
    if untrusted:
        raise typer.Exit(ExitCode.FAILED)


def export(
    recording: Annotated[
        Path,
        typer.Argument(
            metavar="RECORDING.h5",
            help="Recording, complete or still growing; or the folder of a scan, with --to uff --spectra.",
        ),
    ],
    to: Annotated[Format, option("Format of the new file.")],
    out: Annotated[
        Path | None, option("Path of the new file or of its folder; by default beside the recording.", "PATH")
    ] = None,
    channels: Annotated[str, option("Channels, separated by commas; by default all.", "NAMES")] = "",
    from_s: Annotated[float | None, option("Start [s]; first sample at 0.", "S", name="--from")] = None,
    to_s: Annotated[float | None, option("End [s]; first sample at 0.", "S", name="--until")] = None,
    results: Annotated[bool, option("Also export results stored in the recording.")] = False,
    spectra: Annotated[
        bool,
        option(
            "Export spectra instead of samples (uff): spectral densities of the channels, and, for noise, "
            "also the frequency response."
        ),
    ] = False,
    quantity: Annotated[
        str | None,
        option("With --spectra: quantity as in 'vibench analyse'; by default displacement."),
    ] = None,
    _allow_external: AllowExternal = False,
    as_json: AsJson = False,
) -> None:
    """Write a recording's samples or spectra, with units, to a file for other programs."""
    if quantity is not None and not spectra:
        raise InvalidRequest("--quantity was given without --spectra, which it needs; give both, or neither")
    if recording.is_dir():
        if not spectra or to is not Format.UFF or channels or results or (from_s, to_s) != (None, None):
            raise InvalidRequest(
                f"{recording} is a folder; give a recording (vibench catalogue lists them). The folder "
                "of a scan is exported by --to uff --spectra, with --out and --quantity if needed"
            )
        place = recording.resolve()
        request = FrequencyResponseRequest(view=parse_view(quantity or "displacement", MagnitudeScale.LOG))
        path = file_at(out, place / f"{place.name}.uff")
        _report_files(tuple(scan_files(recordings_in(recording), request, path)), as_json=as_json)
        return
    with open_recording(recording) as opened:
        chosen = excerpt(
            opened, tuple(each.strip() for each in channels.split(",")) if channels else (), from_s, to_s
        )
        seal = opened.check_seal(SealDepth.QUICK)
        if seal.state not in (SealState.INTACT, SealState.UNFINISHED):
            print_warnings([f"{recording.name}: {seal.sentence}"])
        path = file_at(out, recording.with_name(f"{chosen.name}.{to.value}"))
        if spectra:
            view = parse_view(quantity or "displacement", MagnitudeScale.LOG)
            functions = spectral_functions(chosen, FrequencyResponseRequest(view=view))
            written = export_functions(chosen, functions, to, path)
        else:
            included = Results.INCLUDED if results else Results.LEFT_OUT
            with transfer_bar(f"export as {to.value}", chosen.values) as observer:
                written = export_samples(chosen, to, path, included, observer)
    _report_files(written, as_json=as_json)


def _report_files(written: tuple[Path, ...], *, as_json: bool) -> None:
    for each in written:
        console.print(f"wrote {each}")
    if as_json:
        print_json({"files": [str(each) for each in written]})


def import_file(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="UFF, HDF5, MATLAB, TDMS, WAV or CSV file.")],
    mapping: Annotated[
        Path | None, option("File that maps the channels; without it, the channels are listed.", "MAP.toml")
    ] = None,
    out: Annotated[
        Path | None, option("Path of the new recording or of its folder; by default beside FILE.", "NAME.h5")
    ] = None,
    _allow_external: AllowExternal = False,
    as_json: AsJson = False,
) -> None:
    """Convert another program's file to a recording, or list its contents."""
    if mapping is None:
        if out is not None:
            raise InvalidRequest(f"{out} cannot be written without a mapping; give --mapping MAP.toml")
        _print_contents(file, as_json)
        return
    meaning = load_toml(mapping, ImportMapping)
    with open_source(file) as source:
        longest = max(each.samples for each in source.channels)
    target = file_at(out, file.with_suffix(".h5"))
    with transfer_bar("import", longest * len(meaning.channels)) as observer:
        made = import_recording(file, meaning, target, observer)
    with open_recording(made) as recording:
        print_warnings(recording.bench["imported"]["time"])
    if as_json:
        print_json({"recording": str(made)})
    else:
        console.print(f"wrote {made}; next: vibench analyse {shlex.quote(str(made))}")


def _print_contents(file: Path, as_json: bool) -> None:
    with open_source(file) as source:
        channels = source.channels
    if as_json:
        print_json({"file": str(file), "channels": [asdict(each) for each in channels]})
        return
    for each in channels:
        low, high = each.rates_hz
        rate = ""
        if each.sample_rate_hz is not None:
            rate = f", {each.sample_rate_hz:.9g} samples/s"
        elif math.isfinite(high):
            rate = f", about {(low + high) / 2:.5g} samples/s"
        unit = f", {each.unit}" if each.unit else ""
        label = f" ({each.label})" if each.label else ""
        console.print(f"{each.name!r}{label}: {each.samples} samples{rate}{unit}")
    console.print("Describe the channels in a mapping (docs/exchange.md), and give its file with --mapping.")
