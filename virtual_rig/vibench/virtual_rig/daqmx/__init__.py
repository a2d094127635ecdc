"""The simulated DAQ: NI's DAQmx service over gRPC, for the unmodified nidaqmx.

Devices, tasks, channels, timing, attributes, events and errors as the driver reports them, and the passing of
rig time: on demand or in real time. Signals pass through `vibench.virtual_rig.analogue`, so this package is
independent of the simulated world. The device table names its sources.
"""
