"""The simulated AFG1022: SCPI messages in, replies out, and exact mean voltages at the terminal.

The simulation has the instrument's commands, settings, waveform memories and status. Its output is a timeline
of signals on its own clock, so block sizes do not affect the samples. It is based on the IVI driver tkafg1k,
public drivers and measurements, but not on the lab's unit. This package imports neither cable nor world.
"""
