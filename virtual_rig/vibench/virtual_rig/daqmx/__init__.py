"""The simulated DAQ: NI's DAQmx service over gRPC, for the unmodified nidaqmx.

Its devices, tasks, channels, timing, attributes, events and errors are those of the real driver. Rig time
advances on demand or in real time. The device table names the sources of its values.
"""
