"""The whole virtual rig, switched on: generator on the USB bus, DAQ server, world, and scripted faults.

`VirtualRig` joins the other rooms for a rig's configuration; `RigFaults` is everything that can go wrong
on demand, a fault script plays it by rig time (docs/campaigns.md).
"""
