"""`python -m omt_uv`."""

import sys

from .cli import main

sys.exit(main())
