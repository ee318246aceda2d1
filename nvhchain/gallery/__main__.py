"""`python -m nvhchain.gallery`."""

import os
import sys

from nvhchain.gallery.command import main

if not sys.flags.safe_path and sys.path[0] == os.getcwd():
    del sys.path[0]  # the working directory, whose files are no modules of ours

sys.exit(main())
