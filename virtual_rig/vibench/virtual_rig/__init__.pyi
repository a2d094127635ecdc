from .rig import DiskFaults as DiskFaults, VirtualRig as VirtualRig, load_fault_script as load_fault_script
from .usb.bus import plug_in_remote as plug_in_remote
