"""Every accuracy knob is swept or is excluded with a reason, and turning one leaves the others alone."""

from dataclasses import asdict, fields, replace

import pytest

import nvhchain as nvh
from nvhchain.case import HousingModel, ModalResults, Ramp, SurfaceFile
from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT, REFERENCE, STANDARD
from nvhchain.tradeoff import SWEPT_KNOBS, UNSWEPT, knobs_of, records, variants
from nvhchain.tradeoff.sweep import case_identity

STAGES = ("gear", "dynamics", "housing", "acoustics")


def test_every_field_of_every_stage_is_swept_or_left_out_with_a_reason():
    swept = {f"{knob.package}.{field}" for knob in SWEPT_KNOBS for field in knob.fields}
    every = {f"{stage}.{field.name}" for stage in STAGES for field in fields(getattr(REFERENCE, stage))}
    assert swept | set(UNSWEPT) == every
    assert all(UNSWEPT.values())
    assert not swept & set(UNSWEPT)


@pytest.mark.parametrize("knob", SWEPT_KNOBS, ids=lambda knob: knob.name)
def test_a_knob_changes_its_own_fields_and_no_others_and_each_setting_is_valid(knob):
    base = asdict(REFERENCE)
    for value in knob.values:
        turned = knob.apply(REFERENCE, value)
        changed = {
            f"{stage}.{name}"
            for stage in STAGES
            for name, setting in asdict(turned)[stage].items()
            if setting != base[stage][name]
        }
        assert changed <= {f"{knob.package}.{field}" for field in knob.fields}
        assert knob.value_in(turned) == value
        assert bool(changed) == (value != knob.value_in(REFERENCE))


def test_variants_leave_out_the_base_and_end_with_the_other_presets(sphere, gearbox):
    for case in (sphere, gearbox):
        made = variants(case, STANDARD)
        assert [row[1] for row in made if row[0] == "preset"] == ["draft", "reference"]
        assert all(asdict(fidelity) | {"name": ""} != asdict(STANDARD) | {"name": ""} for _, _, fidelity in made)
        assert len({(knob, value) for knob, value, _ in made}) == len(made)
    single = replace(DRAFT, acoustics=replace(DRAFT.acoustics, precision="single"))
    mine = variants(sphere, replace(DRAFT, name="mine"), ["preset"])
    assert [row[:2] for row in mine if row[0] == "preset"] == [("preset", "standard"), ("preset", "reference")]
    assert [row[0] for row in variants(sphere, DRAFT, ["acoustics.precision"])] == ["acoustics.precision"]
    assert variants(sphere, single, ["acoustics.precision"]) == ()


def test_a_radiator_turns_acoustics_only_and_a_steady_gearbox_nothing_of_the_run_up(sphere, gearbox):
    assert {knob.package for knob in knobs_of(sphere)} == {"acoustics"}
    assert {knob.package for knob in knobs_of(gearbox)} == set(STAGES)
    assert not any(knob.run_up for knob in knobs_of(gearbox))


def test_a_housing_from_elsewhere_has_no_elements_to_turn(gearbox):
    own = {knob.name for knob in knobs_of(gearbox)}
    elements = {"housing.element_size", "housing.elements_per_turn"}
    model = replace(gearbox, housing=HousingModel("housing.bdf", "mm-t-s"))
    modes = replace(gearbox, housing=ModalResults("modes.unv"))
    shaped = replace(gearbox, housing=ModalResults("modes.unv", surface=SurfaceFile("skin.stl")))
    faces = "acoustics.elements_per_wavelength+coarsest_elements_per_wavelength"
    assert {knob.name for knob in knobs_of(model)} == own - elements
    assert {knob.name for knob in knobs_of(modes)} == own - elements
    assert {knob.name for knob in knobs_of(shaped)} == {knob.name for knob in knobs_of(modes)} - {faces}
    with pytest.raises(InputError, match=r"'housing.element_size' is unknown or not used"):
        knobs_of(model, ["housing.element_size"])


def test_a_given_surface_is_not_meshed_anew(sphere):
    faces = "acoustics.elements_per_wavelength+coarsest_elements_per_wavelength"
    given = replace(sphere, body=SurfaceFile("body.stl"))
    assert {knob.name for knob in knobs_of(sphere)} - {knob.name for knob in knobs_of(given)} == {faces}


