"""Freed memory of a process."""

from __future__ import annotations

import platform
import subprocess
import sys

import pytest

PAGE_FAULTS = """
import resource, sys
import numpy as np
from tank2sim.memory import keep_freed_memory
if sys.argv[1] == "kept":
    keep_freed_memory()
np.ones(2_000_000)
begin = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(20):
    np.ones(2_000_000)
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - begin)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc is asked to keep freed memory")
def test_pages_of_freed_arrays_are_used_again() -> None:
    returned, kept = (
        int(subprocess.run([sys.executable, "-c", PAGE_FAULTS, how], capture_output=True, check=True, text=True).stdout)
        for how in ("returned", "kept")
    )
    assert kept < returned / 10
