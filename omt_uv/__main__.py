"""`python -m omt_uv`."""

from .cli import script

script()
