"""`python -m bt_tamp`: the same as the command `bt-tamp`."""

import sys

from bt_tamp.cli import main

sys.exit(main())
