"""Experiments on numbers that are not exact: a difference of neighbours, the constant of an edge, and an area.

Source: S4, lines 191-268 and 272-304; S0, lines 172-191.
"""

from __future__ import annotations

import math
from decimal import Decimal

import numpy as np

from scanspan.geometry.fixed_point import snap_points
from scanspan.lectures import edge_faults, fixed_point_faults
from scanspan.lectures.experiments.experiment import Experiment, Result, Row, Table, table
from scanspan.lectures.experiments.figure import Axis, chart, panel
from scanspan.raster.setup import set_up_triangle
from scanspan.records import Float64Array

# The fifteen rows that S4 prints: the step, the slope, and its error in percent.
PRINTED = (
    ("10.0", "-0.054130327", "-105.440216"), ("1.0", "0.83726716", "-15.8529"), ("0.1", "0.99334663", "-0.1665868"),
    ("0.01", "0.9949874", "-0.0016833"), ("9.999999E-4", "0.9950065", "2.3362527E-4"),
    ("9.999999E-5", "0.9949879", "-0.0016353768"), ("9.999999E-6", "0.99502516", "0.0021086177"),
    ("9.999999E-7", "0.9946526", "-0.035331327"), ("9.999999E-8", "0.9313227", "-6.400122"),
    ("9.999999E-9", "0.7450581", "-25.120102"), ("9.999999E-10", "0.0", "-100.0"), ("9.999999E-11", "0.0", "-100.0"),
    ("9.999999E-12", "0.0", "-100.0"), ("9.999999E-13", "0.0", "-100.0"), ("9.999999E-14", "0.0", "-100.0"),
)  # fmt: skip


def slope_of_sine(x: np.float32, h: np.float32) -> np.float32:
    """Return (sin(x + h) - sin(x - h)) / 2h as Java's floats have it; S4, line 240."""
    ahead, behind = np.float32(math.sin(x + h)), np.float32(math.sin(x - h))
    return (ahead - behind) / (np.float32(2) * h)


def loss_of_precision() -> Result:
    """Compute the table of S4's slide in 32-bit floats."""
    x, h = np.float32(0.1), np.float32(10)
    correct = np.float32(math.cos(x))
    rows, steps, errors = list[Row](), list[float](), list[float]()
    for i, printed in enumerate(PRINTED):
        slope = slope_of_sine(x, h)
        error = np.float32(100) * (slope - correct) / correct
        is_same = all(np.float32(text) == found for text, found in zip(printed, (h, slope, error), strict=True))
        rows.append((i, h, slope, error, printed[1], printed[2], is_same))
        steps.append(float(h))
        errors.append(abs(float(error)))
        h = h / np.float32(10)
    headings = ("i", "h", "slope", "error in %", "slide: slope", "slide: error", "same bits")
    rows.append(("correct", "", correct, "", "0.9950042", "", bool(correct == np.float32("0.9950042"))))
    shown = chart([("error of the slope", steps, errors)], Axis("h", is_log=True), Axis("error in percent", is_log=True))
    return Result(
        Table(headings, tuple(rows)), (panel("Smaller steps help, until the two sines agree in most digits.", shown),)
    )


def random_edges(reach: float, count: int = 4000) -> tuple[Float64Array, Float64Array]:
    """Return edges at 200 to 1000 that go up to `reach` each way: starts and ends, (N, 2), 32-bit floats held in 64 bits."""
    rng = np.random.default_rng(11)
    start = rng.uniform(200, 1000, (count, 2))
    end = start + rng.uniform(-reach, reach, (count, 2))
    return start.astype(np.float32).astype(np.float64), end.astype(np.float32).astype(np.float64)