def test_ready_made_hand_offs_leave_the_knobs_of_what_is_still_made(gearbox):
    def stages(*given):
        return {knob.package for knob in knobs_of(gearbox, supplied=given)}

    assert stages("mesh_laws") == {"dynamics", "housing", "acoustics"}
    assert stages("force_spectrum") == {"housing", "acoustics"}
    assert stages("housing") == {"gear", "dynamics", "acoustics"}
    assert stages("surface_velocity") == {"acoustics"}
    between = {knob.name for knob in knobs_of(gearbox, supplied=("surface_velocity", "transfer_vectors"))}
    assert between == {"acoustics.interpolation_points", "acoustics.interpolation_poles"}
    rubbing = replace(gearbox, options=replace(gearbox.options, friction=0.05))
    assert "gear" in {knob.package for knob in knobs_of(rubbing, supplied=("mesh_laws",))}  # of its load distribution


def test_the_contact_problem_in_the_time_loop_is_swept_where_it_is_named_with_its_value(gearbox):
    for names in (None, ["dynamics"]):
        assert ("dynamics.mesh_level", "contact") not in {row[:2] for row in variants(gearbox, DRAFT, names)}
    with pytest.raises(InputError, match=r"'dynamics.mesh_level' is unknown .* dynamics.mesh_level=contact,"):
        knobs_of(gearbox, ["dynamics.mesh_level"])
    asked = [row[:2] for row in variants(gearbox, DRAFT, ["dynamics.mesh_level=contact"])]
    assert asked == [("dynamics.mesh_level", "contact")]


def test_records_of_other_lengths_change_the_line_spacing_or_the_duration_and_nothing_else(sphere, gearbox):
    made = records(gearbox)
    assert [row[:2] for row in made] == [("record.band.resolution", value) for value in ("120", "60", "15")]
    assert all(replace(case, band=gearbox.band) == gearbox for _, _, case in made)
    assert made[0][2].band.resolution == 120.0
    rising = replace(gearbox, operation=replace(gearbox.operation, ramp=Ramp(400.0, 8.0)))
    made = records(rising, ["gear", "record"])
    assert [row[:2] for row in made] == [("record.ramp.duration", value) for value in ("2", "4", "16")]
    assert all(replace(case, operation=rising.operation) == rising for _, _, case in made)
    assert records(gearbox, ["gear"]) == records(sphere) == ()
    with pytest.raises(InputError, match="'record' is unknown or not used"):
        knobs_of(sphere, ["record"])


def test_knobs_are_chosen_by_knob_field_or_stage_and_unknown_names_are_refused(gearbox):
    assert [knob.name for knob in knobs_of(gearbox, ["gear.slices"])] == ["gear.slices"]
    joint = knobs_of(gearbox, ["acoustics.close_orders"])
    assert [knob.name for knob in joint] == ["acoustics.close_distances+close_orders"]
    assert {knob.package for knob in knobs_of(gearbox, ["housing"])} == {"housing"}
    with pytest.raises(InputError, match=r"knob 'gear.sliecs' is unknown") as refused:
        knobs_of(gearbox, ["gear.sliecs"])
    known = str(refused.value).split("known: ")[1].split(", ")
    assert len(set(known)) == len(known)
    assert "dynamics.mesh_level=contact" in known
    for name in known:
        knobs_of(gearbox, [name])


def test_a_deck_beside_modes_belongs_to_the_identity_of_a_case(tmp_path, pytestconfig, monkeypatch):
    """The case names it, and so do further files of a superelement."""
    case = nvh.load_case(pytestconfig.rootpath / "cases" / "small" / "single_stage.toml")
    (tmp_path / "modes.pch").write_text("modes")
    (tmp_path / "deck.bdf").write_text("one deck")
    housing = ModalResults("modes.pch", deck="deck.bdf")
    imported = replace(case, housing=housing, folder=str(tmp_path))
    monkeypatch.setattr(ModalResults, "model", lambda self, case: (tmp_path / self.deck).read_bytes())
    before = case_identity(imported)
    assert case_identity(imported) == before
    (tmp_path / "deck.bdf").write_text("another one")
    assert case_identity(imported) != before
