"""The gearbox, solid and slotted, from drawing to sound pressure: what is left on disk and what it says."""

import json
from collections import Counter
from dataclasses import replace
from threading import Event

import numpy as np
import pytest
from scipy.io import wavfile

import nvhchain as nvh
from nvhchain.acoustics import solve_direct
from nvhchain.errors import InputError
from nvhchain.files import hdf5
from nvhchain.handoff import (
    BearingForces,
    FieldPressure,
    ForceSpectrum,
    MeshLaw,
    ReducedHousing,
    SurfaceVelocity,
    TransferVectors,
)
from nvhchain.levels import a_weighting, decibel, equivalent
from nvhchain.report import compare
from nvhchain.report.pictures import compared
from nvhchain.report.summary import write_summary

pytestmark = pytest.mark.filterwarnings("ignore:housing elements of")  # models are coarse on purpose

SLOT_ORDERS = (2, 6, 10, 14, 18, 22)


def test_everything_asked_for_is_on_disk(compared):
    out, summary, _ = compared
    for name in ("pressure_spectrum", "pressure_history", "transmission_errors", "bearing_forces"):
        assert (out / f"{name}.png").stat().st_size > 10_000
    assert json.loads((out / "summary.json").read_text()) == summary
    assert "slotted − solid" in (out / "differences.txt").read_text()
    for name in ("solid", "slotted"):
        assert (out / f"surface_velocity-{name}.png").stat().st_size > 10_000
        rate, samples = wavfile.read(out / f"sound-{name}.wav")
        assert rate == 48000
        assert 4.0 <= len(samples) / rate < 6.0
        sound = summary["configurations"][name]["sound"]
        assert np.sqrt(np.mean(samples.astype(float) ** 2)) == pytest.approx(sound["rms_Pa"], rel=1e-5)  # float32
        level = equivalent(samples.astype(float), sample_rate=float(rate))
        assert level == pytest.approx(summary["configurations"][name]["overall_dBA"], abs=1e-3)
        kinds = {type(hdf5.load(path)) for path in (out / name).glob("*.h5")}
        assert kinds == {BearingForces, ForceSpectrum, SurfaceVelocity, FieldPressure}
    operators = [type(hdf5.load(path)) for path in (out / "operators").glob("*.h5")]
    # other tests of the session share the folder
    assert Counter((ReducedHousing, TransferVectors, MeshLaw, MeshLaw, MeshLaw)) <= Counter(operators)
    assert not list(out.rglob("*.part"))


def test_operators_are_computed_once_for_both_configurations(compared):
    began = compared[2].began
    assert began.count("housing") == began.count("transfer_vectors") == 1
    assert began.count("mesh_law_stage1") == 2
    assert began.count("mesh_law_stage2") == 1
    assert began.count("bearing_forces") == 2


def test_summary_holds_speed_level_and_orders_of_the_input(compared):
    out, summary, _ = compared
    housings = {hdf5.load(path).content_hash for path in (out / "operators").glob("housing*.h5")}
    for configuration in summary["configurations"].values():
        assert configuration["housing"] in housings
        assert configuration["input_speed_rpm"] == pytest.approx(2500.0)
        assert 30 < configuration["overall_dBA"] < 110
        lower, upper = configuration["error_band_dBA"]
        assert lower is None or lower < configuration["overall_dBA"] - 3  # meshes this coarse leave little certain
        assert configuration["overall_dBA"] < upper < configuration["overall_dBA"] + 30
        for line, band in zip(configuration["orders"], configuration["lines"], strict=True):
            assert band["frequency_hz"] == line["frequency_hz"]
            assert band["limits_db"][1] >= line["level_db"] >= (band["limits_db"][0] or -1000)
        assert configuration["other_quantities"] == {}
        order = {round(line["order"], 6): line for line in configuration["orders"]}
        assert {12.0, 20.0, 24.0} <= set(order)
        assert order[20.0]["frequency_hz"] == pytest.approx(20 * 2500 / 60)
        energy = sum(10 ** (line["level_db"] / 10) for line in configuration["orders"])
        assert 10 * np.log10(energy) > configuration["overall_dBA"] - 3


def test_the_difference_has_limits_of_its_own(compared):
    """Meshes this coarse leave open which is louder."""
    first, second = compared[1]["configurations"].values()
    assert "difference_limits_db" not in first
    low, high = second["difference_limits_db"]
    assert low < -3 < 3 < high