def constants(start: Float64Array, end: Float64Array) -> dict[str, Float64Array]:
    """Return C of edges in 32-bit floats, three ways; S0, lines 168 and 186-190."""
    (x0, y0), (x1, y1) = start.astype(np.float32).T, end.astype(np.float32).T
    A, B = y0 - y1, x1 - x0
    direct = x0 * y1 - x1 * y0
    one = -A * x0 - B * y0
    average = -(A * (x0 + x1) + B * (y0 + y1)) / np.float32(2)
    ways = {"x0 y1 - x1 y0": direct, "-A x0 - B y0": one, "the average": average}
    return {name: found.astype(np.float64) for name, found in ways.items()}


def precision_of_c() -> Result:
    """Compare three ways to C with the exact one, over edges of several lengths."""
    reaches, rows = (0.1, 1.0, 10.0, 100.0), []
    curves: dict[str, list[float]] = {}
    for reach in reaches:
        start, end = random_edges(reach)
        (x0, y0), (x1, y1) = start.T, end.T
        A, B = y0 - y1, x1 - x0

        # Floats of 32 bits have 24 digits, so their products are exact in 64 bits; one rounding is left.
        exact = x0 * y1 - x1 * y0
        for name, found in constants(start, end).items():
            error = float(np.median(np.abs(found / exact - 1)))
            missed = np.maximum(np.abs(A * x0 + B * y0 + found), np.abs(A * x1 + B * y1 + found)) / np.hypot(A, B)
            rows.append((f"{reach:g} px, {name}", error, float(missed.max())))
            curves.setdefault(name, []).append(error)
        # As the library has it: corners on a grid first, then everything in whole numbers.
        (x0, y0), (x1, y1) = snap_points(start, 8).T, snap_points(end, 8).T
        whole = x0 * y1 - x1 * y0
        off = np.maximum(np.abs((y0 - y1) * x0 + (x1 - x0) * y0 + whole), np.abs((y0 - y1) * x1 + (x1 - x0) * y1 + whole))
        same = [
            a * d - c * b == found for a, b, c, d, found in zip(*(v.tolist() for v in (x0, y0, x1, y1, whole)), strict=True)
        ]
        rows.append((f"{reach:g} px, corners snapped, in whole numbers", 1.0 - float(np.mean(same)), float(off.max())))
    shown = chart(
        [(name, reaches, errors) for name, errors in curves.items()],
        Axis("how far edges go each way, in pixels", is_log=True), Axis("median relative error of C", is_log=True),
    )  # fmt: skip
    headings = ("edge, way to C", "median relative error", "worst miss of its own corners, px")
    return Result(
        Table(headings, tuple(rows)), (panel("A difference of two large products loses what short edges need.", shown),)
    )


def precision_of_area() -> Result:
    """Compare the sum of three C with the cross product of two sides, and both with what the library does."""
    rows: list[Row] = []
    for size in (0.01, 0.1, 1.0, 10.0):
        found = edge_faults.demonstrate_area_precision(size)
        rows.append((f"{size:g} px", found.sum_of_c, found.cross_product, found.wrong_signs, found.triangles))
    sizes = [0.01, 0.1, 1.0, 10.0]
    shown = chart(
        [("sum of three C", sizes, [row[1] for row in rows]), ("cross product of two sides", sizes, [row[2] for row in rows])],
        Axis("size of the triangle in pixels", is_log=True), Axis("median relative error of the area", is_log=True),
    )  # fmt: skip
    headings = ("triangle", "error of the sum", "error of the cross product", "wrong signs", "of")
    return Result(
        Table(headings, tuple(rows)), (panel("Averaging C does not save the area, which is the sum of all three.", shown),)
    )


def fixed_point_lines() -> Result:
    """Measure how far the 12-bit edges pass from their own corners."""
    rows, lengths = list[Row](), (1.0, 3.0, 10.0, 30.0, 100.0)
    for length in lengths:
        found = fixed_point_faults.demonstrate_missed_vertices(length)
        rows.append((f"{length:g} px", found.median, found.worst, found.snapped_worst))
    shown = chart(
        [("worst", lengths, [row[2] for row in rows]), ("median", lengths, [row[1] for row in rows])],
        Axis("length of the edge in pixels", is_log=True), Axis("distance from its own corners in pixels", is_log=True),
    )  # fmt: skip
    headings = ("edge", "median miss, px", "worst miss, px", "worst with corners snapped first")
    return Result(Table(headings, tuple(rows)), (panel("A, B and C cut off one by one: the line turns away.", shown),))


