"""The virtual rig alone, for programs that know nothing of vibench."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import grpc
import nidaqmx
import pytest
from nidaqmx import GrpcSessionOptions

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = """
import sys, warnings
warnings.simplefilter("ignore")
from vibench.virtual_rig import plug_in_remote; plug_in_remote(sys.argv[1])
import pyvisa
manager = pyvisa.ResourceManager("@py")
generator = manager.open_resource("USB0::0x0699::0x0353::C019999::INSTR")
generator.write("OUTP1:IMP INF")
for line in ("FUNC:SHAP SIN", "FREQ 160", "VOLT 0.2VPP"):
    generator.write("SOUR1:" + line)
generator.write("OUTP1:STAT ON")
print(generator.query("OUTP1:STAT?").strip())
generator.close()
manager.close()
"""


@pytest.fixture
def served():
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    arguments = [sys.executable, "-u", "-m", "vibench.cli", "serve-rig", "--address", "127.0.0.1:0"]
    with subprocess.Popen(arguments, env=environment, stdout=subprocess.PIPE, text=True) as server:
        said = ""
        while "SOCKET" not in said:
            line = server.stdout.readline()
            assert line, f"the server ended after saying {said!r}"
            said += line
        yield said
        server.send_signal(signal.SIGINT)
        rest = server.stdout.read()
    assert "The virtual rig is off." in rest
    assert server.returncode == 0


def test_other_programs_set_its_generator_and_read_its_converter(served):
    address = served.split('insecure_channel("')[1].split('"')[0]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    stranger = subprocess.run(
        [sys.executable, "-c", PROGRAM, address], env=environment, capture_output=True, text=True, check=False
    )
    assert stranger.stdout.strip() == "1", stranger.stderr
    with (
        grpc.insecure_channel(address) as channel,
        nidaqmx.Task(grpc_options=GrpcSessionOptions(channel, "")) as task,
    ):
        task.ai_channels.add_ai_voltage_chan("cDAQ1Mod1/ai0", min_val=-5, max_val=5)
        task.timing.cfg_samp_clk_timing(51200, samps_per_chan=5120)
        volts = task.read(5120)
    # 0.2 Vpp at the generator, behind a divider by 2.
    assert max(volts) == pytest.approx(0.05, rel=0.01)
