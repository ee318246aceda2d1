"""A case gets what it asks for, and nothing is computed that only other quantities need."""

from dataclasses import replace

import pytest

import nvhchain as nvh
from nvhchain import store
from nvhchain.cli import main
from nvhchain.errors import InputError
from nvhchain.handoff import ForceSpectrum, SurfaceVelocity
from nvhchain.report import compare


@pytest.fixture
def asked(cases, coarse, compared, record):
    """Run the solid gearbox for `quantities` on the operators of the comparison; the stages that were touched."""

    def run(*quantities, **changes):
        case = replace(cases[0], quantities=quantities, **changes)
        result = nvh.run(case, fidelity=coarse, operators=compared[0] / "operators", watcher=record)
        return result, [stage for stage, _ in record.ended]

    return run


def test_bearing_forces_alone_move_no_surface_and_need_no_field_point(asked, compared):
    result, stages = asked("bearing_forces", field_points=())
    assert stages == ["housing", "mesh_law_stage1", "mesh_law_stage2", "bearing_forces", "force_spectrum"]
    assert result.surface_velocity is result.transfer_vectors is result.pressure is None
    compared_forces = store.load(compared[0] / "solid" / "force_spectrum.h5", ForceSpectrum)
    assert result.force_spectrum.content_hash == compared_forces.content_hash


def test_surface_velocity_alone_takes_no_boundary_elements(asked, compared):
    result, stages = asked("surface_velocity", field_points=())
    assert stages[-1] == "surface_velocity"
    assert "transfer_vectors" not in stages
    velocity = store.load(compared[0] / "solid" / "surface_velocity.h5", SurfaceVelocity)
    assert result.surface_velocity.content_hash == velocity.content_hash


def test_plan_leaves_out_what_is_not_asked_for(cases, coarse):
    plans = {
        quantity: [stage.name for stage in nvh.plan(replace(cases[0], quantities=(quantity,)), fidelity=coarse).stages]
        for quantity in ("bearing_forces", "surface_velocity", "pressure")
    }
    assert plans["bearing_forces"] == ["housing", "mesh law stage1", "mesh law stage2", "bearing forces"]
    assert plans["surface_velocity"] == [*plans["bearing_forces"], "velocity"]
    assert plans["pressure"] == [*plans["bearing_forces"], "transfer vectors", "velocity, pressure"]


def test_quantities_that_cannot_be_had_are_refused(request, cases, coarse, tmp_path):
    case = cases[0]
    ramp = replace(
        case.operation, ramp=nvh.load_case(request.config.rootpath / "cases/gearbox/run_up_solid.toml").operation.ramp
    )
    for changes, reason in (
        ({"quantities": ()}, "at least one"),
        ({"quantities": ("pressure", "pressure")}, "none twice"),
        ({"field_points": ()}, "asked for nowhere"),
        ({"quantities": ("surface_velocity",), "operation": ramp}, "has no lines"),
    ):
        with pytest.raises(InputError, match=reason):
            replace(case, **changes)
    with pytest.raises(InputError, match="does not ask for `pressure`"):
        compare([replace(case, quantities=("bearing_forces",))], fidelity=coarse, out=tmp_path)


def test_command_line_says_where_the_quantities_are(request, tmp_path, capsys):
    sphere = request.config.rootpath / "cases/sphere/pulsating.toml"
    path = tmp_path / "case.toml"
    path.write_text(f'base = "{sphere}"\nquantities = ["surface_velocity"]\n')
    assert main(["run", str(path), "--fidelity", "draft", "--out", str(tmp_path / "out")]) == 0
    assert "surface_velocity in" in capsys.readouterr().out
    assert store.load(tmp_path / "out" / "surface_velocity.h5", SurfaceVelocity).frequency.tolist() == [200, 1000, 1715]
    path.write_text(f'base = "{sphere}"\nquantities = ["loudness"]\n')
    assert main(["check", str(path)]) == 2
    assert "choose one of" in capsys.readouterr().err
