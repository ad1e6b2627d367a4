"""Freed arrays go back to the system."""

import platform
import subprocess
import sys

import pytest

from fish_env.heap import give_back_large_arrays

CODE = """
import numpy as np
from fish_env.heap import give_back_large_arrays

told = {told} and give_back_large_arrays()

def resident():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096

block = np.ones(3 * 2**20)
del block  # which raises the size up to which the library keeps blocks
before = resident()
large, small = zip(*[(np.ones(2**{log2}), np.ones(2**{small})) for _ in range(2**23 // 2**{log2})])
del large
print(told, resident() - before)
"""


GLIBC = platform.libc_ver()[0] == "glibc"


def grown(told: bool, log2: int, small: int) -> tuple[str, int]:
    code = CODE.format(told=told, log2=log2, small=small)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    word, grown = done.stdout.split()
    return word, int(grown)


def test_only_glibc_is_told():
    assert give_back_large_arrays() == GLIBC


@pytest.mark.skipif(not GLIBC, reason="other C libraries have no such setting")
@pytest.mark.parametrize(("log2", "small"), [(14, 10), (18, 12)], ids=["one run's", "all runs'"])
def test_large_arrays_are_given_back_when_they_are_freed(log2, small):
    word, left = grown(True, log2, small)
    assert word == "True"
    assert left < 10 * 2**20
    assert grown(False, log2, small)[1] > 40 * 2**20
