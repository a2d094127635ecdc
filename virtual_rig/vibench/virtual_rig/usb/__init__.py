"""The USB cable of the simulated generator: bus, descriptors, USBTMC, and a cable through the network.

Works with unmodified PyUSB and pyvisa-py, without libusb; while this bus is installed, PyUSB sees it in place
of the machine's own devices. Transfers fail like real ones (errno). Sources: USB 2.0 chapter 9.6, USBTMC 1.0,
USB488 1.0.
"""
