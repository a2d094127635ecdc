"""Chunks compressed on all cores and handed to HDF5 ready-made.

HDF5's own filter pipeline runs on one core under a global lock. zlib releases the interpreter,
so the same bytes are made here in threads: shuffle (all first bytes, all second bytes, ...), then
deflate. HDF5 reads them like its own.
"""

import os
import zlib
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor

import h5py
import numpy as np

from ._counts import Counts
from ._layout import COUNT_DTYPE, DEFLATE_LEVEL

IN_FLIGHT_PER_WORKER = 4
"""Chunks that wait for a worker or for the disk: enough to keep both busy, little memory."""


def create_counts(file: h5py.File, name: str, samples: int, chunk_samples: int) -> h5py.Dataset:
    """Create a compressed one-dimensional dataset of counts; contiguous when it is to be empty."""
    if samples == 0:
        return file.create_dataset(name, shape=(0,), dtype=COUNT_DTYPE)
    return file.create_dataset(
        name,
        shape=(samples,),
        dtype=COUNT_DTYPE,
        chunks=(min(chunk_samples, samples),),
        compression="gzip",
        compression_opts=DEFLATE_LEVEL,
        shuffle=True,
    )


def write_chunks(dataset: h5py.Dataset, pieces: Iterable[Counts]) -> None:
    """Fill a dataset made by :func:`create_counts` with pieces of one chunk each (the last may be short)."""
    if dataset.chunks is None:
        return
    length = dataset.chunks[0]
    for index, raw in enumerate(_compressed(pieces, length)):
        dataset.id.write_direct_chunk((index * length,), raw)


def _compressed(pieces: Iterable[Counts], length: int) -> Iterator[bytes]:
    """Compressed pieces, in order."""
    workers = os.cpu_count() or 1
    waiting: deque[Future[bytes]] = deque()
    with ThreadPoolExecutor(workers) as pool:
        for piece in pieces:
            waiting.append(pool.submit(_chunk, piece, length))
            if len(waiting) > workers * IN_FLIGHT_PER_WORKER:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


def _chunk(counts: Counts, length: int) -> bytes:
    """One chunk as HDF5's shuffle and deflate filters would make it; a short one is filled with zeros."""
    full = np.zeros(length, dtype=COUNT_DTYPE)
    full[: len(counts)] = counts
    shuffled = np.ascontiguousarray(full.view(np.uint8).reshape(length, -1).T)
    return zlib.compress(shuffled.data, DEFLATE_LEVEL)
