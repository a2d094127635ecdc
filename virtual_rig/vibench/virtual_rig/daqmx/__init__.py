"""The simulated DAQ: NI's DAQmx service over gRPC, for the unmodified nidaqmx.

It has devices, tasks, channels, timing, attributes, events and errors as the real driver reports them. Rig
time advances on demand or in real time. The device table names its sources.
"""
