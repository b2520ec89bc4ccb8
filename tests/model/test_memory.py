"""In a process of its own: the setting is for the whole process."""

import platform
import subprocess
import sys

import pytest

COUNT_FAULTS = """
import resource, numpy as np
from model.memory import keep_freed_memory
if {keep}:
    assert keep_freed_memory()
def touch():
    for _ in range(50):
        np.ones(500_000)
touch()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
touch()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


def _faults(keep):
    script = COUNT_FAULTS.format(keep=keep)
    return int(subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True).stdout)


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="the setting is glibc's")
def test_freed_arrays_are_handed_out_again():
    assert _faults(keep=True) < 2000
