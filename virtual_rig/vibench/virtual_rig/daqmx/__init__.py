"""The simulated DAQ: NI's DAQmx service over gRPC, for the unmodified nidaqmx."""
