"""The virtual rig served to programs that do not use vibench."""

import re
import signal
import socket
import subprocess
import sys
import time
from contextlib import closing

import grpc
import nidaqmx
import pytest
from nidaqmx import GrpcSessionOptions
from nidaqmx.constants import AcquisitionType

from vibench.acquisition.drivers import AFG1022X
from vibench.acquisition.rig import load_rig

from .conftest import ENVIRONMENT

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


def free_port():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return taken.getsockname()[1]


@pytest.fixture(scope="module")
def serve_rig_output():
    """Yield the output of `vibench serve-rig`; each test sets the rig's state first."""
    options = ("--address", "127.0.0.1:0", "--scpi-port", str(free_port()))
    arguments = [sys.executable, "-u", "-m", "vibench.cli", "serve-rig", *options]
    with subprocess.Popen(arguments, env=ENVIRONMENT, stdout=subprocess.PIPE, text=True) as server:
        said = ""
        while "write_termination" not in said:
            line = server.stdout.readline()
            assert line, f"the server ended after saying {said!r}"
            said += line
        yield said
        server.send_signal(signal.SIGINT)
        rest = server.stdout.read()
    assert "The virtual rig is off." in rest
    assert server.returncode == 0


@pytest.mark.thorough
def test_other_programs_can_use_the_generator_and_the_converter_of_the_served_rig(serve_rig_output):
    address = serve_rig_output.split('insecure_channel("')[1].split('"')[0]
    stranger = subprocess.run(
        [sys.executable, "-c", PROGRAM, address], env=ENVIRONMENT, capture_output=True, text=True, check=False
    )
    assert stranger.stdout.strip() == "1", stranger.stderr
    with (
        grpc.insecure_channel(address) as channel,
        nidaqmx.Task(grpc_options=GrpcSessionOptions(channel, "")) as task,
    ):
        task.ai_channels.add_ai_voltage_chan("cDAQ1Mod1/ai0", min_val=-5, max_val=5)
        task.timing.cfg_samp_clk_timing(51200, samps_per_chan=5120)
        volts = task.read(5120)
    # 0.2 Vpp at the generator, after a divider by 2.
    assert max(volts) == pytest.approx(0.05, rel=0.01)


def examples_in(serve_rig_output):
    """Return the indented example code below each title."""
    blocks = re.split(r"^The .*:\n", serve_rig_output, flags=re.MULTILINE)[1:]
    return ["\n".join(line[2:] for line in block.splitlines() if line.startswith("  ")) for block in blocks]


@pytest.mark.thorough
def test_the_printed_example_commands_work(serve_rig_output):
    converter, usb, stream = examples_in(serve_rig_output)
    pasted = {}
    exec(converter, pasted)
    with pasted["task"] as task:
        task.ai_channels.add_ai_voltage_chan("cDAQ1Mod1/ai0", min_val=-5, max_val=5)
        task.timing.cfg_samp_clk_timing(51200, samps_per_chan=512)
        assert len(task.read(512)) == 512
    for hint in (usb, stream):
        # pyvisa keeps its list of devices for a whole process, so each example has a process.
        program = f'{hint}\nprint(generator.query("*IDN?"))\ngenerator.close()'
        words = [sys.executable, "-W", "ignore", "-c", program]
        said = subprocess.run(words, env=ENVIRONMENT, capture_output=True, text=True, check=False)
        assert said.stdout.startswith("TEKTRONIX,AFG1022"), said.stderr


def test_an_indefinite_length_block_ends_at_the_newline(serve_rig_output):
    pasted = {}
    exec(examples_in(serve_rig_output)[2], pasted)
    with closing(pasted["generator"]) as generator:
        generator.write_raw(b"DATA:DATA EMEM,#0abcd\n")
        assert generator.query("*IDN?").startswith("TEKTRONIX,AFG1022")


def test_the_afg1022_driver_works_over_the_socket_of_a_served_rig(serve_rig_output):
    rig = load_rig("virtual_rig")
    (resource,) = set(re.findall(r"TCPIP0::[\w.:]+::SOCKET", serve_rig_output))
    config = rig.generator.model_copy(update={"resource": resource})
    generator = AFG1022X.open(config)
    generator.load_sine(200.0, 0.1)
    generator.start()
    generator.stop()
    generator.close()


def test_the_time_of_a_served_rig_advances_without_clients(serve_rig_output):
    address = serve_rig_output.split('insecure_channel("')[1].split('"')[0]
    with (
        grpc.insecure_channel(address) as channel,
        nidaqmx.Task(grpc_options=GrpcSessionOptions(channel, "")) as task,
    ):
        task.ai_channels.add_ai_voltage_chan("cDAQ1Mod1/ai0", min_val=-5, max_val=5)
        task.timing.cfg_samp_clk_timing(51200, sample_mode=AcquisitionType.CONTINUOUS)
        task.start()
        begun_s = time.monotonic()
        task.read(25600, timeout=20.0)
        assert time.monotonic() - begun_s > 0.4
