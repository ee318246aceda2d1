"""Radiation resistance and sound power go on with the bands that a run had finished, as transfer vectors do."""

from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.acoustics import Adaptive, ExteriorProblem, SurfaceShapes, Work, sphere
from nvhchain.acoustics.systems.frequency_blocks import BAND
from nvhchain.conventions import Air
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.files import hdf5
from nvhchain.handoff import SolvedBand, SurfaceVelocity
from tests.rounding import same

BODY, AIR = sphere(0.1, 2), Air(343.0, 1.21)
FIDELITY = AcousticsFidelity(elements_per_wavelength=3.0, masters=32, master_tolerance_db=0.1)
LINES = np.linspace(100.0, 2000.0, 10)
SHAPES = SurfaceShapes(BODY, np.stack([np.ones(len(BODY.areas)), BODY.normals[:, 2]], axis=1))
VELOCITY = SurfaceVelocity(LINES, np.outer(1 + 1j * LINES, SHAPES.shapes.sum(axis=1)), BODY)
POINT = [[0.0, 0.2, 1.0]]
PROBLEM = ExteriorProblem(BODY, air=AIR, fidelity=FIDELITY)

pytestmark = pytest.mark.filterwarnings("ignore:the parts of the motion cancel")


def waves(folder, *, problem=PROBLEM, shapes=SHAPES, **more):
    return problem.resistance(shapes, LINES, Work(checkpoints=folder, **more)).waves


def power(folder, *, problem=PROBLEM, velocity=VELOCITY, **more):
    return problem.power(velocity, Work(checkpoints=folder, **more)).power


def pressure(folder, *, problem=PROBLEM, velocity=VELOCITY, **more):
    return problem.pressure(velocity, POINT, Work(checkpoints=folder, **more)).pressure


class Interrupted(Exception):
    pass


def interrupt(after):
    """Progress that stops a run once so many frequencies are done."""

    def progress(done, total):
        if done >= after:
            raise Interrupted

    return progress


@pytest.mark.parametrize("run", [waves, power, pressure])
def test_an_interrupted_run_solves_only_what_is_missing(tmp_path, solved, run):
    whole = run(None)
    with pytest.raises(Interrupted):
        run(tmp_path, progress=interrupt(BAND + 1))
    there = list(tmp_path.glob("*.h5"))
    assert len(there) == 2
    solved.clear()
    assert same(run(tmp_path), whole, 1e-13)
    assert len(solved) == len(LINES) - BAND * len(there)
    solved.clear()
    assert same(run(tmp_path), whole, 1e-13)
    assert solved == []


@pytest.mark.slow
@pytest.mark.parametrize("run", [waves, power, pressure])
def test_damaged_bands_and_those_of_other_air_are_solved_again(tmp_path, solved, run):
    whole = run(tmp_path)
    solved.clear()
    first = min(tmp_path.glob("*.h5"))
    first.write_bytes(first.read_bytes()[: first.stat().st_size // 2])
    assert same(run(tmp_path), whole, 1e-13)
    assert len(solved) in (BAND, len(LINES) % BAND)
    solved.clear()
    assert not same(run(tmp_path, problem=replace(PROBLEM, air=Air(343.0, 1.2))), whole, 1e-13)
    assert len(solved) == len(LINES)


@pytest.mark.slow
def test_bands_of_another_motion_are_not_used(tmp_path, solved):
    for run in (power, waves, pressure):
        run(tmp_path)
    solved.clear()
    twice = VELOCITY.replace(normal_velocity=2 * VELOCITY.normal_velocity)
    power(tmp_path, velocity=twice)
    waves(tmp_path, shapes=replace(SHAPES, shapes=2 * SHAPES.shapes))
    pressure(tmp_path, velocity=twice)
    assert len(solved) == 3 * len(LINES)


@pytest.mark.slow
def test_chosen_masters_are_asked_for_again_when_the_run_goes_on(tmp_path, solved):
    """Beyond the first masters they come from what was solved."""
    problem = replace(PROBLEM, fidelity=replace(FIDELITY, master_tolerance_db=1e-3))
    whole = problem.resistance(SHAPES, Adaptive(50.0, 2000.0))
    count = len(whole.frequency)
    with pytest.raises(Interrupted):
        problem.resistance(SHAPES, Adaptive(50.0, 2000.0), Work(None, interrupt(count - BAND + 1), tmp_path))
    kept = sum(len(hdf5.load(path, SolvedBand).frequency) for path in tmp_path.glob("*.h5"))
    assert kept >= count - BAND
    solved.clear()
    again = problem.resistance(SHAPES, Adaptive(50.0, 2000.0), Work(checkpoints=tmp_path))
    assert len(solved) == count - kept
    assert same(again.waves, whole.waves, 1e-13)
    solved.clear()
    problem.resistance(SHAPES, Adaptive(50.0, 2000.0), Work(checkpoints=tmp_path))
    assert solved == []


def test_the_chain_goes_on_with_the_lines_of_a_sound_power(request, tmp_path, solved):
    case = nvh.load_case(request.config.rootpath / "cases" / "sphere" / "pulsating.toml")
    case = replace(case, quantities=("sound_power",), frequencies=tuple(LINES))

    class Watcher:
        def begin(self, stage):
            pass

        def step(self, stage, done, total):
            if stage == "sound_power" and done > BAND:
                raise Interrupted

        def end(self, stage, how):
            pass

    with pytest.raises(Interrupted):
        nvh.run(case, fidelity=nvh.DRAFT, out=tmp_path, watcher=Watcher())
    kept = list(tmp_path.glob("sound_power-*.parts/*.h5"))
    assert len(kept) == 2
    solved.clear()
    nvh.run(case, fidelity=nvh.DRAFT, out=tmp_path)
    assert len(solved) == len(LINES) - 2 * BAND
    assert [path.suffix for path in tmp_path.glob("sound_power*")] == [".h5"]
