"""What an algorithm counts while it works, so that costs can be compared: one array, with a place for each kind of work.

Kernels add to it as they go from row to row or from list to list. What happens at single samples is counted by a target of its
own (write_sample_tally in write.py), in a run that is made when somebody asks; pictures do not pay for it.
"""

from __future__ import annotations

SAMPLES_TESTED, EDGE_EVALUATIONS, SPANS, DEPTH_TESTS, SUBDIVISIONS, INSERTIONS, SWAPS = range(7)
NAMES = ("samples_tested", "edge_evaluations", "spans", "depth_tests", "subdivisions", "insertions", "swaps")

# Breaches of what the lectures say of a sweep: the list is in order and empty at the end, each sample is set once. They stay 0.
OUT_OF_ORDER, LEFT_OVER, SET_TWICE = range(7, 10)
BREACHES = ("an active edge list out of order", "edges left over at the end of a sweep", "a sample set twice")

COUNTERS = 10
