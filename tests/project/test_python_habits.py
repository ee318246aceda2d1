"""Habits of Python users: short texts, data frames, plots of a result, sub-packages without imports."""

import pkgutil
import re
import subprocess
import sys
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.errors import InputError
from nvhchain.handoff import BearingForces
from nvhchain.runtime import extras

SPHERE = "cases/sphere/pulsating.toml"


@pytest.fixture(scope="module")
def result(request):
    return nvh.run(nvh.load_case(request.config.rootpath / SPHERE), fidelity=nvh.DRAFT)


@pytest.fixture
def forces():
    force = np.arange(60.0).reshape(10, 2, 3)
    return BearingForces(np.arange(10) * 1e-3, force, ("A1", "B&2"), np.zeros((2, 3)), 100.0)


def test_a_result_prints_its_level_and_hand_offs_in_one_line(result):
    text = repr(result)
    assert len(text) < 250
    assert text.startswith("Result(pulsating-sphere, draft: ")
    assert f"{result.overall[0]:.1f} dB(A)" in text
    assert "transfer_vectors" in text
    assert "pressure" in result._repr_html_()


def test_html_of_a_hand_off_has_units_and_escaped_names(forces):
    page = forces._repr_html_()
    assert "bearing force on the housing" in page
    assert "0…59, 10 × 2 × 3" in page
    assert "B&amp;2" in page


def test_a_hand_off_becomes_a_data_frame_with_names(forces, result):
    frame = forces.to_dataframe()
    assert frame.index.name == "time"
    assert frame[("B&2", "y")].tolist() == [4.0 + 6 * n for n in range(10)]
    heard = result.pressure.to_dataframe()
    assert np.array_equal(heard.to_numpy(), result.pressure.pressure)
    assert np.array_equal(heard.index, result.pressure.frequency)
    names = [point.name for point in result.case.field_points]
    assert list(heard.columns) == names
    assert result.pressure.to_xarray().point.to_numpy().tolist() == names
    twice = forces.replace(error_names=("A–B", "A–B"))
    assert twice.to_xarray().ends.to_numpy().tolist() == ["A–B", "A–B (2)"]
    assert forces.to_dataframe("positions").shape == (2, 3)
    with pytest.raises(InputError, match="no array 'forces': name one of force"):
        forces.to_dataframe("forces")


def test_a_missing_pandas_is_named_with_its_remedy(forces, monkeypatch):
    monkeypatch.setattr(extras, "installed", lambda module: module != "pandas")
    with pytest.raises(InputError, match=r'pandas is not installed: pip install "nvhchain\[xarray\]"'):
        forces.to_dataframe()


def test_a_result_draws_its_spectrum(result):
    axes = result.plot.spectrum()
    assert len(axes) == 2
    assert any(len(line.get_xdata()) for line in axes[0].lines) or axes[0].collections
    silent = replace(result, pressure=None)
    with pytest.raises(InputError, match="has no spectrum of sound pressure"):
        silent.plot.spectrum()


def test_sub_packages_are_there_after_one_import():
    code = "import nvhchain as nvh, sys; assert 'nvhchain.gear' not in sys.modules; "
    code += "print(nvh.gear.GearGeometry.__name__, nvh.levels.__name__, 'plots' in dir(nvh))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["GearGeometry", "nvhchain.levels", "True"]
    with pytest.raises(AttributeError, match="has no attribute 'gears'"):
        _ = nvh.gears


def test_every_package_with_public_names_is_offered():
    inner = {"cli", "gallery", "testing", "names", "kinds", "dimensions", "runtime"}
    found = {item.name for item in pkgutil.iter_modules(nvh.__path__)} - inner
    public = sorted(name for name in found if name[0] != "_")
    for name in public:  # a fresh process for each, where no other has imported it
        code = f"import nvhchain as nvh; offered = {name!r} in dir(nvh); print(offered, nvh.{name}.__name__)"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
        assert done.stdout.split() == ["True", f"nvhchain.{name}"], done.stderr


def test_every_environment_variable_that_is_read_is_documented(request):
    root = request.config.rootpath
    read = set()
    for path in (root / "nvhchain").rglob("*.py"):
        if "testing" in path.parts:
            continue
        text = path.read_text(encoding="utf-8")
        read |= set(re.findall(r"environ(?:\.get\(|\.pop\(|\.setdefault\(|\[)\"([A-Z_]+)\"", text))
    page = (
        (root / "docs" / "howto" / "install.md").read_text(encoding="utf-8").partition("## Threads, caches and logs")[2]
    )
    assert {"NUMBA_CACHE_DIR", "XDG_CACHE_HOME"} <= read
    assert sorted(name for name in read | {"NUMBA_NUM_THREADS", "OMP_NUM_THREADS"} if f"`{name}`" not in page) == []


@pytest.mark.parametrize("package", ["error_band", "housing", "plots", "report"])
def test_names_of_packages_that_import_at_first_use_can_be_completed(package):
    of = import_module(f"nvhchain.{package}")
    assert set(of.__all__) <= set(dir(of))
    assert all(getattr(of, name) is not None for name in of.__all__)
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = of.nonsense