def test_the_two_quietest_of_several_have_limits_of_their_difference(request, tmp_path):
    """Three pulsating spheres, whose levels differ by the ratios of their velocities."""
    sphere = nvh.load_case(request.config.rootpath / "cases/sphere/pulsating.toml")
    sizes = {"loud": 1.0, "middle": 0.5, "quiet": 0.4}
    cases = [replace(sphere, name=name, pulsation=size * sphere.pulsation) for name, size in sizes.items()]
    results = {case.name: nvh.run(case, fidelity=nvh.DRAFT) for case in cases}
    quietest = write_summary(results, tmp_path)["quietest"]
    assert quietest["names"] == ["quiet", "middle"]
    low, high = quietest["difference_limits_db"]
    assert 1.0 < low < 20 * np.log10(0.5 / 0.4) < high < 3.0
    del results["loud"]
    assert "quietest" not in write_summary(results, tmp_path)


@pytest.mark.slow
def test_the_answer_comes_before_the_figures_and_an_earlier_comparison_leaves_none(request, tmp_path):
    sphere = nvh.load_case(request.config.rootpath / "cases/sphere/pulsating.toml")
    there = []

    def answered(summary):
        there.append((json.loads((tmp_path / "summary.json").read_text()) == summary, sorted(tmp_path.glob("*.png"))))

    compare([replace(sphere, name="earlier")], fidelity=nvh.DRAFT, out=tmp_path)
    (tmp_path / "levels_over_speed.png").write_text("of an earlier comparison")
    (tmp_path / "sound-measured.wav").write_text("of the user")
    with pytest.raises(InputError):
        compare([replace(sphere, frequencies=(1e5,))], fidelity=nvh.DRAFT, out=tmp_path)
    assert (tmp_path / "sound-earlier.wav").is_file()
    compare([replace(sphere, name="later")], fidelity=nvh.DRAFT, out=tmp_path, answered=answered)
    assert there == [(True, [])]
    files = {path.name for path in tmp_path.iterdir() if path.is_file()}
    assert {
        "summary.json",
        "report.html",
        "sound-measured.wav",
        "pressure_spectrum.png",
        "surface_velocity-later.png",
    } <= files
    assert not {"levels_over_speed.png", "surface_velocity-earlier.png", "sound-earlier.wav"} & files


def test_slot_orders_are_heard_only_with_slots(compared):
    """Orders 2 mod 4 of the input: in the bearing forces present with slots and 80 dB down without; in the pressure,
    where the housing hardly radiates at 83 Hz, 80 dB above what the solid gear leaves there."""
    out, summary, _ = compared
    level = {
        name: {round(line["order"], 6): line["level_db"] for line in configuration["orders"]}
        for name, configuration in summary["configurations"].items()
    }
    for name, orders in level.items():
        strongest = max(orders.values())
        relative = np.array([orders[float(order)] - strongest for order in SLOT_ORDERS])
        force = hdf5.load(out / name / "force_spectrum.h5", ForceSpectrum)
        lines = [np.argmin(np.abs(force.frequency - order * 2500 / 60)) for order in SLOT_ORDERS]
        size = np.abs(force.force).max(axis=(1, 2))
        if name == "solid":
            assert relative.max() < -80
            assert size[lines].max() < 1e-4 * size.max()
        else:
            solid = np.array([level["solid"][float(order)] for order in SLOT_ORDERS])
            assert (relative + strongest - solid).min() > 80
            assert size[lines].min() > 1e-4 * size.max()


@pytest.mark.slow
def test_a_second_run_finds_every_stage(compared, cases, coarse, record):
    out, summary, _ = compared
    (out / "report.html").unlink()  # else nothing is looked for
    assert compare(cases, fidelity=coarse, out=out, watcher=record) == summary
    assert record.began == []
    assert {how for _, how in record.ended} == {"cached"}


def test_an_interrupted_run_resumes_from_what_is_finished(compared, cases, coarse, record, tmp_path):
    out = compared[0]

    class Interrupt(type(record)):
        def begin(self, stage):
            super().begin(stage)
            if stage == "surface_velocity":
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        nvh.run(cases[0], fidelity=coarse, out=tmp_path, operators=out / "operators", watcher=Interrupt())
    result = nvh.run(cases[0], fidelity=coarse, out=tmp_path, operators=out / "operators", watcher=record)
    assert record.began == ["surface_velocity", "pressure"]
    assert result.pressure.content_hash == hdf5.load(out / "solid" / "pressure.h5").content_hash


def test_ready_made_hand_offs_are_taken_and_what_only_they_needed_is_not_computed(compared, cases, coarse, record):
    out = compared[0]
    housing = hdf5.load(next((out / "operators").glob("housing-*.h5")), ReducedHousing)
    vectors = hdf5.load(next((out / "operators").glob("transfer_vectors-*.h5")), TransferVectors)
    forces = hdf5.load(out / "slotted" / "bearing_forces.h5", BearingForces)
    result = nvh.run(
        cases[1], fidelity=coarse, housing=housing, transfer_vectors=vectors, bearing_forces=forces, watcher=record
    )
    assert record.began == ["force_spectrum", "surface_velocity", "pressure"]
    assert result.mesh_laws == ()
    assert result.pressure.content_hash == hdf5.load(out / "slotted" / "pressure.h5").content_hash


