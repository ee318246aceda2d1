"""The plan says what will be modelled; progress appears as single lines where there is no terminal."""

from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.case import Extent, FieldPoint, Ramp
from nvhchain.cli import Console, main
from nvhchain.errors import InputError, ResourceError
from nvhchain.gear import ThinRim
from nvhchain.scene import Scene, check_knobs, planned_steps, preflight
from nvhchain.scene.planned import BASE_MEGABYTES
from nvhchain.scene.radiation import radiation_resistance_step, transfer_vector_step

LARGE = Extent(1.0, "", 30_000)


def test_gearbox_plan_names_every_stage_and_what_symmetry_skips(request):
    case = nvh.load_case(request.config.rootpath / "cases/gearbox/slotted.toml")
    text = str(nvh.plan(case, fidelity=nvh.STANDARD))
    for part in ("housing", "mesh law stage1", "mesh law stage2", "bearing forces", "transfer vectors"):
        assert part in text
    assert "50 teeth slots (10 by symmetry)" in text
    assert "gear4: loads on 41 of 82 teeth" in text
    assert "6000 Hz" in text


def test_plan_costs_rise_with_fidelity(request):
    case = nvh.load_case(request.config.rootpath / "cases/gearbox/solid.toml")
    plans = [nvh.plan(case, fidelity=fidelity) for fidelity in (nvh.DRAFT, nvh.STANDARD, nvh.REFERENCE)]
    assert plans[0].seconds < plans[1].seconds < plans[2].seconds
    assert plans[0].megabytes < plans[1].megabytes < plans[2].megabytes


def test_plan_knows_that_thin_webs_take_more_elements(request):
    case = nvh.load_case(request.config.rootpath / "cases/small/single_stage.toml")
    pinion, wheel = case.gears
    planned = {}
    for thickness in (2e-3, 15e-3):
        web = ThinRim(thickness, 20e-3, wheel.geometry.root_radius - 3 * wheel.geometry.normal_module)
        light = replace(case, gears=(pinion, replace(wheel, blank=web)))
        (planned[thickness],) = [s for s in nvh.plan(light).steps if s.name == "mesh law stage"]
    assert planned[2e-3].seconds > 2 * planned[15e-3].seconds
    assert planned[2e-3].megabytes - BASE_MEGABYTES > 1.3 * (planned[15e-3].megabytes - BASE_MEGABYTES)


@pytest.mark.filterwarnings("ignore:field point .* away from the gearbox")
def test_a_run_up_takes_memory_by_its_record_and_not_by_its_steps(request, monkeypatch):
    """A step is not stored: 200 s in steps of 5 µs, 40 million, are 1.2 GB."""
    case = nvh.load_case(request.config.rootpath / "cases/small/single_stage.toml")
    long = replace(case, operation=replace(case.operation, input_speed=100.0, ramp=Ramp(300.0, 200.0)))
    fine = replace(nvh.DRAFT, dynamics=replace(nvh.DRAFT.dynamics, time_step=5e-6))

    def planned(fidelity, name, of=long):
        return next(stage for stage in nvh.plan(of, fidelity=fidelity).steps if stage.name == name)

    for name in ("bearing forces", "pressure"):
        assert planned(fine, name).megabytes == pytest.approx(planned(nvh.DRAFT, name).megabytes, rel=0.25)
        assert 1200 < planned(fine, name).megabytes < 2600
    heard = replace(long, field_points=tuple(FieldPoint(f"{i}", (1.0 + i, 0.0, 0.0)) for i in range(100)))
    assert planned(fine, "pressure", heard).megabytes > 4 * planned(fine, "pressure").megabytes
    monkeypatch.setattr("nvhchain.scene.checks.free_memory", lambda: 3 * 10**9)
    preflight(long, fine)
    with pytest.raises(ResourceError, match="for its pressure"):
        preflight(heard, fine)


def test_many_field_points_take_time_and_memory(request):
    case = nvh.load_case(request.config.rootpath / "cases/small/single_stage.toml")
    plans = [
        nvh.plan(replace(case, field_points=tuple(FieldPoint(f"{i}", (1.0, 0.001 * i, 0.0)) for i in range(count))))
        for count in (1, 4000)
    ]
    few, many = ({stage.name: stage for stage in plan.steps} for plan in plans)
    for name in ("transfer vectors", "velocity, pressure"):
        assert many[name].seconds > 5 * few[name].seconds
        assert many[name].megabytes > 3 * few[name].megabytes


def test_plan_says_how_the_meshes_are_modelled_and_that_contact_costs_more(request):
    case = nvh.load_case(request.config.rootpath / "cases/small/single_stage.toml")
    planned = {}
    for level, words in (
        ("table", "1 tabulated meshes"),
        ("contact", "the contact problem of 1 meshes in every step"),
    ):
        fidelity = replace(nvh.DRAFT, dynamics=replace(nvh.DRAFT.dynamics, mesh_level=level))
        (planned[level],) = [
            stage for stage in nvh.plan(case, fidelity=fidelity).steps if stage.name == "bearing forces"
        ]
        assert words in planned[level].models
    assert planned["contact"].seconds > 50 * planned["table"].seconds
    gears = max(stage.megabytes for stage in nvh.plan(case, fidelity=nvh.DRAFT).steps if "mesh law" in stage.name)
    assert planned["contact"].megabytes >= gears > planned["table"].megabytes


