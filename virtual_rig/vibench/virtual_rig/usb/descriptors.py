"""The USB descriptors of a test-and-measurement instrument, as PyUSB reads them (USB 2.0, chapter 9.6)."""

from array import array
from types import SimpleNamespace

import usb.util

from .device import BULK_IN, BULK_OUT, Identification

_TMC_CLASS, _TMC_SUBCLASS, _USB488_PROTOCOL = 0xFE, 3, 1
_MAKER, _PRODUCT, _SERIAL = 1, 2, 3
_ENGLISH = 0x0409
_HIGH_SPEED = 3
_CONTROL_PACKET_BYTES = 64
_DEVICE_BYTES, _CONFIGURATION_BYTES, _INTERFACE_BYTES, _ENDPOINT_BYTES = 18, 9, 9, 7
_SELF_POWERED = 0xC0
_ENDPOINTS = (BULK_OUT, BULK_IN)


def device_descriptor(identification: Identification, address: int) -> SimpleNamespace:
    """Return the device descriptor (table 9-8) and where on the bus the device sits."""
    return SimpleNamespace(
        bLength=_DEVICE_BYTES,
        bDescriptorType=usb.util.DESC_TYPE_DEVICE,
        bcdUSB=0x0200,
        bDeviceClass=0,
        bDeviceSubClass=0,
        bDeviceProtocol=0,
        bMaxPacketSize0=_CONTROL_PACKET_BYTES,
        idVendor=identification.vendor_id,
        idProduct=identification.product_id,
        bcdDevice=0x0100,
        iManufacturer=_MAKER,
        iProduct=_PRODUCT,
        iSerialNumber=_SERIAL,
        bNumConfigurations=1,
        address=address,
        bus=1,
        port_number=address,
        port_numbers=(address,),
        speed=_HIGH_SPEED,
    )


def configuration_descriptor(config: int) -> SimpleNamespace:
    """Return the one configuration (table 9-10); IndexError past it."""
    if config != 0:
        raise IndexError(config)
    return SimpleNamespace(
        bLength=_CONFIGURATION_BYTES,
        bDescriptorType=usb.util.DESC_TYPE_CONFIG,
        wTotalLength=_CONFIGURATION_BYTES + _INTERFACE_BYTES + _ENDPOINT_BYTES * len(_ENDPOINTS),
        bNumInterfaces=1,
        bConfigurationValue=1,
        iConfiguration=0,
        bmAttributes=_SELF_POWERED,
        bMaxPower=1,
        extra_descriptors=array("B"),
    )


def interface_descriptor(interface: int, alternate: int) -> SimpleNamespace:
    """Return the one interface, USBTMC with the USB488 protocol (table 9-12); IndexError past it."""
    if (interface, alternate) != (0, 0):
        raise IndexError((interface, alternate))
    return SimpleNamespace(
        bLength=_INTERFACE_BYTES,
        bDescriptorType=usb.util.DESC_TYPE_INTERFACE,
        bInterfaceNumber=0,
        bAlternateSetting=0,
        bNumEndpoints=len(_ENDPOINTS),
        bInterfaceClass=_TMC_CLASS,
        bInterfaceSubClass=_TMC_SUBCLASS,
        bInterfaceProtocol=_USB488_PROTOCOL,
        iInterface=0,
        extra_descriptors=array("B"),
    )


def endpoint_descriptor(identification: Identification, endpoint: int) -> SimpleNamespace:
    """Return bulk out or bulk in (table 9-13); IndexError past them."""
    return SimpleNamespace(
        bLength=_ENDPOINT_BYTES,
        bDescriptorType=usb.util.DESC_TYPE_ENDPOINT,
        bEndpointAddress=_ENDPOINTS[endpoint],
        bmAttributes=usb.util.ENDPOINT_TYPE_BULK,
        wMaxPacketSize=identification.packet_bytes,
        bInterval=0,
        bRefresh=0,
        bSynchAddress=0,
        extra_descriptors=array("B"),
    )


def string_descriptor(identification: Identification, index: int) -> bytes | None:
    """Return a string descriptor (table 9-16), or None if there is none of that number."""
    texts = {
        _MAKER: identification.maker,
        _PRODUCT: identification.product,
        _SERIAL: identification.serial,
    }
    if index == 0:
        body = _ENGLISH.to_bytes(2, "little")
    elif index in texts:
        body = texts[index].encode("utf-16-le")
    else:
        return None
    return bytes([len(body) + 2, usb.util.DESC_TYPE_STRING]) + body