def test_transfer_vectors_give_the_pressure_of_a_direct_solution_at_a_master(compared, cases, coarse):
    """Identity at a master frequency, 1e-8, on the gearbox surface with the gearbox's own velocity pattern."""
    out = compared[0]
    vectors = hdf5.load(next((out / "operators").glob("transfer_vectors-*.h5")), TransferVectors)
    velocity = hdf5.load(out / "slotted" / "surface_velocity.h5", SurfaceVelocity)
    strongest = np.argmax(np.abs(velocity.normal_velocity).max(axis=1))
    master = vectors.frequency[4]
    pattern = SurfaceVelocity([master], velocity.normal_velocity[[strongest]], velocity.surface)
    direct = solve_direct(pattern, vectors.points, air=cases[0].air, fidelity=coarse.acoustics)
    product = vectors.vectors[4] @ pattern.normal_velocity[0]
    assert np.abs(product - direct.pressure[0]).max() < 1e-8 * np.abs(direct.pressure).max()


def test_every_hand_off_carries_fidelity_and_version(compared):
    out = compared[0]
    for path in out.rglob("*.h5"):
        provenance = hdf5.load(path).provenance
        assert provenance["version"].startswith(nvh.__version__)
        assert "key" in provenance


def test_lines_that_pass_the_edge_of_the_band_by_rounding_share_its_transfer_vectors(compared, cases, coarse, record):
    out, _, _ = compared
    velocity = hdf5.load(out / "solid" / "surface_velocity.h5", SurfaceVelocity)
    high = cases[0].band.high
    lines = np.append(velocity.frequency[:-1], high * (1 + 1e-15))
    nudged = velocity.replace(frequency=lines)
    run = nvh.run(cases[0], fidelity=coarse, operators=out / "operators", surface_velocity=nudged, watcher=record)
    assert [how for stage, how in record.ended if stage.startswith("transfer_vectors")] == ["cached"]
    assert run.pressure.pressure.shape[0] == len(lines)


def test_a_case_named_like_a_file_of_the_comparison_is_refused_before_it_is_run(request, tmp_path):
    sphere = nvh.load_case(request.config.rootpath / "cases/sphere/pulsating.toml")
    with pytest.raises(InputError, match=r"'summary.json' .* files that end in .json: choose another"):
        compare([replace(sphere, name="summary.json")], fidelity=nvh.DRAFT, out=tmp_path)
    with pytest.raises(InputError, match="no cases are given: at least one is needed"):
        compare([], fidelity=nvh.DRAFT, out=tmp_path)
    assert not list(tmp_path.iterdir())


def test_microphones_of_one_name_at_two_places_are_refused_before_a_run(request, tmp_path):
    """14.5 dB of distance were told as a change of the excitation."""
    case = nvh.load_case(request.config.rootpath / "cases/sphere/pulsating.toml")
    (point, *rest) = case.field_points
    moved = replace(point, position=(point.position[0], point.position[1], point.position[2] + 1.5))
    other = replace(case, name="other", field_points=(moved, *rest))
    with pytest.raises(InputError, match=rf"microphone {point.name} stands at \(.*\) m in {case.name} and at"):
        compare([case, other], fidelity=nvh.DRAFT, out=tmp_path)
    assert not list(tmp_path.iterdir())


def test_surfaces_are_rendered_beside_the_other_figures(request, tmp_path, monkeypatch):
    """Each waits for the other here, and one after the other would wait in vain."""
    sphere = nvh.load_case(request.config.rootpath / "cases/sphere/pulsating.toml")
    rendering, saved, save, lines = Event(), Event(), compared.save, set()

    def rendered(velocity, line):
        lines.add(line)
        rendering.set()
        assert saved.wait(20), "no figure was saved while a surface was rendered"

    def saving(axes, path):
        assert rendering.wait(20), "no surface was rendered while a figure was saved"
        save(axes, path)
        saved.set()

    monkeypatch.setattr("nvhchain.plots.rendered_surface", rendered)
    monkeypatch.setattr(compared, "save", saving)
    compare([sphere, replace(sphere, name="twin")], fidelity=nvh.DRAFT, out=tmp_path)
    told = hdf5.load(tmp_path / "twin" / "pressure.h5", FieldPressure)
    assert lines == {int((decibel(told.pressure[:, 0]) + a_weighting(told.frequency)).argmax())}
    for name in ("pressure_spectrum", "surface_velocity-pulsating-sphere", "surface_velocity-twin"):
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000
