"""Run-ups in files: pieces, stopped runs taken up again in the same bits, and folders that hold something else."""

from __future__ import annotations

import os
from dataclasses import asdict, replace

import numpy as np
import pytest

from nvhchain.dynamics import record_run_up, run_up
from nvhchain.dynamics.runs import recording, speed_ramp
from nvhchain.errors import InputError, ResourceError
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.files import hdf5
from nvhchain.handoff import BearingForces
from nvhchain.testing.two_stages import ramp, ramped, straight


class Stop(Exception):
    """What ends a run from outside."""


def stopped_after(blocks):
    """Progress that ends a run once so many blocks are done."""

    def told(done, total):
        if done == blocks:
            raise Stop

    return told


@pytest.mark.parametrize(
    "options",
    [{}, {"gyroscopic": True, "flexible_shafts": True, "face_points": 2}, {"gyroscopic": True}],
)
def test_a_stopped_run_goes_on_and_ends_in_the_same_bits(make_gearbox, make_laws, tmp_path, monkeypatch, options):
    gearbox, laws = replace(make_gearbox(), **options), make_laws(slotted=True)
    fidelity = DynamicsFidelity(2e-5, path_correction=list(options) == ["gyroscopic"])
    monkeypatch.setattr(speed_ramp, "BLOCK", 256)
    monkeypatch.setattr(recording, "PIECE", 1024)
    whole = run_up(gearbox, laws, None, fidelity=fidelity, **ramp(duration=0.4))

    with pytest.raises(Stop):
        record_run_up(
            gearbox, laws, None, fidelity=fidelity, folder=tmp_path, progress=stopped_after(23), **ramp(duration=0.4)
        )
    before = {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("forces-*.h5")}
    assert len(before) >= 3
    made = record_run_up(gearbox, laws, None, fidelity=fidelity, folder=tmp_path, **ramp(duration=0.4))
    assert all((tmp_path / name).stat().st_mtime_ns == when for name, when in before.items())
    pieces = list(made.pieces())
    assert len(pieces) > len(before)
    for name in ("time", "force", "mesh_deflection", "input_speed"):
        assert np.array_equal(np.concatenate([getattr(piece, name) for piece in pieces]), getattr(whole, name))
    # finished: found, not run again
    again = record_run_up(gearbox, laws, None, fidelity=fidelity, folder=tmp_path, **ramp(duration=0.4))
    assert again == made
    last = hdf5.load(made.paths[-1], BearingForces)
    assert last.time[-1] == whole.time[-1]
    assert last.provenance["fidelity"] == asdict(fidelity)


