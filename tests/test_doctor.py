"""The diagnosis says yes on a working machine, and names the culprit and the remedy on a broken one."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from nvhchain import doctor


def test_working_machine_passes_and_every_failure_would_have_a_remedy():
    findings = {finding.name: finding for finding in doctor.diagnose()}
    assert len(findings) == len(doctor.CHECKS)
    memory = findings.pop("machine")  # says what is free now, which is not up to the installation
    assert "GiB" in memory.detail
    assert not [finding for finding in findings.values() if not finding.ok]
    assert "gmsh 4" in findings["packages"].detail
    assert findings["gmsh"].detail.startswith("4.")


def test_missing_system_libraries_are_named_with_one_line_of_remedy(monkeypatch):
    linker = "\tlibGLU.so.1 => not found\n\tlibXft.so.2 => not found\n\tlibc.so.6 => /lib/libc.so.6 (0x1)\n"
    real = doctor.processes.run

    def run(command, **options):
        if command[0] == "ldd":
            return subprocess.CompletedProcess(command, 0, linker)
        return real(command, **options)

    monkeypatch.setattr(doctor.processes, "run", run)
    monkeypatch.setattr(doctor, "_GMSH", "raise OSError('libGLU.so.1: cannot open shared object file')")
    finding = doctor._gmsh()
    assert not finding.ok
    assert finding.detail == "lacks libGLU.so.1, libXft.so.2"
    assert finding.remedy == "run 'sudo apt-get install libgl1 libglu1-mesa libxcursor1 libxft2 libxinerama1 libgomp1'"


def test_engine_that_kills_its_process_is_a_finding_not_a_crash():
    ok, detail = doctor._attempt("import os; os.abort()")
    assert (ok, detail) == (False, "ended with code -6")


@pytest.mark.parametrize(
    ("requirement", "message"),
    [("numpy<1", "is outside <1"), ("no-such-package>=1", "no-such-package is missing")],
)
def test_wrong_and_missing_packages_are_named(monkeypatch, requirement, message):
    monkeypatch.setattr(doctor.metadata, "requires", lambda _: [requirement, "pytest>=999; extra == 'test'"])
    finding = doctor._packages()
    assert not finding.ok
    assert message in finding.detail
    assert "pytest" not in finding.detail


def test_the_remedy_outside_a_checkout_installs_the_packages_by_name(monkeypatch, tmp_path):
    monkeypatch.setattr(doctor.metadata, "requires", lambda _: ["numpy<1", "no-such-package>=1,<2"])
    assert doctor._packages().remedy.startswith("run 'pip install -c constraints.txt -e .' in /")
    monkeypatch.setattr(doctor, "__file__", str(tmp_path / "site-packages" / "nvhchain" / "doctor.py"))
    assert doctor._packages().remedy == 'run pip install "numpy<1" "no-such-package<2,>=1"'


@pytest.mark.parametrize(("present", "ok"), [({"cvxopt"}, True), (set(), False)])
def test_pypardiso_may_be_missing_where_cholmod_is_installed(monkeypatch, present, ok):
    def version(name):
        raise doctor.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(doctor.metadata, "requires", lambda _: ["pypardiso>=0.4.6,<0.5"])
    monkeypatch.setattr(doctor.metadata, "version", version)
    monkeypatch.setattr(doctor, "installed", lambda name: name in present)
    finding = doctor._packages()
    assert finding.ok == ok
    assert finding.detail == "pypardiso is missing" + ", CHOLMOD solves instead" * ok


@pytest.mark.parametrize(
    ("machine", "present", "preferred", "remedy"),
    [
        ("x86_64", {"pypardiso"}, "", "reinstall it with 'pip install --force-reinstall pypardiso mkl'"),
        ("x86_64", set(), "", "run 'pip install pypardiso'"),
        ("x86_64", {"pypardiso"}, "superlu", "unset NVHCHAIN_SPARSE"),
        ("aarch64", set(), "", 'MKL has no wheel for this processor; pip install "nvhchain[cholmod]" adds'),
    ],
)
def test_the_remedy_for_the_sparse_solver_can_work(monkeypatch, machine, present, preferred, remedy):
    monkeypatch.setenv("NVHCHAIN_SPARSE", preferred)
    monkeypatch.setattr(doctor.platform, "machine", lambda: machine)
    monkeypatch.setattr(doctor, "installed", lambda name: name in present)
    monkeypatch.setattr(doctor, "_attempt", lambda code: (True, "SuperluFactor"))
    finding = doctor._solver()
    assert not finding.ok
    assert finding.remedy.startswith(remedy)
    monkeypatch.setattr(doctor, "_attempt", lambda code: (True, "CholmodFactor"))
    assert doctor._solver().ok


def test_read_only_cache_folder_is_named(monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert doctor._compiler_cache().ok
    monkeypatch.setattr(doctor.os, "access", lambda *_: False)
    finding = doctor._compiler_cache()
    assert not finding.ok
    assert str(tmp_path) in finding.detail


def test_set_up_script_installs_what_the_diagnosis_names():
    script = (Path(__file__).parents[1] / "scripts" / "prepare.sh").read_text()
    assert f'GMSH_PACKAGES="{doctor.GMSH_PACKAGES}"' in script


def said_by(trials):
    """An `_attempt` that answers for the engines: a dictionary of changes to a sound trial, or what broke."""
    sound = {"pulsating": 2e-3, "interior": 3e-3, "first": 1.0, "again": 0.1, "real": [[[1.0]]], "imaginary": [[[0.5]]]}

    def attempt(code, seconds):
        engine = "fused" if "'fused'" in code else "bempp"
        answer = trials.get(engine, {})
        return (False, answer) if isinstance(answer, str) else (True, json.dumps({**sound, **answer}))

    return attempt


def test_fused_engine_passes_its_trial_on_the_sphere():
    trial = doctor.engine_trial("fused")
    assert max(trial["pulsating"], trial["interior"]) < doctor.SPHERE_ERROR
    assert np.shape(trial["real"]) == np.shape(trial["imaginary"]) == (2, 2, 3)


@pytest.mark.parametrize(
    ("trials", "failed"),
    [
        ({}, []),
        ({"bempp": {"pulsating": 0.04}}, ["engine bempp"]),
        ({"fused": {"interior": 0.04}}, ["engine fused"]),
        ({"bempp": {"real": [[[1.001]]]}}, ["engines agree"]),
        ({"bempp": "ended with code -6"}, ["engine bempp"]),
    ],
)
def test_engines_that_err_differ_or_break_are_named(monkeypatch, trials, failed):
    monkeypatch.setattr(doctor, "_attempt", said_by(trials))
    findings = doctor.diagnose_acoustics()
    assert [finding.name for finding in findings if not finding.ok] == failed
    assert all(finding.remedy for finding in findings if not finding.ok)
