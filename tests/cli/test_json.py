"""`--json`: one object on stdout and nothing else there, the same exit codes."""

import json

import pytest

from nvhchain.cli import commands, main
from nvhchain.doctor import Finding

SMALL = "cases/small/single_stage.toml"
SPHERE = "cases/sphere/pulsating.toml"


@pytest.fixture
def answer(capsys):
    """Run a command with --json; return its exit code and the only object on stdout."""

    def run(*arguments):
        code = main([*arguments, "--json"])
        return code, json.loads(capsys.readouterr().out)

    return run


def test_a_run_answers_with_levels_and_limits(answer, tmp_path):
    code, found = answer("run", SPHERE, "--fidelity", "draft", "--out", str(tmp_path))
    assert (code, found["exit_code"], found["case"], found["fidelity"]) == (0, 0, "pulsating-sphere", "draft")
    (heard,) = found["levels"]["pressure"]
    assert heard["limits_db"][0] < heard["level_db"] < heard["limits_db"][1]
    assert found["folder"] == str(tmp_path)


def test_a_plan_answers_with_the_cost_of_its_steps(answer):
    _, found = answer("plan", SMALL, "--fidelity", "draft")
    assert found["seconds"] == pytest.approx(sum(step["seconds"] for step in found["steps"]))
    assert any("friction" in why for why in found["options"])


def test_a_valid_case_is_said_to_be_valid(answer):
    code, found = answer("check", SMALL)
    assert (code, found["valid"], found["case"]) == (0, True, "single-stage")


def test_mistakes_have_file_line_and_message(answer, tmp_path, request):
    text = (
        (request.config.rootpath / SMALL)
        .read_text()
        .replace("teeth = 20", "teeth = 2")
        .replace("low = 100", "low = -1")
    )
    (tmp_path / "case.toml").write_text(text)
    code, found = answer("check", str(tmp_path / "case.toml"))
    assert code == found["exit_code"] == 2
    assert [error["line"] for error in found["errors"]] == [
        1 + text.splitlines().index("low = -1"),
        1 + text.splitlines().index("teeth = 2"),
    ]
    assert {error["file"] for error in found["errors"]} == {str(tmp_path / "case.toml")}


@pytest.mark.parametrize("arguments", [["check"], ["plan", SMALL, "--fidelity", "best"], ["nothing"]])
def test_wrong_arguments_are_an_object_too(answer, arguments):
    code, found = answer(*arguments)
    assert code == found["exit_code"] == 2
    assert "see nvhchain" in found["errors"][0]["message"]


def test_doctor_answers_with_its_findings_and_fails_alike(answer, monkeypatch):
    import nvhchain.doctor

    monkeypatch.setattr(nvhchain.doctor, "diagnose", lambda: [Finding("gmsh", False, "none", "install it")])
    code, found = answer("doctor")
    assert code == found["exit_code"] == 1
    assert found["findings"] == [{"name": "gmsh", "ok": False, "detail": "none", "remedy": "install it"}]


def test_a_failing_system_is_an_object_with_exit_code_1(answer, monkeypatch):
    def fail(options):
        raise OSError("disk is gone")

    monkeypatch.setattr(commands, "check", fail)
    code, found = answer("check", SMALL)
    assert (code, found["exit_code"], found["errors"]) == (1, 1, [{"message": "disk is gone"}])


@pytest.mark.slow
def test_a_sweep_answers_with_its_measurements(answer, tmp_path):
    code, found = answer(
        "tradeoff", SPHERE, "--fidelity", "draft", "--knob", "acoustics.elements_per_wavelength", "--out", str(tmp_path)
    )
    assert code == 0
    assert found["folder"] == str(tmp_path)
    assert len(found) > 3
