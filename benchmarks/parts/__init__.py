"""Parts of the benchmarks, each with a table of its own.

Imports `benchmarks` and the package.
Main names: `PARTS` of every module; `run.py` lists the modules.
"""
