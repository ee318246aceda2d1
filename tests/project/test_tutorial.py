"""The page "Your first gearbox", followed in an empty folder with the package as its wheel holds it."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("common_operators")]

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Folder of the files that a wheel would install, made outside the repository."""
    source = tmp_path_factory.mktemp("source") / "nvhchain"
    wanted = ("nvhchain", "cases", "pyproject.toml", "setup.py", "README.md", "LICENSE")
    for name in wanted:
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copyfile
        source.mkdir(exist_ok=True)
        copy(ROOT / name, source / name)
    build = [sys.executable, "setup.py", "-q", "build", "--build-base", str(source / "made")]
    subprocess.run(build, cwd=source, check=True, capture_output=True)
    library = source / "made" / "lib"
    for kind in ("*.nbi", "*.nbc"):  # what is compiled here need not be compiled there: index first, then its code
        for compiled in (ROOT / "nvhchain").rglob(kind):
            place = library / compiled.relative_to(ROOT)
            place.parent.mkdir(exist_ok=True)
            shutil.copyfile(compiled, place)
    return library


def test_following_the_page_ends_with_its_answer(installed, tmp_path):
    page = (ROOT / "docs" / "tutorials" / "first_gearbox.md").read_text(encoding="utf-8")
    commands = [line for block in re.findall(r"```sh\n(.*?)```", page, re.S) for line in block.splitlines()]
    second = re.search(r"```toml\n(.*?)```", page, re.S)[1]
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    printed = ""
    for command in commands:
        program, *arguments = command.split()
        assert program == "nvhchain"
        if arguments[0] == "compare":
            (tmp_path / "mine" / "wider.toml").write_text(second)
        done = subprocess.run(
            [sys.executable, "-m", program, *arguments],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        printed += done.stdout
    where = [sys.executable, "-c", "import nvhchain; print(nvhchain.__file__)"]
    assert str(installed) in subprocess.run(where, cwd=tmp_path, env=environment, capture_output=True, text=True).stdout
    level = float(re.search(r"^single-stage: ([\d.]+) dB\(A\)", printed, re.M)[1])
    louder = float(re.search(r"wider is ([\d.]+) dB louder than single-stage", printed)[1])
    assert level == pytest.approx(48.2, abs=0.2)
    assert louder == pytest.approx(0.6, abs=0.3)
    assert (tmp_path / "out" / "report.html").exists()
