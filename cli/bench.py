"""`vibench bench`: what is there, and is it well."""

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from acquisition.bench import open_bench
from acquisition.bench_list import list_instruments, list_rig_instruments
from acquisition.check.bench_report import check_bench
from acquisition.check.finding import Verdict
from acquisition.rig.configuration import load_rig

from .output import console, print_json
from .paths import AsJson, BenchPath, bench_path

bench = typer.Typer(help="Look at the instruments.", no_args_is_help=True)


@bench.command("list")
def list_bench(
    bench: Annotated[
        Path | None,
        typer.Option(
            "--bench", metavar="BENCH.toml", help="Search where this rig's are; this computer if absent."
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """List every instrument that can be seen, by name."""
    found = list_instruments() if bench is None else list_rig_instruments(load_rig(bench))
    devices = [f"{device.name}: {device.product}, serial {device.serial}" for device in found.daq_devices]
    if as_json:
        print_json({"visa": list(found.visa_resources), "daq": devices, "remarks": list(found.remarks)})
        return
    for title, lines in (("VISA", found.visa_resources), ("DAQ", devices), ("Remarks", found.remarks)):
        console.print(f"[bold]{title}[/]")
        for line in lines or ("none",):
            console.print(f"  {escape(line)}")


@bench.command("check")
def check(
    bench: BenchPath = None,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder that recordings would go to.")
    ] = Path(),
    as_json: AsJson = False,
) -> None:
    """Check the bench with a small sine: identities, noise, gains, clocks, disk. Exit code 1 if it fails."""
    with open_bench(bench_path(bench)) as opened:
        report = check_bench(opened, out)
    if as_json:
        print_json(report.model_dump(mode="json"))
    else:
        console.print(report.text(), markup=False, soft_wrap=True)
    if report.verdict is Verdict.FAIL:
        raise typer.Exit(1)
