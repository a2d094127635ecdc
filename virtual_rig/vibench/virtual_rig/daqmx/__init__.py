"""The simulated DAQ: NI's DAQmx service over gRPC, for the unmodified nidaqmx.

Devices, tasks, channels, timing, attributes, events and errors as the driver reports them, and the passing of
rig time: on demand or in real time. The device table names its sources.
"""