def test_plan_has_the_load_distribution_where_an_option_takes_it_and_the_housing_where_forces_alone_are_asked(request):
    case = nvh.load_case(request.config.rootpath / "cases/small/single_stage.toml")
    assert "load distribution" not in str(nvh.plan(case))
    rubbing = replace(case, options=replace(case.options, friction=0.05))
    (stage,) = [stage for stage in nvh.plan(rubbing, fidelity=nvh.DRAFT).steps if "load distribution" in stage.name]
    assert stage.name == "load distribution stage"
    assert f"{nvh.DRAFT.gear.angles_per_mesh} angles" in stage.models
    forces = replace(case, quantities=("bearing_forces",), field_points=())
    text = str(nvh.plan(forces))
    assert "housing" in text.splitlines()[2]
    assert "its modes are in the loop of the forces" in text


def test_a_load_distribution_takes_the_gears_finite_elements_where_the_mesh_laws_are_given(request, monkeypatch):
    case = nvh.load_case(request.config.rootpath / "cases/small/single_stage.toml")
    rubbing = replace(case, options=replace(case.options, friction=0.05))
    tilting = replace(case, options=replace(case.options, tilt=True))
    ready = ["mesh_laws", "housing", "transfer_vectors"]
    law, alone = (
        next(stage for stage in planned_steps(Scene(rubbing, nvh.REFERENCE, given)) if stage.name.startswith(name))
        for name, given in (("mesh law", ()), ("load distribution", ready))
    )
    assert alone.megabytes == law.megabytes
    assert alone.seconds > 0.5 * law.seconds
    monkeypatch.setattr("nvhchain.scene.checks.free_memory", lambda: 0.9e6 * law.megabytes)
    with pytest.raises(ResourceError, match="for its load distribution stage"):
        preflight(rubbing, nvh.REFERENCE, ready)
    preflight(rubbing, nvh.REFERENCE, [*ready, "load_distributions"])
    preflight(tilting, nvh.REFERENCE, ready)


def test_a_surface_whose_matrices_fit_compressed_alone_is_not_refused_for_dense_ones(request, monkeypatch):
    case = nvh.load_case(request.config.rootpath / "cases/gearbox/solid.toml")
    monkeypatch.setattr("nvhchain.scene.radiation.free_memory", lambda: 2**40)
    dense, power = (step(case, nvh.STANDARD, LARGE) for step in (transfer_vector_step, radiation_resistance_step))
    monkeypatch.setattr("nvhchain.scene.radiation.free_memory", lambda: 8 * 2**30)
    assert dense.megabytes > 10_000
    assert power.megabytes > 10_000
    assert transfer_vector_step(case, nvh.STANDARD, LARGE).megabytes < 8_000
    assert radiation_resistance_step(case, nvh.STANDARD, LARGE).megabytes < 8_000
    kept = replace(nvh.STANDARD, acoustics=replace(nvh.STANDARD.acoustics, solver="direct"))
    assert transfer_vector_step(case, kept, LARGE).megabytes > 10_000


@pytest.mark.parametrize("step", [transfer_vector_step, radiation_resistance_step])
def test_what_is_planned_fits_beside_the_program_wherever_the_least_does(request, monkeypatch, step):
    case = nvh.load_case(request.config.rootpath / "cases/gearbox/solid.toml")

    def planned(free):
        monkeypatch.setattr("nvhchain.scene.radiation.free_memory", lambda: int(1e6 * free))
        return step(case, nvh.STANDARD, Extent(1.0, "", 20_000)).megabytes

    least, most = planned(0), planned(1e6)
    assert least < 0.8 * most
    for free in np.linspace(least + 1, 2 * most, 200):
        assert planned(free) <= free


def test_sphere_plan_counts_the_triangles_of_the_run(request):
    case = nvh.load_case(request.config.rootpath / "cases/sphere/pulsating.toml")
    faces = len(case.surface_velocity(nvh.STANDARD.acoustics).surface.triangles)
    assert f"about {faces} triangles" in str(nvh.plan(case, fidelity=nvh.STANDARD))


def test_a_record_too_long_for_the_memory_is_refused_with_what_shortens_it(request):
    case = nvh.load_case(request.config.rootpath / "cases/gearbox/solid.toml")
    with pytest.raises(ResourceError, match=r"raise band.resolution or input_speed, .* its record lasts 1e\+06 s"):
        preflight(replace(case, band=replace(case.band, resolution=1e-6)), nvh.DRAFT)


