"""`python -m nvhchain.cli`."""

import os
import sys

from nvhchain.cli import main

if not sys.flags.safe_path and sys.path[0] == os.getcwd():
    del sys.path[0]  # Python put the working directory there, whose files are nobody's modules

sys.exit(main())
