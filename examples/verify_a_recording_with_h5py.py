"""Check a recording against its seal with h5py and hashlib alone, without vibench.

    python examples/verify_a_recording_with_h5py.py recordings/noise.h5 [KEYFILE]

A manifest lists two checksums for every group and dataset: one of its attributes, type and shape, one of its
data. The seal is the checksum of the manifest; see docs/recording-format.md.
"""

import hashlib
import hmac
import json
import sys
from pathlib import Path

import h5py
import numpy as np

LINKS = ("DIMENSION_LIST", "REFERENCE_LIST")  # HDF5's links to axes: file addresses, not content


def attributes_sha256(item):
    """Return the hash of an object's attributes, type and shape, as JSON."""
    values = {}
    for name in item.attrs:
        if name not in LINKS:
            value = np.asarray(item.attrs[name])
            values[name] = [value.dtype.str, list(value.shape), value.tobytes().hex()]
    if isinstance(item, h5py.Dataset):
        values["/"] = [item.dtype.str, list(item.shape)]
    return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()


def data_sha256(item):
    """Return the hash of a dataset's values in order; empty for a group."""
    if not isinstance(item, h5py.Dataset):
        return ""
    return hashlib.sha256(np.asarray(item[()]).tobytes()).hexdigest()


with h5py.File(sys.argv[1]) as file:
    text = file["seal/manifest_json"][()]
    manifest, marks = json.loads(text), {name: each.decode() for name, each in file["seal"].attrs.items()}
    if hashlib.sha256(text).hexdigest() != marks["sha256"]:
        sys.exit(print("the seal itself was changed") or 1)
    items = {"/": file}
    file.visititems(lambda path, item: items.update({f"/{path}": item}))
    found = {
        path: {"attributes": attributes_sha256(item), "data": data_sha256(item)}
        for path, item in items.items()
        if path.split("/")[1] not in ("seal", "results")  # results are added later and sealed separately
    }

changed = sorted(path for path in manifest.keys() | found.keys() if manifest.get(path) != found.get(path))
if changed:
    sys.exit(print("changed since it was sealed:", ", ".join(changed)) or 1)
if len(sys.argv) > 2:
    key = Path(sys.argv[2]).read_bytes().strip()
    if marks.get("hmac_sha256") != hmac.new(key, text, hashlib.sha256).hexdigest():
        sys.exit(print("not signed with this key") or 1)
print("unchanged since it was sealed:", marks["sha256"])
