"""Test whether the engine keeps up in real time, with a frozen viewer and all cores busy.

    python benchmarks/engine_under_load.py [MINUTES]

An unattended engine records 4 x 51.2 kS/s from the virtual rig in real time; as on the real device, samples
that are read too late are lost. One viewer repeatedly requests ten seconds of samples and never reads the
answers. One busy process runs per core. The script prints the missing samples and the gaps that the recording
flags.
"""

import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

from time_to_silence import busy

from vibench.acquisition import open_recording
from vibench.acquisition.engine import EngineClient, EngineState, Supervision, start_engine
from vibench.acquisition.engine._verbs import VERBS
from vibench.acquisition.engine._wire import send
from vibench.acquisition.plan import Campaign
from vibench.acquisition.rig import load_rig

RIG = Path(__file__).parent.parent / "hardware_configs" / "virtual_rig.toml"


def campaign(duration_s: float) -> Campaign:
    """Return a campaign of one dwell with impacts."""
    dwell = {"kind": "dwell", "amplitude_vpp": 1.5, "frequency_hz": 260, "duration_s": duration_s}
    return Campaign.model_validate({"name": "load", "measurements": [{"name": "dwell", "excitation": dwell}]})


def frozen_viewer(stack: ExitStack, client: EngineClient) -> None:
    """Send requests without reading the answers, until the connection's buffers are full."""
    connection = client._connection  # noqa: SLF001 - a viewer that misbehaves must go behind the client's back
    connection.setblocking(False)  # noqa: FBT003 - the name is the socket's
    stack.callback(client.close)
    try:
        while True:
            send(connection, VERBS["look"].message(most=512_000))
    except BlockingIOError:
        return


def main() -> None:
    """Record for some minutes and print what is missing."""
    minutes = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    rig = load_rig(RIG)
    assert rig.virtual is not None
    on_the_wall = rig.model_copy(update={"virtual": rig.virtual.model_copy(update={"pace": "wall"})})
    with ExitStack() as stack, tempfile.TemporaryDirectory() as folder:
        engine = stack.enter_context(start_engine(Supervision.UNATTENDED))
        client = engine.client
        client.open(on_the_wall)
        while client.status().state is EngineState.OPENING:
            time.sleep(0.05)
        client.arm(campaign(60 * minutes), Path(folder))
        client.start()
        while client.status().samples == 0:
            time.sleep(0.05)
        stack.enter_context(busy())
        frozen_viewer(stack, EngineClient.attach(engine.address))
        began_s = time.monotonic()
        while (status := client.status()).state is not EngineState.READY:
            time.sleep(1.0)
        wall_s = time.monotonic() - began_s
        row = status.rows[0]
        with open_recording(Path(row.file)) as recording:
            missing = sum(gap.last_sample - gap.first_sample + 1 for gap in recording.gaps)
            recorded_s = recording.samples / recording.sample_rate_hz
            print(f"recording: {row.state} ({row.reason}); {recorded_s:.1f} s in {wall_s:.1f} s of wall time")
            print(f"samples missing: {missing} a channel in {len(recording.gaps)} flagged gaps")


if __name__ == "__main__":
    main()
