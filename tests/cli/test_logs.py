"""Logs of a command, and the completion of a shell."""

import subprocess
import sys

import pytest

from nvhchain.cli import main
from nvhchain.runtime import extras

SPHERE = "cases/sphere/pulsating.toml"


def test_verbose_logs_the_steps_on_stderr(tmp_path, capsys):
    run = ["run", SPHERE, "--fidelity", "draft", "--out", str(tmp_path)]
    assert main(run) == 0
    assert " INFO " not in capsys.readouterr().err
    assert main([*run, "-v"]) == 0
    said = capsys.readouterr()
    assert "INFO nvhchain.files.result_cache: transfer_vectors: cached in" in said.err
    assert "INFO" not in said.out


def test_a_log_file_has_all_details_and_keeps_earlier_ones(tmp_path, capsys):
    log = tmp_path / "log.txt"
    run = ["run", SPHERE, "--fidelity", "draft", "--out", str(tmp_path / "out"), "--log-file", str(log)]
    assert main(run) == 0
    first = log.read_text(encoding="utf-8")
    assert "DEBUG nvhchain.files.result_cache: transfer_vectors: key " in first
    assert "transfer_vectors: computed in" in first
    assert main(run) == 0
    assert log.read_text(encoding="utf-8").startswith(first)
    assert " INFO " not in capsys.readouterr().err


def test_a_log_file_that_cannot_be_written_is_bad_input(tmp_path, capsys):
    assert main(["check", SPHERE, "--log-file", str(tmp_path / "absent" / "log")]) == 2
    assert capsys.readouterr().err.count("name another file for --log-file") == 1


@pytest.mark.parametrize("shell", ["bash", "zsh", "tcsh"])
def test_completion_names_all_commands(shell, capsys, tmp_path):
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert all(name in script for name in ("compare", "tradeoff", "schema", "single-stage"))
    if shell == "bash":
        (tmp_path / "script").write_text(script)
        ask = "source ./script; COMP_WORDS=(nvhchain comp); COMP_CWORD=1; COMP_LINE='nvhchain comp'; COMP_POINT=13; "
        ask += '_shtab_nvhchain nvhchain comp nvhchain; echo "${COMPREPLY[@]}"'
        done = subprocess.run(["bash", "-c", ask], cwd=tmp_path, capture_output=True, text=True, check=False)
        assert {"compare", "completion"} <= set(done.stdout.split()), done.stderr


def test_missing_shtab_is_named_with_its_remedy(monkeypatch, capsys):
    monkeypatch.setattr(extras, "installed", lambda module: False)
    assert main(["completion", "bash"]) == 2
    assert 'pip install "nvhchain[completion]"' in capsys.readouterr().err


def test_a_warning_is_printed_once_with_its_case(tmp_path, request):
    text = (request.config.rootpath / "cases/small/single_stage.toml").read_text()
    (tmp_path / "case.toml").write_text(text.replace("[0, 0], radius_mm = 40", "[0, 0], radius_mm = 30.1"))
    command = [sys.executable, "-m", "nvhchain", "check", str(tmp_path / "case.toml")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stderr.count("passes as the rounding of a drawing") == 1
    assert done.stderr.startswith("nvhchain: ")
