"""The lectures, executable: their programs as they stand on the slides, and what goes wrong in them, in numbers.

A guest in the house: it may import everything, and nothing but the command line imports it.

S0 is the lecture on scan converting triangles in C#, S1 the one on edge equations, S2 the one on rasterization with lines and
fills, S3 the one on scan-line hidden surfaces and homogeneous coordinates, S4 the one on triangles in Java.

experiments        what the slides show and ask, as numbers and pictures; report puts them on a page
raster             what the triangles are drawn on
edge_equations     FlatTri, SmoothTri, EdgeEqn and PlaneEqn in floating point; half_planes has the formulas, exercise an answer
fixed_point        the same in 12 fractional bits
walking            edge walking; interpolation has the three ways to a value inside; ownership the rules for edges
lines  fills       DDA and midpoint; flood fill and parity
hidden_surfaces    the scan-line algorithm
projective         homogeneous coordinates; sampling, decomposition and brightness have what else the slides say in numbers
ivscan             a scene scan-converted, in five views
splats             points in a tree of spheres, stored as small differences

Functions called `demonstrate_...` run a lecture's program beside this library's and return what differs. `PORTS` lists the
items by number, `SLIPS` the mistakes; `find` looks one up. `shipped` lists the items that are the library itself, and `table`
puts all of them together as `docs/lectures.md`.
"""

from __future__ import annotations

from scanspan.lectures.catalog import PORTS as PORTS
from scanspan.lectures.catalog import SLIPS as SLIPS
from scanspan.lectures.catalog import Entry as Entry
from scanspan.lectures.catalog import find as find
