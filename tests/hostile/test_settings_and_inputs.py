"""Settings of other programs change no result, and a command writes over nothing that it reads."""

import os
import signal
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from types import ModuleType

import pytest

from nvhchain import __main__
from nvhchain.acoustics.surfaces import needles
from nvhchain.cli import main
from nvhchain.runtime import processes
from nvhchain.runtime.folder_lock import hold_folder
from nvhchain.testing.bodies import turned

SPHERE = Path("cases/sphere/pulsating.toml").resolve()
PACKAGE = Path(__main__.__file__).parent


@pytest.mark.slow
@pytest.mark.parametrize("setting", ["Mesh.MeshSizeFactor = 3;", "Mesh.ElementOrder = 2;", "Mesh.RecombineAll = 1;"])
def test_settings_that_a_user_saved_for_gmsh_change_no_mesh(setting, tmp_path, monkeypatch):
    given = turned([(0.0, -0.1), (0.05, -0.1), (0.05, 0.1), (0.0, 0.1)], 64)
    plain = needles.remesh_needles(given, 0.03).surface
    for name in (".gmshrc", ".gmsh-options"):
        (tmp_path / name).write_text(f"{setting}\n")
    monkeypatch.setenv("HOME", str(tmp_path))
    for kept in vars(needles).values():
        if hasattr(kept, "cache_clear"):
            kept.cache_clear()
    assert needles.remesh_needles(given, 0.03).surface.content_hash == plain.content_hash


def test_no_call_of_gmsh_reads_them():
    starts = [
        (path.name, line.strip())
        for path in PACKAGE.rglob("*.py")
        for line in path.read_text(encoding="utf-8").splitlines()
        if "gmsh.initialize(" in line
    ]
    assert len(starts) == 4
    assert [start for start in starts if "readConfigFiles=False" not in start[1]] == []


@pytest.mark.parametrize(
    "arguments",
    [
        ["run", "{case}", "--fidelity", "draft", "--log-file", "{case}"],
        ["check", "{case}", "--log-file", "{link}"],
        ["plan", "{case}", "--fidelity", "draft", "--log-file", "./{case}"],
        ["compare", "{case}", "--log-file", "{case}"],
        ["gear-field", "{case}", "--gear", "pinion", "--fidelity", "draft", "--out", "{case}"],
    ],
    ids=lambda arguments: " ".join(arguments),
)
def test_no_command_writes_over_a_file_that_it_reads(arguments, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    before = SPHERE.read_bytes()
    Path("ball.toml").write_bytes(before)
    Path("link.toml").symlink_to("ball.toml")
    assert main([word.format(case="ball.toml", link="link.toml") for word in arguments]) == 2
    assert "the command reads this file: name another one" in capsys.readouterr().err
    assert Path("ball.toml").read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["ball.toml", "link.toml"]


def test_a_field_of_a_gear_is_not_written_over_another_case(tmp_path, capsys):
    other = tmp_path / "other.toml"
    other.write_text("mine")
    case = SPHERE.parents[1] / "small" / "single_stage.toml"
    assert main(["gear-field", str(case), "--gear", "pinion", "--fidelity", "draft", "--out", str(other)]) == 2
    assert "end it in .h5" in capsys.readouterr().err
    assert other.read_text() == "mine"


@pytest.mark.parametrize(
    "text",
    [
        "x = " + "[" * 900 + "]" * 900,
        "a" + ".a" * 3000 + " = 1",
        "[" + "a." * 1500 + "a]",
        "x = " + "{a=" * 900 + "1" + "}" * 900,
    ],
    ids=["lists", "dotted", "table", "inline"],
)
def test_deep_tables_are_refused_in_a_line(text, tmp_path, capsys):
    case = tmp_path / "deep.toml"
    case.write_text(text + "\n")
    assert main(["check", str(case)]) == 2
    assert len(capsys.readouterr().err.splitlines()) <= 3


def test_a_deep_summary_is_none(tmp_path, capsys):
    (tmp_path / "summary.json").write_text("[" * 100_000)
    assert main(["report", str(tmp_path)]) == 2
    assert "cannot be read" in capsys.readouterr().err
    assert main(["compare", str(SPHERE), "--fidelity", "draft", "--out", str(tmp_path)]) == 0


def test_a_log_on_a_full_disk_is_told_once_and_stops_nothing(tmp_path, capsys):
    run = ["run", str(SPHERE), "--fidelity", "draft", "--out", str(tmp_path)]
    assert main([*run, "--log-file", "/dev/full"]) == 0
    told = [line for line in capsys.readouterr().err.splitlines() if "/dev/full" in line]
    assert told == ["/dev/full: the log cannot be written (No space left on device): make room or name another file"]


def run_elsewhere(out, fidelity, *words, **options):
    """Start a run in a process of its own, whose output is read here."""
    command = [sys.executable, "-P", "-m", "nvhchain", "run", SPHERE, "--fidelity", fidelity, "--out", out, *words]
    return subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, **options)


@pytest.mark.slow
def test_a_run_waits_for_another_in_its_folder(tmp_path):
    with ExitStack() as held:
        held.enter_context(hold_folder(tmp_path))
        waiting = run_elsewhere(tmp_path, "draft", "-v")
        for line in waiting.stderr:
            if "waits" in line:
                break
        assert not list(tmp_path.iterdir())
        held.close()
        out, _ = waiting.communicate(timeout=120)
    assert waiting.returncode == 0
    assert "dB(A)" in out


def heeded():
    """Heed the signal, which a test under nohup inherits as one to be ignored."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def test_the_end_of_a_terminal_ends_a_command_as_sigterm_does(tmp_path):
    running = run_elsewhere(tmp_path, "standard", preexec_fn=heeded)
    for line in running.stderr:
        if "…" in line:
            break
    running.send_signal(signal.SIGHUP)
    _, told = running.communicate(timeout=60)
    assert running.returncode == 128 + signal.SIGHUP
    assert told.endswith("nvhchain: interrupted; finished steps are cached\n")


def test_nohup_is_respected(tmp_path):
    """Where the signal is ignored, as under nohup, the command goes on."""
    command = [sys.executable, "-P", "-m", "nvhchain", "check", str(SPHERE)]
    running = subprocess.Popen(command, preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
    time.sleep(0.3)
    os.kill(running.pid, signal.SIGHUP)
    assert running.wait(timeout=60) == 0


def test_an_interruption_while_the_command_is_imported_ends_in_a_line(monkeypatch, capsys):
    class Interrupted(ModuleType):
        def __getattr__(self, name):
            raise KeyboardInterrupt

    monkeypatch.setitem(sys.modules, "nvhchain.cli", Interrupted("nvhchain.cli"))
    assert __main__.main() == 130
    assert capsys.readouterr().err == "nvhchain: interrupted\n"


def test_children_have_no_empty_place_in_their_path(monkeypatch):
    """It would be the working directory."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(["", "/x", "", "/y", ""]))
    assert processes._child_environment(None)["PYTHONPATH"] == os.pathsep.join(["/x", "/y"])
