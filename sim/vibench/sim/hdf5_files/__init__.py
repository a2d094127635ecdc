"""Opening HDF5 files that may have been damaged, or made to do harm, without being harmed.

HDF5 lets a file name other files whose bytes it then gives out as its own (external storage, external links,
virtual datasets), and believes what a file says of its sizes. `opened_hdf5` refuses the first, unless
`external_data_allowed`, and compares the second with the file's length before anything is read.

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
/copied points into another file (/etc/hosts.h5); read it with --allow-external if you trust this file
"""
