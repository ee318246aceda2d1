"""The set-up script refuses what it cannot use with one line of remedy, and installs nothing unless it is root."""

import os
import subprocess
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "scripts" / "prepare.sh"


def prepare(tmp_path, python, **stubs):
    """Run the script with `python` as interpreter and shell stubs in place of system commands."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for name, body in {"python3": python, **stubs}.items():
        stub = folder / name
        stub.write_text(f"#!/bin/sh\n{body}\n")
        stub.chmod(0o755)
    path = f"{folder}{os.pathsep}{os.environ['PATH']}"
    return subprocess.run(
        ["sh", str(SCRIPT), "python3", str(tmp_path / "venv")],
        env={**os.environ, "PATH": path},
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )


def test_python_that_is_too_old_is_named_with_the_way_out(tmp_path):
    done = prepare(tmp_path, 'case "$2" in *print*) echo 3.9 ;; *) exit 1 ;; esac')
    assert done.returncode == 1
    assert done.stderr == (
        "nvhchain: python3 is Python 3.9, but 3.11 or newer is needed: name a newer one with 'make PYTHON=python3.11'\n"
    )


NO_ENSUREPIP = 'case "$2" in *ensurepip*) exit 1 ;; *print*) echo 3.11 ;; *venv*) echo made "$@" >&2; exit 7 ;; esac'


def test_user_without_ensurepip_is_told_the_package(tmp_path):
    done = prepare(tmp_path, NO_ENSUREPIP, id="echo 1000")
    assert done.returncode == 1
    assert done.stderr == (
        "nvhchain: Python 3.11 cannot make virtual environments: "
        "run 'sudo apt-get install python3.11-venv' and then make again\n"
    )


def test_root_on_debian_gets_the_package_installed(tmp_path):
    done = prepare(tmp_path, NO_ENSUREPIP, id="echo 0", **{"apt-get": f'echo "$*" >> {tmp_path}/calls'})
    calls = (tmp_path / "calls").read_text().splitlines()
    assert calls == ["update -qq", "install -y -qq --no-install-recommends python3.11-venv"]
    assert done.returncode != 0  # the stub of Python cannot make the environment


def test_user_whose_gmsh_lacks_libraries_is_told_their_packages(tmp_path):
    (tmp_path / "venv" / "bin").mkdir(parents=True)
    (tmp_path / "venv" / "bin" / "python").symlink_to("/bin/true")
    (tmp_path / "venv" / "lib").mkdir()
    (tmp_path / "venv" / "lib" / "libgmsh.so.4.13").touch()
    missing = r"printf '\tlibGLU.so.1 => not found\n\tlibm.so.6 => /lib/libm.so.6\n\tlibXft.so.2 => not found\n'"
    done = prepare(tmp_path, "echo 3.11", id="echo 1000", ldd=missing)
    assert done.returncode == 1
    assert done.stderr == (
        "nvhchain: gmsh lacks system libraries (libGLU.so.1 libXft.so.2): run 'sudo apt-get install libgl1 "
        "libglu1-mesa libxcursor1 libxft2 libxinerama1 libgomp1' and then make again\n"
    )
