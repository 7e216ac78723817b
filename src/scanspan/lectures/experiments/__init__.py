"""Experiments: each slide that shows something, or asks something, as a function that returns numbers and pictures.

experiment   what an experiment is, and how its numbers are written
figure       pixels shown large, outlines, charts, sheets
precision    sums and differences that lose digits
programs     the lectures' programs, and where they go wrong; twelve_bits has the one in fixed point
rules        who owns a pixel on an edge, and what is inside
slivers      thin triangles, samples and exact shares
traversal    orders of pixels, and what finding them costs
values       colours and depths between corners
projection   homogeneous coordinates, and a model
surfaces     scan lines, hidden surfaces, coherence
shapes       curves as polygons, polygons as triangles, many triangles
lines_and_fills  lines, floods, parity
scenes       whole pictures
colors       models of colour, brightness, white balance

All but the slides' own programs is the library that is shipped.
"""

from __future__ import annotations

import difflib

from scanspan.errors import InputError
from scanspan.lectures.experiments import (
    colors,
    lines_and_fills,
    precision,
    programs,
    projection,
    rules,
    scenes,
    shapes,
    slivers,
    surfaces,
    traversal,
    twelve_bits,
    values,
)
from scanspan.lectures.experiments.experiment import Experiment as Experiment
from scanspan.lectures.experiments.experiment import Result as Result
from scanspan.lectures.experiments.experiment import Table as Table

MODULES = (
    precision,
    programs,
    projection,
    twelve_bits,
    rules,
    slivers,
    traversal,
    values,
    surfaces,
    shapes,
    lines_and_fills,
    scenes,
    colors,
)

# In the order of the lectures.
EXPERIMENTS: tuple[Experiment, ...] = tuple(
    sorted((one for module in MODULES for one in module.EXPERIMENTS), key=lambda one: one.place)
)


def find_experiment(name: str) -> Experiment:
    """Return an experiment by its name.

    Raises
    ------
    InputError : for a name that none has; the message has the nearest one, if there is any.

    Examples
    --------
    >>> find_experiment("moving-slivers").title
    'Moving slivers'
    """
    for one in EXPERIMENTS:
        if one.name == name:
            return one
    near = difflib.get_close_matches(name, [*(one.name for one in EXPERIMENTS), "all"], n=1)
    hint = f"; did you mean {near[0]!r}?" if near else ";"
    raise InputError(f"unknown experiment {name!r}{hint} 'scanspan lecture list' shows all {len(EXPERIMENTS)}")
