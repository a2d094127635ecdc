"""The simulated DAQmx driver: its devices and its tasks."""

from collections.abc import Callable, Iterable

from nidaqmx.error_codes import DAQmxErrors

from .channels import expand
from .devices import Device
from .errors import DaqmxRefusal
from .rig import Rig
from .tasks import Task


class DaqmxSystem:
    """Everything one driver knows; used with the rig's lock held."""

    def __init__(self, rig: Rig) -> None:
        """Begin without tasks."""
        self.rig = rig
        self.catalogue = rig.catalogue
        self.tasks: dict[str, Task] = {}
        self._unnamed = 0

    # --- tasks ---------------------------------------------------------------------------

    def create_task(self, name: str) -> Task:
        """Create a task; an empty name is replaced by a free one (-200089 for a name in use)."""
        if not name:
            name = f"_unnamedTask<{self._unnamed}>"
            self._unnamed += 1
        if name in self.tasks:
            raise DaqmxRefusal(DAQmxErrors.DUPLICATE_TASK, f"Task Name: {name}")
        task = Task(name, self.rig)
        self.tasks[name] = task
        return task

    def task(self, name: str) -> Task:
        """Find a task by name (-200088 if there is none)."""
        if name not in self.tasks:
            raise DaqmxRefusal(DAQmxErrors.INVALID_TASK, f"Task Name: {name}")
        return self.tasks[name]

    def clear_task(self, name: str) -> None:
        """End a task and forget it."""
        self.task(name).abort()
        del self.tasks[name]
        self.rig.changed.notify_all()

    def reset(self) -> None:
        """Clear every task, also those whose client is gone."""
        for name in tuple(self.tasks):
            self.clear_task(name)

    # --- devices -------------------------------------------------------------------------

    def device(self, name: str) -> Device:
        """Find a device by its name, or by that of anything on it (-200220 if there is none)."""
        device = self.catalogue.find(name.strip("/").partition("/")[0])
        if device is None:
            known = ", ".join(known.name for known in self.catalogue.devices)
            raise DaqmxRefusal(DAQmxErrors.INVALID_DEVICE_ID, f"Device Specified: {name}\nDevices: {known}")
        return device

    def reset_device(self, name: str) -> None:
        """Abort every task on a device, and on the modules in it."""
        device = self.device(name)
        touched = {device.name, *device.modules}
        for task in self.tasks.values():
            if any(used.name in touched for used in task.devices):
                task.abort()

    def inputs(self, names: str) -> tuple[str, ...]:
        """Return the physical inputs in a list of names and ranges."""
        return self._of_side(names, lambda device: device.input_names)

    def outputs(self, names: str) -> tuple[str, ...]:
        """Return the physical outputs in a list of names and ranges."""
        return self._of_side(names, lambda device: device.output_names)

    def _of_side(self, names: str, side: Callable[[Device], tuple[str, ...]]) -> tuple[str, ...]:
        """Spell channels as their devices do (-200220, -200170, -200096 for those that do not exist)."""
        found = []
        for name in _with_devices(expand(names)):
            device = self.device(name)
            known = {each.lower(): each for each in (*device.input_names, *device.output_names)}
            if name.lower() not in known:
                detail = f"Physical Channel: {name}\nPhysical Channels: {', '.join(known.values()) or 'none'}"
                raise DaqmxRefusal(DAQmxErrors.PHYSICAL_CHAN_DOES_NOT_EXIST, detail)
            if known[name.lower()] not in side(device):
                raise DaqmxRefusal(DAQmxErrors.INVALID_PHYS_CHAN_TYPE, f"Physical Channel: {name}")
            found.append(known[name.lower()])
        if not found:
            raise DaqmxRefusal(DAQmxErrors.PHYSICAL_CHAN_DOES_NOT_EXIST, "No physical channel was given.")
        return tuple(found)


def _with_devices(names: Iterable[str]) -> Iterable[str]:
    """In ``"Dev1/ai0, ai2"`` the second channel lies on the first one's device."""
    device = ""
    for name in names:
        if "/" in name.strip("/"):
            device = name.rpartition("/")[0]
            yield name
        else:
            yield f"{device}/{name}" if device else name