def test_another_run_in_the_folder_is_refused(make_gearbox, make_laws, tmp_path, monkeypatch):
    gearbox, laws, fidelity = make_gearbox(), make_laws(), DynamicsFidelity(2e-5)
    record_run_up(gearbox, laws, None, fidelity=fidelity, folder=tmp_path, **ramp(duration=0.01))
    with pytest.raises(InputError, match="holds another run-up"):
        record_run_up(gearbox, laws, None, fidelity=fidelity, folder=tmp_path, **ramp(duration=0.02))
    for content in (b"PK not a checkpoint", b""):  # of another run it is refused, too
        (tmp_path / "standing.npz").write_bytes(content)
        with pytest.raises(InputError, match="holds another run-up"):
            record_run_up(gearbox, laws, None, fidelity=fidelity, folder=tmp_path, **ramp(duration=0.02))
    for folder in (tmp_path / "standing.npz", tmp_path / "standing.npz" / "within"):
        with pytest.raises(InputError, match=r"standing\.npz.* cannot take files \(.*\): name another folder"):
            record_run_up(gearbox, laws, None, fidelity=fidelity, folder=folder, **ramp(duration=0.01))

    def refuse(**_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(recording.hdf5.tempfile, "TemporaryFile", refuse)
    with pytest.raises(InputError, match=r"new' cannot take files \(Permission denied\): name another folder"):
        record_run_up(gearbox, laws, None, fidelity=fidelity, folder=tmp_path / "new", **ramp(duration=0.01))


@pytest.mark.parametrize("keep", [5000, 0, -1])
def test_a_damaged_piece_is_computed_again_in_the_same_bits(
    make_gearbox, make_laws, tmp_path, monkeypatch, caplog, keep
):
    """Cut short, empty, or one byte of its samples changed; the others stay as they are."""
    gearbox, laws, fidelity = make_gearbox(), make_laws(), DynamicsFidelity(2e-5)
    monkeypatch.setattr(speed_ramp, "BLOCK", 256)
    monkeypatch.setattr(recording, "PIECE", 512)
    given = ramp(duration=0.1) | {"fidelity": fidelity, "folder": tmp_path / "run"}

    with pytest.raises(Stop):
        record_run_up(gearbox, laws, None, **given, progress=stopped_after(7))
    piece = tmp_path / "run" / "forces-00001.h5"
    whole = piece.read_bytes()
    middle = whole.index(hdf5.load(piece, BearingForces).force.tobytes()[:64])
    piece.write_bytes(whole[:keep] if keep >= 0 else whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :])

    first = (tmp_path / "run" / "forces-00000.h5").stat().st_mtime_ns
    made = record_run_up(gearbox, laws, None, **given)
    assert "forces-00001.h5 missing or damaged, computed again" in caplog.text
    assert made.paths[0].stat().st_mtime_ns == first
    undisturbed = record_run_up(gearbox, laws, None, **given | {"folder": tmp_path / "undisturbed"})
    for one, other in zip(made.pieces(), undisturbed.pieces(), strict=True):
        assert one.content_hash == other.content_hash

    caplog.clear()
    (tmp_path / "run" / "standing.npz").write_bytes(b"PK not a checkpoint")
    again = record_run_up(gearbox, laws, None, **given)
    assert "standing.npz: damaged" in caplog.text
    assert [piece.content_hash for piece in again.pieces()] == [piece.content_hash for piece in undisturbed.pieces()]
    caplog.clear()
    assert record_run_up(gearbox, laws, None, **given) == made
    assert caplog.text == ""


def test_a_piece_copied_over_another_one_is_computed_again(make_gearbox, make_laws, tmp_path, monkeypatch, caplog):
    """Both are whole, and of this run."""
    gearbox, laws = make_gearbox(), make_laws()
    monkeypatch.setattr(speed_ramp, "BLOCK", 256)
    monkeypatch.setattr(recording, "PIECE", 512)
    given = ramp(duration=0.1) | {"fidelity": DynamicsFidelity(2e-5), "folder": tmp_path}
    made = record_run_up(gearbox, laws, None, **given)
    before = [piece.content_hash for piece in made.pieces()]
    made.paths[1].write_bytes(made.paths[0].read_bytes())
    again = record_run_up(gearbox, laws, None, **given)
    assert "forces-00001.h5 missing or damaged, computed again" in caplog.text
    assert [piece.content_hash for piece in again.pieces()] == before


def test_pieces_without_their_standing_are_taken_for_another_run_unless_they_are_of_this(
    make_gearbox, make_laws, tmp_path
):
    """What is left in the folder cannot be told from the pieces that a shorter run would write beside it."""
    gearbox, laws, fidelity = make_gearbox(), make_laws(), DynamicsFidelity(2e-5)
    made = record_run_up(gearbox, laws, None, fidelity=fidelity, folder=tmp_path, **ramp(duration=0.02))
    before = made.paths[0].read_bytes()
    (tmp_path / "standing.npz").unlink()
    with pytest.raises(InputError, match=r"holds another run-up .* choose another folder or delete it"):
        record_run_up(gearbox, laws, None, fidelity=fidelity, folder=tmp_path, **ramp(duration=0.01))
    assert made.paths[0].read_bytes() == before
    again = record_run_up(gearbox, laws, None, fidelity=fidelity, folder=tmp_path, **ramp(duration=0.02))
    assert again == made
    assert (tmp_path / "standing.npz").exists()


