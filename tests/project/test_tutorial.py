"""The page "Your first gearbox", followed in an empty folder with the package that its wheel installs."""

import os
import re
import shutil
import subprocess
import sys
from importlib.metadata import distributions
from pathlib import Path

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("common_operators")]

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Folder into which the wheel is installed, outside the repository."""
    source = tmp_path_factory.mktemp("source") / "nvhchain"
    source.mkdir()
    for name in ("nvhchain", "cases", "pyproject.toml", "setup.py", "MANIFEST.in", "README.md", "LICENSE"):
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copyfile
        copy(ROOT / name, source / name)
    wheels, library = source / "wheels", source / "library"
    pip = [sys.executable, "-m", "pip", "-q", "--disable-pip-version-check"]
    alone = ["--no-deps", "--no-index"]
    build = [*pip, "wheel", *alone, "--no-build-isolation", "--wheel-dir", str(wheels), str(source)]
    subprocess.run(build, check=True, capture_output=True)
    (wheel,) = wheels.glob("nvhchain-*.whl")
    subprocess.run([*pip, "install", *alone, "--target", str(library), str(wheel)], check=True, capture_output=True)
    for kind in ("*.nbi", "*.nbc"):  # what is compiled here need not be compiled there: index first, then its code
        for compiled in (ROOT / "nvhchain").rglob(kind):
            place = library / compiled.relative_to(ROOT)
            place.parent.mkdir(exist_ok=True)
            shutil.copyfile(compiled, place)
    return library


def levels(text, name):
    """Levels of a case in their order, each with its upper limit."""
    found = re.findall(rf"^{name}: ([\d.]+) dB\(A\) \(.*?([\d.]+)\)", text, re.M)
    return [(float(level), float(upper)) for level, upper in found]


def test_metadata_of_the_wheel_name_version_command_and_places(installed):
    (found,) = distributions(path=[str(installed)])
    assert (found.metadata["Name"], found.version) == ("nvhchain", "0.1.0")
    assert [entry.value for entry in found.entry_points if entry.name == "nvhchain"] == ["nvhchain.__main__:main"]
    assert not any("Linux" in each for each in found.metadata.get_all("Classifier"))


def test_following_the_page_ends_with_its_answer(installed, tmp_path):
    page = (ROOT / "docs" / "tutorials" / "first_gearbox.md").read_text(encoding="utf-8")
    commands = [line for block in re.findall(r"```sh\n(.*?)```", page, re.S) for line in block.splitlines()]
    shown = "\n".join(re.findall(r"```text\n(.*?)```", page, re.S))
    files = {re.search(r'name = "(\w+)"', text)[1]: text for text in re.findall(r"```toml\n(.*?)```", page, re.S)}
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    printed = ""
    for command in commands:
        program, *arguments = command.split()
        assert program == "nvhchain"
        if arguments[0] == "compare":
            path = Path(arguments[2])
            (tmp_path / path).write_text(files[path.stem])
        done = subprocess.run(
            [str(installed / "bin" / program), *arguments],
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
    for name in ("single-stage", *files):
        assert levels(shown, name)
        for found, stated in zip(levels(printed, name), levels(shown, name), strict=True):
            assert found == pytest.approx(stated, abs=0.2)
    for other in files:
        difference = rf"^{other} is ([\d.]+) dB (\w+) than single-stage"
        (found, word), (stated, said) = (re.search(difference, text, re.M).groups() for text in (printed, shown))
        assert (word, float(found)) == (said, pytest.approx(float(stated), abs=0.15))
    assert "Figures, sound and tables: out/report.html" in printed
    assert (tmp_path / "out" / "report.html").exists()
