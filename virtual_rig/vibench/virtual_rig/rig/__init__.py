"""The complete virtual rig: generator on the USB bus, DAQ server, analogue world, and scripted faults.

`VirtualRig` assembles the other inner packages for a rig's configuration; `RigFaults` starts faults on
demand, and a fault script starts them at given rig times (docs/campaigns.md).
"""
