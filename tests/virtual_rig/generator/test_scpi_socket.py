import socket
import struct
import threading

import numpy as np
import pytest
import pyvisa

from vibench.virtual_rig.generator.afg1022 import AFG1022
from vibench.virtual_rig.generator.scpi_instrument import ScpiSocket


@pytest.fixture
def generator():
    return AFG1022(lambda: 0.0)


@pytest.fixture
def server(generator):
    with ScpiSocket(generator) as one:
        yield one


@pytest.fixture
def instrument(server):
    resources = pyvisa.ResourceManager("@py")
    session = resources.open_resource(
        server.resource_name, read_termination="\n", write_termination="\n", timeout=5000
    )
    yield session
    session.close()
    resources.close()


def test_a_socket_session_answers_queries_and_accepts_settings(instrument):
    assert instrument.query("*IDN?").startswith("TEKTRONIX,AFG1022,")
    instrument.write("SOUR1:FREQ 1.5kHz")
    assert float(instrument.query("SOUR1:FREQ?")) == 1500


def test_a_waveform_full_of_newline_bytes_arrives_complete(instrument):
    codes = np.full(8192, 0x0A0A)  # every byte is a newline
    instrument.write_binary_values("DATA:DATA EMEM,", codes, datatype="H", is_big_endian=True)
    back = instrument.query_binary_values(
        "DATA:DATA? EMEM", datatype="H", is_big_endian=True, container=np.array
    )
    assert np.array_equal(back, codes)
    assert instrument.query("SYST:ERR?").startswith("0,")


def test_a_message_received_byte_by_byte_is_one_message(server):
    with socket.create_connection(("127.0.0.1", server.port), timeout=5) as client:
        for byte in b"DATA:DATA EMEM,#14\n\n\n\n;:FREQ 7;:FREQ?\n":
            client.sendall(bytes([byte]))
        assert client.recv(100) == b"7.0E+00\n"


def test_two_clients_share_one_instrument(server, instrument):
    with socket.create_connection(("127.0.0.1", server.port), timeout=5) as other:
        instrument.write("VOLT 3")
        assert float(instrument.query("VOLT?")) == 3  # the write has been carried out
        other.sendall(b"VOLT?\n")
        assert other.recv(100) == b"3.0E+00\n"


def test_the_scpi_socket_listens_on_loopback_by_default(server):
    assert server.resource_name == f"TCPIP0::127.0.0.1::{server.port}::SOCKET"


def test_closing_ends_the_server_even_with_a_client_connected(generator):
    server = ScpiSocket(generator)
    with socket.create_connection(("127.0.0.1", server.port), timeout=5):
        server.close()
    with pytest.raises(ConnectionError), socket.create_connection(("127.0.0.1", server.port), timeout=5):
        pass


def test_replies_are_not_mixed_up_between_many_client_threads(generator, server):
    failures = []

    def client(number):
        with socket.create_connection(("127.0.0.1", server.port), timeout=10) as connection:
            stream = connection.makefile("rb")
            for step in range(100):
                connection.sendall(f"*OPC?;:FREQ {number * 1000 + step};*OPC?\n".encode())
                if stream.readline() != b"1;1\n":
                    failures.append((number, step))
            stream.close()

    threads = [threading.Thread(target=client, args=(number,)) for number in range(1, 5)]
    for thread in threads:
        thread.start()
    start_s = 0.0
    while any(thread.is_alive() for thread in threads):
        generator.render(start_s, 1e-5, 500)
        start_s += 500e-5
    for thread in threads:
        thread.join()
    assert failures == []
    assert generator.execute(b"SYST:ERR?").data.startswith(b"0,")


def test_a_client_that_disconnects_without_reading_affects_no_other_client(server, instrument, capsys):
    for _ in range(5):
        with socket.create_connection(("127.0.0.1", server.port), timeout=5) as leaving:
            leaving.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            leaving.sendall(b"DATA:DATA? EMEM\n" * 200)
    assert float(instrument.query("SOUR1:FREQ?")) > 0
    assert "Traceback" not in capsys.readouterr().err
