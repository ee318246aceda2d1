"""The JSON Schema of case files, for editors."""

import json
import tomllib
from pathlib import Path

import jsonschema
import pytest

from nvhchain.case import case_schema
from nvhchain.case.toml.schema import schema_text
from nvhchain.cli import main

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "cases").glob("*/*.toml"))


@pytest.fixture(scope="module")
def validator():
    schema = case_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_cases_fit_the_schema(example, validator):
    validator.validate(tomllib.loads(example.read_text(encoding="utf-8")))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("face_width_mm", "face_widht_mm"),
        ("face_width_mm", "face_width_deg"),
        ("teeth = 20", "teeth = 20.5"),
        ("input_torque = 60", 'input_torque = "60"'),
        ("axis_mm = [0, 0]", "axis_mm = [0, 0, 0]"),
        ('kind = "gearbox"', 'kind = "gear"'),
        ('kind = "gearbox"', ""),
        ("[housing]", '[housing]\ntype = "cast"'),
    ],
)
def test_mistakes_do_not_fit_the_schema(old, new, validator):
    text = (ROOT / "cases/small/single_stage.toml").read_text(encoding="utf-8")
    assert old in text
    with pytest.raises(jsonschema.ValidationError):
        validator.validate(tomllib.loads(text.replace(old, new, 1)))


def test_the_file_for_editors_is_that_of_the_classes(tmp_path, capsys):
    assert (ROOT / "docs" / "case.schema.json").read_text(encoding="utf-8") == schema_text(), "nvhchain schema --out"
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == case_schema()
    assert main(["schema", "--out", str(tmp_path / "s.json")]) == 0
    assert (tmp_path / "s.json").read_text(encoding="utf-8") == schema_text()


def test_a_new_case_refers_to_the_schema_beside_it(tmp_path):
    assert main(["new", "slotted", str(tmp_path)]) == 0
    for name in ("slotted.toml", "solid.toml"):
        first = (tmp_path / name).read_text(encoding="utf-8").splitlines()[0]
        assert first == "#:schema ./case.schema.json"
    schema = json.loads((tmp_path / "case.schema.json").read_text(encoding="utf-8"))
    assert schema["$defs"]["GearGeometry"]["properties"]["face_width_mm"]["description"].startswith("Face width")