def four_digits() -> Result:
    """Subtract two numbers of four digits, as the slide does, and count what is left."""
    left, right = Decimal("1.234E3"), Decimal("1.233E3")
    rest = left - right
    rows = [
        ("1.234e3 - 1.233e3", float(rest)), ("digits before", len(left.as_tuple().digits)),
        ("digits that mean something after", len(rest.as_tuple().digits)),
    ]  # fmt: skip
    shown = chart(
        [("digits left", *digits_left())], Axis("how close the two numbers are, relative", is_log=True), Axis("decimal digits")
    )
    return Result(table(*rows), (panel("Digits that a difference of two 32-bit floats keeps.", shown),))


def digits_left() -> tuple[list[float], list[float]]:
    """Return how close two numbers are, and how many digits their difference keeps when each has been rounded to a float."""
    rng = np.random.default_rng(12)
    gaps, digits = [], []
    for exponent in range(7):
        gap = 10.0**-exponent
        a = rng.uniform(1, 2, 4000)
        b = a * (1 + gap)
        error = np.abs((b.astype(np.float32) - a.astype(np.float32)).astype(np.float64) / (b - a) - 1)
        gaps.append(gap)
        digits.append(float(max(0.0, -math.log10(np.median(error)))))
    return gaps, digits


EXPERIMENTS = (
    Experiment(
        "loss-of-precision", "S4", "229-268", "Loss of Precision",
        "A slope from two sines",
        "The slope of sin at 0.1 from two values h apart. At first a smaller h is better; then the two sines agree in "
        "ever more digits, their difference is made of what is left, and from the eleventh row on x + h and x - h are the"
        " same float. The fifteen rows come out as the slide has them, to the last bit.",
        loss_of_precision, (25, 27), slope_of_sine, "(ahead - behind)",
    ),
    Experiment(
        "catastrophic-cancellation", "S0", "172-181", "Numerical Precision of the C coefficient",
        "What a difference keeps",
        "1.234 x 10^3 - 1.233 x 10^3 is one digit where four went in. The nearer two numbers are, the fewer digits of "
        "their difference were not made up by rounding.",
        four_digits, (25,), digits_left, "astype(np.float32) - a.astype",
    ),
    Experiment(
        "precision-of-c", "S0", "183-191", "Maintaining Precision in C",
        "C three ways",
        "The constant of an edge as a difference of products, from one corner, and as the average of both corners. For "
        "short edges the first is so far off that the line misses its own corners by a pixel and more. The library snaps "
        "corners to a grid first, and then C is a whole number.",
        precision_of_c, (26,), snap_points, "np.rint(points",
    ),
    Experiment(
        "precision-of-area", "S0", "320-325", "Triangle Set-up",
        "The area as a sum of three C",
        "Each C is precise by itself, but their sum is the area, and the area is small where they are large: for "
        "triangles of a hundredth of a pixel its sign is sometimes wrong, and the triangle is taken for turned over.",
        precision_of_area, (34,), set_up_triangle, "sign = halves_sign",
    ),
    Experiment(
        "fixed-point-lines", "S4", "272-304", "EdgeEquation Object",
        "Edges in twelve bits",
        "A, B and C are each cut off to 1/4096, without regard to the others, so the line no longer passes through the "
        "corners that made it. Cutting off the corners instead, and forming A, B and C from those, is exact.",
        fixed_point_lines, (29,), snap_points, "np.rint(points", slips=(10,),
    ),
)  # fmt: skip
