"""`vibench serve-rig`: the virtual instruments, for other programs."""

import signal
import threading
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from vibench.acquisition.rig import TOKEN_KEY, TOKEN_VARIABLE

from .options import option
from .output import bold, console
from .paths import FaultsPath, rig_at

if TYPE_CHECKING:
    from vibench.virtual_rig import VirtualRig


class ServedPace(StrEnum):
    """Speed at which a served virtual rig runs, relative to real time."""

    WALL = "wall"
    FREE = "free"


def serve_rig(
    bench: Annotated[Path | None, option("Hardware configuration with a table 'virtual'.", "BENCH")] = None,
    address: Annotated[
        str, option("Address at which the rig is served; other computers need a token.", "HOST:PORT")
    ] = "127.0.0.1:31763",
    scpi_port: Annotated[int, option("Socket port of the generator; 0 selects a free port.", "N")] = 0,
    pace: Annotated[
        ServedPace, option("Run the rig in real time, or as fast as a program reads samples.")
    ] = ServedPace.WALL,
    faults: FaultsPath = None,
) -> None:
    """Serve the virtual rig to programs that use pyvisa or nidaqmx, until Ctrl-C is pressed."""
    from vibench.virtual_rig import DiskFaults, VirtualRig

    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    served = rig_at(bench, faults)
    if served.virtual is not None:
        served = served.model_copy(update={"virtual": served.virtual.model_copy(update={"pace": pace.value})})
    with VirtualRig(served, address, scpi_port=scpi_port, disk=DiskFaults.REFUSED) as rig:
        console.print(bold(rig.rig.name), "is on. Stop it with Ctrl-C.")
        console.print()
        for title, lines in _rig_hints(rig):
            console.print(title)
            for line in lines:
                console.print(f"  {line}")
        if rig.token is not None:
            console.print()
            console.print("Other computers can reach the rig; they need the token:")
            console.print(
                f"  export {TOKEN_VARIABLE}={rig.token}  # for vibench; other programs send it as metadata"
            )
            console.print(f"  {TOKEN_KEY}: {rig.token}")
        stop.wait()
    console.print("The virtual rig is off.")


def _rig_hints(rig: "VirtualRig") -> tuple[tuple[str, tuple[str, ...]], ...]:
    opened = 'pyvisa.ResourceManager("@py").open_resource'
    usb = f"from vibench.virtual_rig import plug_in_remote; plug_in_remote({rig.daq_address!r})"
    ends = r'read_termination="\n", write_termination="\n"'
    return (
        (
            "The converter, for nidaqmx:",
            (
                "import grpc, nidaqmx",
                f'options = nidaqmx.GrpcSessionOptions(grpc.insecure_channel("{rig.daq_address}"), "")',
                "task = nidaqmx.Task(grpc_options=options)",
            ),
        ),
        (
            "The generator, for pyvisa in Python:",
            (usb, "import pyvisa", f'generator = {opened}("{rig.visa_resource}")'),
        ),
        (
            f"The generator at {rig.socket_resource}, for other programs (end each line with a newline):",
            ("import pyvisa", f'generator = {opened}("{rig.socket_resource}", {ends})'),
        ),
    )