def test_the_command_refuses_the_plan_of_a_run_that_would_be_refused(request, tmp_path, capsys):
    base = request.config.rootpath / "cases/gearbox/solid.toml"
    (tmp_path / "high.toml").write_text(f'base = "{base}"\n[band]\nhigh = 9000\n')
    assert main(["plan", str(tmp_path / "high.toml"), "--fidelity", "draft"]) == 2
    assert "time step 20 µs does not sample 9000 Hz" in capsys.readouterr().err


def test_a_time_step_is_not_looked_at_when_the_forces_are_given(request):
    case = nvh.load_case(request.config.rootpath / "cases/gearbox/solid.toml")
    case = replace(case, band=replace(case.band, high=9000.0))
    with pytest.raises(InputError, match="time step"):
        preflight(case, nvh.DRAFT)
    preflight(case, nvh.DRAFT, ["bearing_forces", "housing", "transfer_vectors"])


def test_angles_too_few_for_the_second_harmonic_are_refused_unless_the_laws_are_given(request):
    case = nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")
    few = replace(nvh.DRAFT, gear=replace(nvh.DRAFT.gear, angles_per_mesh=5))
    with pytest.raises(InputError, match=r"angles_per_mesh = 5 leave .* open: at least 6"):
        check_knobs(case, few)
    for given in ("mesh_laws", "bearing_forces"):
        check_knobs(case, few, (given,))
    check_knobs(case, replace(few, gear=replace(few.gear, angles_per_mesh=6)))


@pytest.fixture
def wide(request, tmp_path):
    """The small gearbox with faces of some mm, in a case file."""
    text = (request.config.rootpath / "cases" / "small" / "single_stage.toml").read_text()

    def written(width):
        end = 130 + width
        changed = text.replace("z_mm = 75", f"z_mm = {end / 2}").replace("0, 127]", f"0, {end - 3}]")
        changed = changed.replace("0.62]", "3.0]").replace("face_width_mm = 16", f"face_width_mm = {width}")
        for old, new in (("end_mm = 130", end), ("z_mm = 127", end - 3), ("\ndepth_mm = 130", end)):
            changed = changed.replace(old, f"{old.split(' = ')[0]} = {new}")
        (tmp_path / "wide.toml").write_text(changed)
        return tmp_path / "wide.toml"

    return written


@pytest.mark.slow
def test_faces_on_which_a_tooth_would_touch_at_two_places_are_refused_by_check(wide, capsys):
    """The run refused them once the housing was there."""
    assert main(["check", str(wide(1000))]) == 2
    assert "stage stage: 23 teeth would be in contact at once, overlap ratio 20.5, but a gear has 20" in (
        capsys.readouterr().err
    )
    assert main(["check", str(wide(500))]) == 0


def test_more_slices_than_are_solved_are_refused_with_how_many_are(wide):
    case = nvh.load_case(wide(300))
    with pytest.raises(InputError) as refused:
        check_knobs(case, replace(nvh.DRAFT, gear=replace(nvh.DRAFT.gear, slices=400)))
    told = "gear slices = 400 make 2457 over the face of stage stage, 1000 at most are solved: choose 162 or"
    assert told in str(refused.value)
    check_knobs(case, replace(nvh.DRAFT, gear=replace(nvh.DRAFT.gear, slices=162)))


@pytest.mark.parametrize(("torque", "flank"), [(60.0, "drive_reach"), (-60.0, "back_reach")])
def test_mesh_laws_that_end_below_the_load_are_refused_unless_they_are_given(request, torque, flank):
    case = nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")
    case = replace(case, operation=replace(case.operation, input_torque=torque))
    short = replace(nvh.DRAFT, gear=replace(nvh.DRAFT.gear, **{flank: 0.9}))
    with pytest.raises(InputError, match=rf"{flank} = 0\.9 may end the mesh laws below the force.* at least 1\.2,"):
        check_knobs(case, short)
    check_knobs(case, short, ("mesh_laws",))
    check_knobs(case, replace(short, gear=replace(short.gear, **{flank: 1.2})))


def test_without_a_terminal_a_stage_is_a_line_at_its_begin_and_one_at_its_end(capsys):
    console = Console()
    console.begin("housing")
    for done in range(5):
        console.step("housing", done, 4)
    console.end("housing", "computed")
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert lines[0] == "housing …"
    assert lines[1].startswith("housing: computed in ")


def test_on_a_terminal_a_bar_shows_the_phase_and_the_share(capsys, monkeypatch):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    console = Console()
    console.begin("housing")
    console.step("housing", 1, 2)
    console.end("housing", "computed")
    shown = capsys.readouterr().err
    assert "housing:  50%" in shown
    assert "housing: computed in" in shown


@pytest.mark.parametrize("arguments", [["run"], ["run", "x.toml", "--fidelity", "fast"], ["dance"]])
def test_wrong_arguments_are_one_line_and_exit_code_2(arguments, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    assert stopped.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1
