"""Run NI's examples for nidaqmx-python unchanged on the virtual rig; list those that fail, with the error.

    git clone https://github.com/ni/nidaqmx-python
    python benchmarks/ni_examples.py nidaqmx-python

Each example runs in a separate process in real time, once with the simulated USB-4431 and once with the
USB-6211 in place of its devices. The script supplies what a person would: a connection, two edges on each of
the lines PFI0 and PFI8, Enter after some seconds, and Ctrl-C for examples that wait for it.
"""

import argparse
import builtins
import os
import runpy
import signal
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from collections import Counter
from dataclasses import replace
from pathlib import Path

import grpc
import nidaqmx
import nidaqmx.system
from nidaqmx import GrpcSessionOptions

from vibench.acquisition.rig import load_rig
from vibench.virtual_rig import VirtualRig
from vibench.virtual_rig.daqmx.devices import catalogue_with
from vibench.virtual_rig.daqmx.rig import WallPace
from vibench.virtual_rig.daqmx.server import DaqServer

PRODUCTS = ("USB-4431", "USB-6211")
PATIENCE_S = 15.0
ENTER_S = 4.0
EDGES_S = (1.5, 3.0)
RAN = "runs"
TOLD = "told: "
LONGEST_SENTENCE = 90


def catalogue(product: str):
    """Return a system in which Dev1 and Dev2 are this product, and cDAQ1Mod1 is an NI 9234."""
    usual = catalogue_with("USB-4431", "Dev1")
    one = next(device for device in usual.devices if device.product_type == product)
    chassis = [device for device in usual.devices if device.name.startswith("cDAQ")]
    return replace(usual, devices=(*chassis, replace(one, name="Dev1"), replace(one, name="Dev2")))


def connect(options: GrpcSessionOptions) -> None:
    """Connect tasks and systems without a named server to that of ``options``."""
    ours = nidaqmx.Task

    class Task(ours):
        def __init__(self, new_task_name: str = "") -> None:
            super().__init__(new_task_name, grpc_options=options)

    nidaqmx.Task = Task
    remote = nidaqmx.system.System.remote
    nidaqmx.system.System.local = staticmethod(lambda: remote(options))


def send_edges(server, began_s: float) -> None:
    """Send edges on the lines that examples wait for, then send Ctrl-C."""
    for moment_s in EDGES_S:
        time.sleep(max(0.0, began_s + moment_s - time.monotonic()))
        for line in ("/Dev1/PFI0", "/Dev1/PFI8"):
            server.edge(line)
    time.sleep(max(0.0, began_s + PATIENCE_S - time.monotonic()))
    os.kill(os.getpid(), signal.SIGINT)


def run_one(example: Path, product: str) -> None:
    """Run one example, and print its result as the last line."""
    os.environ["MPLBACKEND"] = "Agg"
    signal.signal(signal.SIGINT, signal.default_int_handler)  # because a background job of a shell ignores it
    warnings.filterwarnings("ignore", message="FigureCanvasAgg")
    world = VirtualRig(load_rig("virtual_rig_streaming")).world
    with (
        DaqServer(world, WallPace(), catalogue=catalogue(product)) as server,
        grpc.insecure_channel(server.address) as channel,
    ):
        connect(GrpcSessionOptions(channel, ""))
        builtins.input = lambda *_: time.sleep(ENTER_S) or ""
        threading.Thread(target=send_edges, args=(server, time.monotonic()), daemon=True).start()
        try:
            runpy.run_path(str(example), run_name="__main__")
            told = RAN
        except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001 - whatever an example ends with is told
            told = TOLD + sentence(error)
        print(f"\n{told}", flush=True)
        os._exit(0)  # at once, because an interrupted example may have left threads


def sentence(error: BaseException) -> str:
    """Return an error as one line: code, and first sentence or the call that is not simulated."""
    code = getattr(error, "error_code", None)
    text = " ".join(str(error).split())
    kept = text[text.index("Property:") :] if "Property:" in text else text
    return f"{'' if code is None else f'{int(code)}: '}{kept[:LONGEST_SENTENCE] or type(error).__name__}"


def outcome(example: Path, product: str) -> str:
    """Run an example in a new process and folder, and return its result."""
    with tempfile.TemporaryDirectory() as folder:
        words = [sys.executable, __file__, "--one", str(example.resolve()), "--product", product]
        try:
            done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False, timeout=120)
        except subprocess.TimeoutExpired as error:
            return f"{TOLD}did not end in {error.timeout:g} s"
    lines = done.stdout.strip().splitlines()
    return lines[-1] if lines and lines[-1].startswith((RAN, TOLD)) else f"{TOLD}{done.stderr[-200:]!r}"


def main() -> None:
    """Print a table of the examples that do not run on both products, and the number that do."""
    asked = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    asked.add_argument("checkout", type=Path, nargs="?")
    asked.add_argument("--only", default="", help="part of the names of the examples to run")
    asked.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    asked.add_argument("--product", choices=PRODUCTS, help=argparse.SUPPRESS)
    given = asked.parse_args()
    if given.one is not None:
        run_one(given.one, given.product)
    if given.checkout is None or not (given.checkout / "examples").is_dir():
        asked.error("give the folder of a checkout of nidaqmx-python, which has a folder 'examples'")
    root, ran = given.checkout / "examples", Counter()
    print("| example | " + " | ".join(PRODUCTS) + " |\n|---|" + "---|" * len(PRODUCTS))
    for example in sorted(each for each in root.rglob("*.py") if given.only in str(each)):
        told = {product: outcome(example, product) for product in PRODUCTS}
        ran.update(product for product, each in told.items() if each == RAN)
        if set(told.values()) != {RAN}:
            cells = " | ".join(each.removeprefix(TOLD) for each in told.values())
            print(f"| `{example.relative_to(root)}` | {cells} |", flush=True)
    print(f"\nThat run: {dict(ran)}")


if __name__ == "__main__":
    main()
