from .rig.fault_script import load_fault_script as load_fault_script
from .rig.virtual_rig import DiskFaults as DiskFaults, VirtualRig as VirtualRig
from .usb.bus import plug_in_remote as plug_in_remote
