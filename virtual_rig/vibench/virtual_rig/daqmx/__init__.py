"""The simulated DAQ: NI's DAQmx service over gRPC, for the unmodified nidaqmx.

Devices, tasks, channels, timing, attributes, events and errors as the driver reports them, and the pace
at which rig time passes: when somebody asks for samples, or by the wall clock. What is converted and
played goes through `vibench.virtual_rig.analogue`: it does not know the world behind the sockets. Sources
of the device table stand in it.
"""
