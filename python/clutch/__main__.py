"""`python -m clutch`: the command."""

import sys

from clutch._cli import main

sys.exit(main())
