"""Kernels of the fused engine on disk: compiled side by side the first time, read ever after."""

import os
import subprocess
import sys

import pytest

REPORT = """
from nvhchain.acoustics.fused import engine as _fused
{before}
_fused.compile_kernels("double")
kernels = ((_fused.far_block, _fused.FAR_BLOCK), (_fused.close_block, _fused.CLOSE_BLOCK))
print(*(["compiled", "read"][bool(_fused.compiled(*kernel, "double").stats.cache_hits)] for kernel in kernels))
"""


@pytest.mark.slow
def test_one_large_kernel_is_left_on_disk_by_another_process_while_the_other_is_compiled(tmp_path):
    def run(before):
        environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "NUMBA_NUM_THREADS": "2"}
        command = [sys.executable, "-c", REPORT.format(before=before)]
        return subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout.split()

    assert run("") == ["compiled", "read"]
    assert run("_fused.processes.start_python = None") == ["read", "read"]
    for left in tmp_path.rglob("*close_block*"):
        left.unlink()
    for left in tmp_path.rglob("*restore_columns*"):
        left.unlink()
    assert run("import sys; sys.executable = '/nowhere/python'") == ["read", "compiled"]
