"""The USB cable of the simulated generator, for the unmodified PyUSB."""
