"""The whole virtual rig, switched on: generator on the USB bus, DAQ server, world, and scripted faults.

`VirtualRig` assembles the other inner packages for a rig's configuration; `RigFaults` contains all faults on
demand, and a fault script plays them by rig time (docs/campaigns.md).
"""
