"""Any terminal, pipe or closed stream takes what the command line prints, and none changes what it computes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from nvhchain.cli import main

SPHERE = Path(__file__).parents[2] / "cases" / "sphere" / "on_floor.toml"
LEVELS = (
    "sphere-over-floor: 92.7 dB(A) (95 % limits 92.5…92.9) at on the floor\n"
    "sphere-over-floor: 89.8 dB(A) (95 % limits 89.5…90.0) at 1 m up\n"
    "Limits at on the floor: 100 % from surface mesh (most at 1000 Hz); "
    "a finer --fidelity or knobs of fidelity.acoustics narrow it\n"
)
FOUND = "sphere-over-floor:\n  transfer_vectors: cached\n  pressure: cached\n"
FULL = "output cannot be printed: No space left on device: redirect it to where there is room"
POSIX = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}


def command(out, *flags):
    return [sys.executable, "-P", *flags, "-m", "nvhchain.cli", "run", str(SPHERE), "--fidelity", "draft", "--out", out]


def levels(out):
    return f"{LEVELS}Figures, sound and tables: {out}/report.html\n"


def ran(out, *flags, environment=None, **options):
    return subprocess.run(
        command(out, *flags), env={**os.environ, "PYTHONUTF8": "1", **(environment or {})}, encoding="utf-8", **options
    )


def printed(out, *flags, **environment):
    done = ran(out, *flags, environment=environment, capture_output=True)
    return done.returncode, done.stdout, done.stderr


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    out = str(tmp_path_factory.mktemp("finished"))
    assert printed(out)[:2] == (0, levels(out))
    return out


@pytest.mark.slow
@pytest.mark.parametrize("environment", [{"PYTHONIOENCODING": "ascii"}, {"PYTHONIOENCODING": "latin-1"}, POSIX])
def test_characters_that_the_terminal_lacks_are_spelt_out(finished, environment):
    assert printed(finished, **environment) == (0, levels(finished).replace("…", "..."), FOUND)


@pytest.mark.slow
@pytest.mark.parametrize("closed", ["<&- >&- 2>&-", "2>&-"])
def test_closed_streams_change_nothing(tmp_path, finished, closed):
    out = str(tmp_path / "out")
    done = subprocess.run(["sh", "-c", f'"$@" {closed}', "sh", *command(out)], capture_output=True, encoding="utf-8")
    assert done.returncode == 0
    assert done.stdout == ("" if ">&-" in closed.split() else levels(out))
    assert sorted(os.listdir(out)) == sorted(os.listdir(finished))
    for name in os.listdir(out):
        if name.endswith(".json"):
            assert Path(out, name).read_text() == Path(finished, name).read_text()


@pytest.mark.slow
@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_reader_that_left_changes_nothing(finished, stream):
    reader, writer = os.pipe()
    os.close(reader)
    other = {"stdout": "stderr", "stderr": "stdout"}[stream]
    done = ran(finished, **{stream: writer, other: subprocess.PIPE})
    os.close(writer)
    assert (done.returncode, done.stdout or done.stderr) == (0, FOUND if stream == "stdout" else levels(finished))


@pytest.mark.slow
def test_levels_that_cannot_be_written_are_one_line_and_a_failure(finished):
    with open("/dev/full", "w") as full:
        done = ran(finished, stdout=full, stderr=subprocess.PIPE)
        assert (done.returncode, done.stderr) == (1, f"{FOUND}nvhchain: {FULL}\n")
        helped = subprocess.run([*command(finished), "--help"], stdout=full, stderr=subprocess.PIPE, encoding="utf-8")
        assert (helped.returncode, helped.stderr) == (1, f"nvhchain: {FULL}\n")
        assert ran(finished, stderr=full, stdout=subprocess.PIPE).returncode == 0


@pytest.mark.slow
@pytest.mark.parametrize("flags", [("-W", "error"), ("-O",)])
def test_flags_of_python_change_nothing(finished, tmp_path, flags):
    assert printed(str(tmp_path), *flags)[:2] == (0, levels(tmp_path))


def test_warnings_stay_one_line_each_where_python_makes_errors_of_them(tmp_path, capsys, monkeypatch):
    import warnings

    from nvhchain.cli import commands

    monkeypatch.setattr(commands, "check", lambda _: warnings.warn("beware", UserWarning, stacklevel=1) or 0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert main(["check", str(SPHERE)]) == 0
    assert capsys.readouterr().err == "nvhchain: beware\n"


@pytest.mark.slow
def test_an_unknown_backend_of_matplotlib_changes_no_figure(finished, tmp_path):
    """Commands open no window, for which a notebook or a terminal may name one."""
    picture = tmp_path / "p.png"
    words = ["plot", str(Path(finished, "pressure.h5")), "--out", str(picture)]
    done = subprocess.run(
        [sys.executable, "-P", "-m", "nvhchain.cli", *words],
        env={**os.environ, "MPLBACKEND": "nonsense"},
        capture_output=True,
        encoding="utf-8",
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, f"{picture}\n", "")


@pytest.mark.parametrize("threads", ["0", "-3", "many"])
def test_impossible_numbers_of_threads_are_one_line(capsys, monkeypatch, threads):
    monkeypatch.setenv("NUMBA_NUM_THREADS", threads)
    assert main(["check", str(SPHERE)]) == 2
    remedy = "must be a whole number, 1 or more: correct the variable or unset it"
    assert capsys.readouterr().err == f"nvhchain: NUMBA_NUM_THREADS = {threads} {remedy}\n"
    monkeypatch.setenv("NUMBA_NUM_THREADS", "")
    assert main(["check", str(SPHERE)]) == 0


def test_numba_is_imported_only_once_the_number_of_threads_is_checked():
    done = subprocess.run(
        [sys.executable, "-m", "nvhchain", "check", str(SPHERE)],
        env={**os.environ, "NUMBA_NUM_THREADS": "0"},
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert done.stderr.startswith("nvhchain: NUMBA_NUM_THREADS = 0 must be")


def test_names_too_long_for_a_file_are_one_line(capsys):
    name = "x" * 256
    for arguments, code in (
        (["run", str(SPHERE), "--out", name], 2),
        (["compare", str(SPHERE), "--out", name], 2),
        (["check", name], 2),
        (["plot", name], 1),
        (["report", name], 2),
    ):
        with pytest.raises(SystemExit) as end:
            sys.exit(main(arguments))
        assert end.value.code == code
        said = capsys.readouterr().err
        assert "too long" in said
        assert said.count("\n") == 1


def test_byte_order_mark_is_skipped_and_another_encoding_refused(tmp_path, capsys):
    case, text = tmp_path / "case.toml", SPHERE.read_text(encoding="utf-8")
    case.write_text(text, encoding="utf-8-sig")
    assert main(["check", str(case)]) == 0
    case.write_text(text, encoding="utf-16")
    assert main(["check", str(case)]) == 2
    assert capsys.readouterr().err == f"nvhchain: {case}: byte 1 is none of UTF-8 text: save the file as UTF-8\n"


def test_an_interrupted_command_removes_locks_of_children_that_ended_with_it(tmp_path, monkeypatch):
    """299 signals in one run of `make kills` found one lock of a study with workers."""
    from nvhchain import cli
    from nvhchain.files import result_cache

    monkeypatch.setattr(result_cache.tempfile, "gettempdir", lambda: str(tmp_path))
    left = tmp_path / f"{result_cache._own_prefix()}-0123456789abcdef.lock"
    left.touch()

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "_command", interrupted)
    assert cli.main(["check", "x"]) == 130
    assert not left.exists()
