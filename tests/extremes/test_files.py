"""Foreign models of any size in every unit system: the same solid, or a refusal that names the unit."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nvhchain.conventions import Material
from nvhchain.fem import lowest_modes, stiffness_and_mass
from nvhchain.fem.solid_model import ElementBlock, SolidModel
from nvhchain.housing.imported.repair import sound_mesh
from nvhchain.interop import read_abaqus, read_nastran, write_abaqus, write_nastran
from nvhchain.interop.notation.units import UNIT_SYSTEMS
from nvhchain.testing.scales import mostly, powers

FILES = st.sampled_from([(write_nastran, read_nastran), (write_abaqus, read_abaqus)])
UNITS = st.sampled_from(list(UNIT_SYSTEMS))
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
BEAM = 4


def beam(length, material):
    """Four bricks in a row, held at one end, `length` m long in all and a fifth as thick."""
    layers = np.array([(x, y, z) for x in range(BEAM + 1) for y in range(2) for z in range(2)], dtype=float)
    number = {tuple(place): i for i, place in enumerate(layers.astype(int))}
    bricks = [[number[x + a, b, c] for a, b, c in CORNERS] for x in range(BEAM)]
    nodes = length * layers * [1.0 / BEAM, 0.2, 0.2]
    return SolidModel(
        nodes=nodes,
        labels=np.arange(1, len(nodes) + 1),
        blocks=(ElementBlock("hex8", np.array(bricks), material, np.arange(1, BEAM + 1), "BEAM"),),
        rigid_sets=(),
        held=np.repeat(layers[:, :1] == 0, 3, axis=1),
    )


def frequencies(model, top):
    quadratic = sound_mesh(model)[0]
    (block,) = quadratic.blocks
    K, M = stiffness_and_mass(quadratic.nodes, block.nodes, block.kind, block.material)
    free = np.repeat(quadratic.nodes[:, 0] > 1e-6 * quadratic.nodes[:, 0].max(), 3)
    return lowest_modes(K[free][:, free], M[free][:, free], top)[0]


@cache
def of_unit(poisson):
    """Frequencies over √(E/ρ)/length."""
    return frequencies(beam(1.0, Material(1e9, poisson, 1e3)), 700.0) / 1e3


@given(
    file=FILES, units=UNITS, length=powers(6e-3, 10.0), young=powers(1.01e6, 1.99e12),
    poisson=st.sampled_from([0.0, 0.3, 0.45]), density=powers(10.1, 2.9e4),
)  # fmt: skip
def test_a_beam_of_any_size_and_material_survives_every_unit_system(
    tried, tmp_path_factory, file, units, length, young, poisson, density
):
    """Sizes and materials scale frequencies exactly; a file keeps seven digits or more."""
    write, read = file
    material = tried(Material, young, poisson, density)
    model = beam(length, material)
    path = tried(write, model, tmp_path_factory.mktemp("units") / "model", units=units)
    back = tried(read, path, units=units)
    assert back is not None
    scale = np.sqrt(young / density) / length
    found, unit = frequencies(back, 0.7 * scale), of_unit(poisson)
    assert len(found) == len(unit) > 3
    assert np.abs(found / scale - unit).max() < 1e-6 * unit[-1]


@given(file=FILES, written=UNITS, read_as=UNITS, length=powers(1e-2, 2.0))
def test_steel_read_in_another_unit_system_is_refused_or_keeps_its_numbers(
    tried, tmp_path_factory, file, written, read_as, length
):
    """Which of the two is told from the numbers alone: Pa and kg/m³ of the other system lie within sense or not."""
    write, read = file
    steel = Material(210e9, 0.3, 7850.0)
    path = write(beam(length, steel), tmp_path_factory.mktemp("units") / "model", units=written)
    back = tried(read, path, units=read_as)
    one, other = UNIT_SYSTEMS[written], UNIT_SYSTEMS[read_as]
    young, density = 210e9 * other.stress / one.stress, 7850.0 * other.density / one.density
    sensible = 1e6 <= young <= 2e12 and 10.0 <= density <= 3e4
    assert (back is not None) == sensible
    if back is not None:
        assert back.blocks[0].material.young == pytest.approx(young, rel=1e-6)
        assert np.ptp(back.nodes[:, 0]) == pytest.approx(length * other.length / one.length, rel=1e-6)


@given(file=FILES, units=UNITS, number=mostly(powers(1e-30, 1e30)), line=st.integers(0, 60), at=st.integers(0, 6))
def test_a_number_in_a_file_that_was_spoilt_is_refused_or_read(tried, tmp_path_factory, file, units, number, line, at):
    write, read = file
    path = write(beam(0.2, Material(210e9, 0.3, 7850.0)), tmp_path_factory.mktemp("units") / "model", units=units)
    lines = path.read_text().splitlines()
    line %= len(lines)
    fields = lines[line].split(",")
    if len(fields) > 1:
        fields[at % len(fields)] = f" {number!r}"
        lines[line] = ",".join(fields)
    path.write_text("\n".join(lines) + "\n")
    back = tried(read, path, units=units)
    assert back is None or np.isfinite(back.nodes).all()
