"""Races scanspan against what else a Python user could call, on the same scenes in the same run: `python -m benchmarks`."""
