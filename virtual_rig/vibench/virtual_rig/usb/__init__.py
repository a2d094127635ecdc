"""The USB cable of the simulated generator: bus, descriptors, USBTMC, and network cable.

The simulation works with unmodified PyUSB and pyvisa-py, without libusb. While this bus is installed, PyUSB
does not see the machine's own devices. Transfers fail with the errno of real transfers. Sources: USB 2.0
chapter 9.6, USBTMC 1.0, USB488 1.0.
"""
