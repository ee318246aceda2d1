"""`python -m nvhchain.cli`."""

import sys

from nvhchain.cli import main

sys.exit(main())