def test_a_stopped_run_of_the_contact_problem_goes_on_with_the_same_solvers_only(
    make_gearbox, make_laws, tmp_path, monkeypatch
):
    """A file after every block, since a block takes minutes there.  Solvers that agree at every fifth of the period,
    where each of five meshes is at the same phase, are others too."""
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    monkeypatch.setattr(speed_ramp, "BLOCK", 64)
    solvers = [straight(law) for law in laws]
    given = ramp(duration=0.02, fidelity=DynamicsFidelity(2e-5, mesh_level="contact"))
    whole = run_up(gearbox, laws, None, **given, contact_forces=solvers)
    with pytest.raises(Stop):
        record_run_up(gearbox, laws, None, **given, contact_forces=solvers, folder=tmp_path, progress=stopped_after(5))
    before = {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("forces-*.h5")}
    assert len(before) >= 3
    like = straight(laws[1])

    def apart(angle, deflection):
        return (1.0 + 1e-3 * np.sin(5 * np.pi * angle / laws[1].period) ** 2) * like(angle, deflection)

    for others in ([solvers[0], straight(laws[1], 4.0001e8)], [solvers[0], apart], None):
        told = "holds another run-up .* contact solvers" if others else "needs the contact solver of each"
        with pytest.raises(InputError, match=told):
            record_run_up(gearbox, laws, None, **given, contact_forces=others, folder=tmp_path)
    same = [straight(law, 4e8 * (1.0 + 1e-14)) for law in laws]  # in another process, say
    made = record_run_up(gearbox, laws, None, **given, contact_forces=same, folder=tmp_path)
    assert all((tmp_path / name).stat().st_mtime_ns == when for name, when in before.items())
    found = np.concatenate([piece.force for piece in made.pieces()])
    assert np.abs(found - whole.force).max() < 1e-12 * np.abs(whole.force).max()


def test_files_as_they_were_left_are_not_read_again(make_gearbox, make_laws, tmp_path, monkeypatch):
    """Of an hour, 15 GB; a file with another time stamp is looked through, and taken where it is whole."""
    gearbox, laws = make_gearbox(), make_laws()
    monkeypatch.setattr(speed_ramp, "BLOCK", 256)
    monkeypatch.setattr(recording, "PIECE", 512)
    given = ramp(duration=0.1, fidelity=DynamicsFidelity(2e-5)) | {"folder": tmp_path}
    with pytest.raises(Stop):
        record_run_up(gearbox, laws, None, **given, progress=stopped_after(7))
    read, look = [], hdf5.record
    monkeypatch.setattr(hdf5, "record", lambda path: read.append(path.name) or look(path))
    with pytest.raises(Stop):
        record_run_up(gearbox, laws, None, **given, progress=stopped_after(8))
    assert read == []
    os.utime(tmp_path / "forces-00001.h5", ns=(0, 0))
    made = record_run_up(gearbox, laws, None, **given)
    assert read == ["forces-00001.h5", *(path.name for path in made.paths)]  # at the end, for what they state


def test_an_hour_in_memory_is_refused_with_a_remedy(make_gearbox, make_laws):
    with pytest.raises(ResourceError, match=r"needs .* GiB, .* write it to files with record_run_up"):
        ramped(make_gearbox(), make_laws(), None, duration=100 * 3600.0)


def test_a_band_too_low_for_the_step_is_refused_before_anything_is_formed(make_gearbox, make_laws):
    with pytest.raises(ResourceError, match=r"f_max = 0\.01 Hz from steps of 10 µs .* raise f_max or the time step"):
        ramped(make_gearbox(), make_laws(), None, f_max=0.01)
