"""numba takes no settings from the working directory, which may name a folder of code to unpickle."""

import subprocess
import sys

FILE = "cache_dir: elsewhere\nnum_threads: 0\n"


def test_a_settings_file_in_the_working_directory_has_no_effect(tmp_path):
    (tmp_path / ".numba_config.yaml").write_text(FILE)
    code = (
        "import nvhchain, numba\n"
        "numba.core.config.reload_config()\n"  # as before every compilation
        "import yaml\n"
        "print(numba.config.CACHE_DIR or 'none', numba.config.NUMBA_NUM_THREADS > 0)"
    )
    command = [sys.executable, "-P", "-W", "error", "-c", code]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stdout == "none True\n", done.stderr
    assert done.stderr == ""
