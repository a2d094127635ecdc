"""Open HDF5 files that may be damaged or malicious.

HDF5 files can include data of other files (external storage, external links, virtual datasets), and the HDF5
library does not check the sizes stated in a file. `open_hdf5` refuses external data, except inside the
context `allow_external_data`, and compares the stated sizes with the length of the file before reading.

>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> import h5py
>>> from vibench.sim.hdf5_files.door import UnsafeHdf5, open_hdf5
>>> with TemporaryDirectory() as folder:
...     path = Path(folder) / "foreign.h5"
...     with h5py.File(path, "w") as file:
...         file["copied"] = h5py.ExternalLink("/etc/hosts.h5", "/secret")
...     try:
...         open_hdf5(path)
...     except UnsafeHdf5 as error:
...         print(error)
/copied refers to another file (/etc/hosts.h5); read it with --allow-external if you trust this file
"""
