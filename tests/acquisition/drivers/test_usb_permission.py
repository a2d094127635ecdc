"""Missing permission for a connected USB instrument is reported with advice."""

import pytest

from vibench.acquisition import shipped
from vibench.acquisition.drivers import _scpi
from vibench.acquisition.errors import InstrumentLost

AFG = "USB0::0x0699::0x0353::C010101::INSTR"


@pytest.fixture
def bus(tmp_path, monkeypatch):
    """Return a function that puts one device on a USB bus, with or without write permission."""
    monkeypatch.setattr(_scpi, "USB_DEVICES", tmp_path / "devices")
    monkeypatch.setattr(_scpi, "USB_NODES", tmp_path / "nodes")

    def plug_device(vendor, product, may_write):
        device = tmp_path / "devices" / "1-2"
        device.mkdir(parents=True)
        (tmp_path / "devices" / "1-0:1.0").mkdir()
        for name, text in (("idVendor", vendor), ("idProduct", product), ("busnum", "1"), ("devnum", "7")):
            (device / name).write_text(f"{text}\n")
        node = tmp_path / "nodes" / "001" / "007"
        if may_write:
            node.parent.mkdir(parents=True)
            node.touch()

    return plug_device


@pytest.mark.parametrize(
    ("resource", "vendor", "may_write", "is_told"),
    [
        (AFG, "0699", False, True),
        ("USB0::1689::851::C010101::0::INSTR", "0699", False, True),
        (AFG, "0699", True, False),
        (AFG, "1ab1", False, False),
        ("USB0::0x0699::0x0345::C010101::INSTR", "0699", False, False),
    ],
)
def test_the_error_for_a_missing_usb_permission_gives_advice(bus, resource, vendor, may_write, is_told):
    bus(vendor, "0353", may_write)
    with pytest.raises(InstrumentLost) as caught:
        _scpi.open_link(resource, "@py", 0.2)
    assert ("may not use it" in str(caught.value)) is is_told
    assert (str(shipped(_scpi.UDEV_RULES)) in str(caught.value)) is is_told
