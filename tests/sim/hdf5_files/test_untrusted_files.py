import h5py
import numpy as np
import pytest

from vibench.sim.hdf5_files import UnsafeHdf5, allow_external_data, open_hdf5, walk


def external_storage(file):
    file.create_dataset("x", shape=(4,), dtype="u1", external=[("secret.txt", 0, 4)])


def external_link(file):
    file["x"] = h5py.ExternalLink("secret.h5", "/y")


def virtual_dataset(file):
    layout = h5py.VirtualLayout(shape=(4,), dtype="i4")
    layout[:] = h5py.VirtualSource("secret.h5", "y", shape=(4,))
    file.create_virtual_dataset("x", layout)


def external_storage_deep_inside(file):
    external_storage(file.create_group("a/b/c"))


POINTING = (external_storage, external_link, virtual_dataset, external_storage_deep_inside)


@pytest.fixture
def make(tmp_path):
    def write(fill):
        (tmp_path / "secret.txt").write_bytes(b"root:x:0:0")
        with h5py.File(tmp_path / "secret.h5", "w") as file:
            file["y"] = np.arange(4, dtype="i4")
        with h5py.File(tmp_path / "a.h5", "w") as file:
            file["own"] = np.arange(3)
            fill(file)
        return tmp_path / "a.h5"

    return write


@pytest.mark.parametrize("fill", POINTING)
def test_external_links_in_a_file_are_refused_unless_allowed(make, fill):
    path = make(fill)
    with pytest.raises(UnsafeHdf5, match=r"/x refers to another file.*--allow-external"):
        open_hdf5(path)
    with allow_external_data(), open_hdf5(path) as file:
        assert list(file["own"]) == [0, 1, 2]
    with pytest.raises(UnsafeHdf5):
        open_hdf5(path)


def huge(file):
    file.create_dataset("x", shape=(10**12,), dtype="i4", chunks=(51_200,), compression="gzip")


def huge_chunks(file):
    file.create_dataset("x", shape=(10**9,), dtype="i4", chunks=(10**9,), compression="gzip")


def too_deep(file):
    file.create_group("/".join("abcdefghij" * 4))


def too_many_links(file):
    for number in range(25_000):
        file[f"link {number}"] = file["own"] if number % 2 else h5py.SoftLink("/own")


def too_many_attributes(file):
    for number in range(1_100):
        file["own"].attrs[f"a{number}"] = number


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("fill", "said"),
    [
        (huge, "declares 4000000000000 bytes, but stores only 0"),
        (huge_chunks, "chunks of 4000000000 bytes"),
        (too_deep, "more than 32 levels deep"),
        (too_many_links, "more than 20000 objects"),
        (too_many_attributes, "more than 1000 attributes"),
    ],
)
def test_impossible_sizes_are_refused_before_reading(make, fill, said):
    with pytest.raises(UnsafeHdf5, match=said):
        open_hdf5(make(fill))


def test_an_unknown_number_type_is_refused(make):
    def odd(file):
        kind = h5py.h5t.IEEE_F64LE.copy()
        kind.set_ebias(20_000)
        h5py.h5a.create(file.id, b"x", kind, h5py.h5s.create(h5py.h5s.SCALAR))

    with pytest.raises(UnsafeHdf5, match="its contents cannot be read"):
        open_hdf5(make(odd))


def test_a_truncated_file_is_refused(make):
    path = make(lambda file: file.create_dataset("x", data=np.arange(10_000)))
    content = path.read_bytes()
    path.write_bytes(content[: len(content) - 2000])
    with pytest.raises(OSError, match="truncated"):
        open_hdf5(path)


def test_an_hdf5_group_that_contains_itself_is_visited_once(make):
    def circle(file):
        file.create_group("a")
        file["a/again"] = file["a"]
        file["a/root"] = file["/"]
        file["soft"] = h5py.SoftLink("/a/again/again")

    with open_hdf5(make(circle)) as file:
        assert [path for path, _ in walk(file)] == ["/", "/a", "/own"]
