"""Figures are the same with any settings of matplotlib in files."""

import subprocess
import sys

SCRIPT = """
import hashlib
import numpy as np
from pathlib import Path
from nvhchain.handoff import FieldPressure
from nvhchain.plots import pressure_spectrum
from nvhchain.plots.files import save
frequency = np.linspace(100.0, 1000.0, 10)
save(pressure_spectrum({"α": FieldPressure(frequency, np.zeros((1, 3)), np.full((10, 1), 0.1j), 100.0)}), Path("a.png"))
print(hashlib.sha256(Path("a.png").read_bytes()).hexdigest())
"""


def test_a_file_of_settings_in_the_working_directory_changes_no_figure(tmp_path):
    """Text by LaTeX ends in a traceback where LaTeX is missing."""
    drawn = []
    for settings in (None, "text.usetex: True\n", "font.size: 40\nsavefig.bbox: tight\nlines.marker: o\n"):
        if settings is not None:
            (tmp_path / "matplotlibrc").write_text(settings)
        done = subprocess.run([sys.executable, "-c", SCRIPT], cwd=tmp_path, capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (0, "")
        drawn.append(done.stdout)
    assert len(set(drawn)) == 1
