"""The line of every command that its help and the reference print, run in one folder as the reference states."""

import re
import shlex
from pathlib import Path

import pytest

from nvhchain.cli import main, parser
from nvhchain.cli.examples import COMMANDS

pytestmark = pytest.mark.usefixtures("common_operators")

PAGES = Path(__file__).parents[2] / "docs"
CHEAP = ("new", "check", "plan", "export", "import", "schema", "completion", "study")
COMPUTED = ("run", "report", "sound", "hearing", "tables", "plot", "modes", "contributions", "gear-field")
LONGER = ("compare", "record", "craig-bampton", "tradeoff", "microphones", "doctor")


def toml(page, name):
    """Block of a page that begins with the name of a file, or with `base`."""
    blocks = re.findall(r"```toml\n(.*?)```", (PAGES / page).read_text(encoding="utf-8"), re.S)
    return next(block for block in blocks if block.startswith((f"# {name}", "base = ")))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Folder with the files that the reference names."""
    place = tmp_path_factory.mktemp("examples")
    (place / "mine").mkdir()
    assert main(["new", "single-stage", str(place / "new")]) == 0
    for name in ("single_stage.toml", "case.schema.json"):
        (place / "mine" / name).write_bytes((place / "new" / name).read_bytes())
    (place / "single_stage.toml").write_bytes((place / "new" / "single_stage.toml").read_bytes())
    (place / "mine" / "wider.toml").write_text(toml("tutorials/first_gearbox.md", "wider.toml"))
    (place / "blanks.toml").write_text(toml("howto/studies.md", "blanks.toml"))
    return place


def answered(command, folder, monkeypatch):
    monkeypatch.chdir(folder)
    program, *words = shlex.split(COMMANDS[command])
    assert (program, words[0]) == ("nvhchain", command)
    return main(words)


def test_every_command_has_an_example_that_a_test_here_runs(capsys):
    with pytest.raises(SystemExit):
        parser().parse_args(["--help"])
    listed = re.findall(r"^    ([a-z-]+)(?: |$)", capsys.readouterr().out, re.M)
    assert {*listed} == {*COMMANDS} == {*CHEAP, *COMPUTED, *LONGER}


@pytest.mark.parametrize("command", CHEAP)
def test_examples_that_compute_nothing_end_well(command, folder, tmp_path, monkeypatch):
    if command == "import" and not (folder / "unit.rexs").exists():
        answered("export", folder, monkeypatch)
    assert answered(command, tmp_path if command == "new" else folder, monkeypatch) == 0


@pytest.mark.slow
@pytest.mark.parametrize("command", COMPUTED)
def test_examples_on_one_run_end_well(command, folder, monkeypatch):
    if command != "run" and not (folder / "out" / "mine" / "pressure.h5").exists():
        answered("run", folder, monkeypatch)
    assert answered(command, folder, monkeypatch) == 0


@pytest.mark.slow
@pytest.mark.parametrize("command", LONGER)
def test_longer_examples_end_well(command, folder, monkeypatch):
    if command == "microphones":  # of a run with sound power
        monkeypatch.chdir(folder)
        more = ["--set", 'quantities=["pressure", "sound_power"]']
        assert main([*shlex.split(COMMANDS["run"])[1:], *more]) == 0
    assert answered(command, folder, monkeypatch) == 0
