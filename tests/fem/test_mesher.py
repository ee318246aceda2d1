"""What a mesher in a process of its own does when it fails."""

import pytest

from nvhchain.errors import SolverError
from nvhchain.fem.mesher import run_mesher

SAYS = {"time_limit": 20.0, "failure": "gmsh could not mesh it", "remedy": "use a larger size"}


@pytest.fixture
def module(tmp_path, monkeypatch):
    """Writes the module that stands for a mesher."""
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))

    def write(text):
        (tmp_path / "stand_in_mesher.py").write_text(text)
        return "stand_in_mesher", b"a job"

    return write


def test_arrays_of_the_job_come_back_whatever_else_is_printed(module):
    made = run_mesher(
        *module(
            "import os\nfrom nvhchain.fem.mesher import serve\n"
            "serve(lambda job: print('hello') or os.write(1, b'there') and {'nodes': list(job)})"
        ),
        **SAYS,
    )
    assert {name: values.tolist() for name, values in made.items()} == {"nodes": list(b"a job")}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "import sys\nsys.exit('Invalid boundary mesh')",
            r"gmsh could not mesh it \(exit code 1\): Invalid boundary mesh; use a larger size",
        ),
        ("pass", r"gmsh could not mesh it \(exit code 0\): no mesh"),
        ("raise OSError('libGLU.so.1: cannot open shared object file')", "install the system libraries .*libglu1-mesa"),
    ],
    ids=["error", "no result", "library"],
)
def test_a_failure_is_told_with_what_the_mesher_said_last_and_a_remedy(module, text, message):
    with pytest.raises(SolverError, match=message):
        run_mesher(*module(text), **SAYS)


def test_one_that_takes_too_long_is_ended(module):
    with pytest.raises(SolverError, match=r"did not finish within 0.5 s: use a larger size"):
        run_mesher(*module("import time\ntime.sleep(30)"), **(SAYS | {"time_limit": 0.5}))
