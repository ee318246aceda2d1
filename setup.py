"""Build of the package: the example cases are part of it."""

import atexit
import shutil
import tempfile
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py


class BuildWithExamples(build_py):
    """Build that copies cases/*/*.toml and *.step to nvhchain/examples."""

    def run(self) -> None:
        """Copy modules and examples."""
        super().run()
        if self.editable_mode:
            return
        for path in (*Path("cases").glob("*/*.toml"), *Path("cases").glob("*/*.step")):
            target = Path(self.build_lib, "nvhchain", "examples", *path.parts[1:])
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, target)


# A build folder in the source would keep modules that are gone, and put them into the next wheel.
base = tempfile.mkdtemp(prefix="nvhchain-build-")
atexit.register(shutil.rmtree, base, ignore_errors=True)
setup(cmdclass={"build_py": BuildWithExamples}, options={"build": {"build_base": base}})
