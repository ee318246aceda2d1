"""STEP files for tests, drawn by gmsh in a process of its own."""

import json
import subprocess
import sys
from pathlib import Path

_HEAD = """
import sys
import gmsh
gmsh.initialize(readConfigFiles=False, interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
occ = gmsh.model.occ
"""
_TAIL = """
occ.synchronize()
gmsh.write(sys.argv[1])
"""


def write_step(path: Path, drawing: str) -> Path:
    """Write the shapes that `drawing`, lines of Python with `occ`, makes in mm."""
    command = [sys.executable, "-c", _HEAD + drawing + _TAIL, str(path)]
    subprocess.run(command, check=True, capture_output=True)
    return path


def write_casting(path: Path, recipe: dict) -> Path:
    """Write the solid of a casting's recipe, which is in metres."""
    return write_step(
        path,
        f"""
from nvhchain.housing.casting._gmsh import _solid
body = []
for step in {json.loads(json.dumps(recipe["steps"]))!r}:
    solids = [(3, _solid(occ, solid)) for solid in step["solids"]]
    if step["op"] == "cut":
        body, _ = occ.cut(body, solids)
    elif body or len(solids) > 1:
        body, _ = occ.fuse(body or solids[:1], solids if body else solids[1:])
occ.dilate(body, 0, 0, 0, 1000, 1000, 1000)
""",
    )
