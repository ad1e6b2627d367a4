"""Archives of arrays are read without pickles, in bounded memory, and hold each name once."""

import io
import zipfile

import numpy as np
import pytest

from fish_env.archives import read_arrays

MOST = 10_000


def archive_of(*members):
    """An archive of named arrays, whatever their names."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, array in members:
            packed = io.BytesIO()
            np.lib.format.write_array(packed, np.asarray(array))
            archive.writestr(name, packed.getvalue())
    return stream.getvalue()


def test_arrays_come_back():
    found = read_arrays(archive_of(("a.npy", [1.0, 2.0]), ("b.npy", [3])), MOST)
    assert {name: array.tolist() for name, array in found.items()} == {"a": [1.0, 2.0], "b": [3]}


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_two_arrays_of_one_name_are_refused():
    with pytest.raises(ValueError, match="two arrays 'a'"):
        read_arrays(archive_of(("a.npy", [1.0]), ("a.npy", [2.0])), MOST)


def test_what_is_no_array_is_refused():
    with pytest.raises(ValueError, match="no array"):
        read_arrays(archive_of(("a.pkl", [1.0])), MOST)


def test_a_pickled_array_is_refused():
    with pytest.raises(ValueError, match="allow_pickle"):
        read_arrays(archive_of(("a.npy", np.array([{}], object))), MOST)


def test_more_than_may_be_unpacked_is_refused():
    with pytest.raises(ValueError, match="unpacked"):
        read_arrays(archive_of(("a.npy", np.zeros(MOST))), MOST)
