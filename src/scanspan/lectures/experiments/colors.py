"""Experiments on colour: what the models measure, how bright colours are, and what the light does to them.

Source: S2, lines 28-77; S3, lines 632-660.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanspan import color
from scanspan.canvas import Canvas
from scanspan.color import brightness, white_balance, yiq
from scanspan.color.cylinders import rgb_to_hsv
from scanspan.lectures.experiments.experiment import Experiment, Result, Row, Table
from scanspan.lectures.experiments.figure import Panel, beside, panel, stacked
from scanspan.lectures.experiments.scenes import complicated_scene
from scanspan.masks import coverage, zones
from scanspan.records import Array, Float64Array, UInt8Array

# A chart of 24 patches as photographers use it, in sRGB (N. Ohta 1997; the last six are greys).
PATCHES = np.array(
    [
        (115, 82, 68), (194, 150, 130), (98, 122, 157), (87, 108, 67), (133, 128, 177), (103, 189, 170),
        (214, 126, 44), (80, 91, 166), (193, 90, 99), (94, 60, 108), (157, 188, 64), (224, 163, 46),
        (56, 61, 150), (70, 148, 73), (175, 54, 60), (231, 199, 31), (187, 86, 149), (8, 133, 161),
        (243, 243, 242), (200, 200, 200), (160, 160, 160), (122, 122, 121), (85, 85, 85), (52, 52, 52),
    ],
    np.uint8,
)  # fmt: skip
NAMED = {
    "red": (255, 0, 0), "green": (0, 255, 0), "blue": (0, 0, 255), "yellow": (255, 255, 0), "cyan": (0, 255, 255),
    "magenta": (255, 0, 255), "grey": (128, 128, 128), "white": (255, 255, 255),
}  # fmt: skip


def chart_of_patches() -> UInt8Array:
    """Return the patches in four rows on a dark ground, (H, W, 3)."""
    canvas = Canvas(98, 66, (40, 42, 44))
    places = [(4 + 16 * i, 4 + 16 * j) for j in range(4) for i in range(6)]
    rings = [[(x, y), (x + 11, y), (x + 11, y + 11), (x, y + 11)] for x, y in places]
    canvas.polygons(rings, PATCHES)
    return canvas.pixels[:, :, :3].copy()


def torus() -> UInt8Array:
    """Return a picture of a coloured torus, (H, W, 3)."""
    corners, colors = complicated_scene(size=110)
    canvas = Canvas(110, 110, (24, 26, 30))
    canvas.triangles(corners, colors)
    return canvas.pixels[..., :3].copy()


def luminance_and_intensity() -> Result:
    """Measure how bright colours are, four ways, and show one picture each way."""
    rows: list[Row] = []
    for name, rgb in NAMED.items():
        code = np.array(rgb, np.uint8)
        slide = float(np.dot((0.333, 0.333, 0.333), code))
        luma, light = float(brightness.luma_601(code)), float(brightness.luminance(color.srgb_to_linear(code)))
        value = float(rgb_to_hsv(code)[2])
        rows.append((name, slide, 255 * float(brightness.intensity(code)), 255 * luma, 255 * value, light))
    bars = np.repeat(np.array(list(NAMED.values()), np.uint8)[None, :], 40, axis=0).repeat(14, axis=1)
    both = stacked(np.pad(chart_of_patches(), ((0, 0), (7, 7), (0, 0)), constant_values=40), bars, gap=2)
    grey = {
        "(a) colour image": both,
        "(b) intensity: the mean of the three": np.rint(255 * brightness.intensity(both)),
        "(c) luminance: .299 R + .587 G + .114 B": np.rint(255 * brightness.luma_601(both)),
        "V of HSV: the largest of the three": np.rint(255 * rgb_to_hsv(both)[..., 2]),
    }
    headings = ("colour", "slide: .333 each", "intensity", "luma .299 .587 .114", "V of HSV", "luminance of its light")
    return Result(Table(headings, tuple(rows)), tuple(panel(name, pixels, 2) for name, pixels in grey.items()))


def luma_chroma() -> Result:
    """Take the slide's matrix apart, and show Y, I and Q of a picture."""
    matrix = yiq.YIQ_MATRICES["slide"]
    inverse = np.linalg.inv(matrix)
    rows: list[Row] = [
        (f"sum of row {name}", float(round(sum(row), 12)) + 0.0) for name, row in zip("YIQ", matrix.tolist(), strict=True)
    ]
    rows.append(("determinant", float(np.linalg.det(matrix))))
    rows += [
        (f"inverse, row {name}", "  ".join(f"{value:.3f}" for value in row))
        for name, row in zip("RGB", inverse.tolist(), strict=True)
    ]
    grey = color.rgb_to_yiq(np.array([0.5, 0.5, 0.5]), "slide")
    rows.append(("largest of I and Q of a grey", float(np.abs(grey[1:]).max())))
    picture = torus()
    found = color.rgb_to_yiq(picture, "slide")
    back = color.yiq_to_rgb(found, "slide")
    rows.append(("there and back, worst error in levels", float(np.abs(255 * back - picture).max())))
    pale: list[tuple[str, Array]] = [("colour", picture), ("Y, what a black and white set shows", np.rint(255 * found[..., 0]))]
    for number, name in ((1, "I, orange against cyan"), (2, "Q, purple against green")):
        shown = np.zeros_like(found)
        shown[..., 0], shown[..., number] = 0.5, found[..., number]
        pale.append((name, np.rint(255 * np.clip(color.yiq_to_rgb(shown, "slide"), 0, 1))))
    return Result(Table(("", ""), tuple(rows)), tuple(panel(name, pixels, 2) for name, pixels in pale))


def hue_saturation_value() -> Result:
    """Show hue, saturation and value as a disc, and where no matrix leads to them."""
    side = 96
    y, x = np.mgrid[:side, :side] / (side / 2) - 1 + 1 / side
    radius = np.hypot(x, y)
    hue, inside = np.mod(np.arctan2(-y, x) / (2 * np.pi), 1.0), radius <= 1
    hsv = np.stack([np.where(hue >= 1, 0, hue), np.clip(radius, 0, 1), np.ones_like(hue)], axis=2)
    disc = np.where(inside[..., None], np.rint(255 * color.hsv_to_rgb(hsv)), 255)
    ramp = np.stack([np.zeros((side, side)), np.clip((x + 1) / 2, 0, 1), np.clip((1 - y) / 2, 0, 1)], axis=2)
    slices = np.rint(255 * color.hsv_to_rgb(ramp))
    red, green, grey = np.array([1.0, 0, 0]), np.array([0, 1.0, 0]), np.array([0.5, 0.5, 0.5])
    of_sum, sum_of = rgb_to_hsv(red + green), rgb_to_hsv(red) + rgb_to_hsv(green)
    rows: list[Row] = [
        (name, *(float(v) for v in rgb_to_hsv(rgb)))
        for name, rgb in (
            ("red", red),
            ("green", green),
            ("red + green, yellow", red + green),
            ("grey", grey),
            ("black", grey * 0),
        )
    ]
    rows.append(("sum of the first two, were it a matrix", *(float(v) for v in sum_of)))
    random = np.random.default_rng(31).random((4000, 3))
    worst = float(np.abs(color.hsv_to_rgb(rgb_to_hsv(random)) - random).max())
    rows.append(("4,000 colours there and back, worst error", worst, "", ""))
    assert not np.allclose(of_sum, sum_of)
    panels = (
        panel("hue around, saturation outwards, value 1", disc, 2),
        panel("hue 0: saturation to the right, value up", slices, 2),
    )
    return Result(Table(("colour", "hue", "saturation", "value"), tuple(rows)), panels)


LIGHTS = {"lamp light": (1.0, 0.72, 0.38), "blue shade": (0.62, 0.82, 1.0)}


def tint(rgb: UInt8Array, light: tuple[float, float, float]) -> UInt8Array:
    """Return a picture as it looks under a coloured light."""
    return np.asarray(color.to_uint8(color.linear_to_srgb(color.srgb_to_linear(rgb) * np.array(light))))


def spread(rgb: Array) -> int:
    """Return by how much the channels of the grey patches differ at most."""
    greys = np.array([rgb[4 + 48 + 5, 4 + 16 * i + 5] for i in range(6)]).astype(np.int64)
    return int((greys.max(axis=1) - greys.min(axis=1)).max())


def balance() -> Result:
    """Balance a chart under two lights, five ways."""
    chart, rows, panels = chart_of_patches(), list[Row](), list[Panel]()
    ways: dict[str, Callable[[UInt8Array, Float64Array], Array]] = {
        "as it was taken": lambda rgb, white: rgb,
        "grey world": lambda rgb, white: white_balance.grey_world(rgb),
        "white patch": lambda rgb, white: white_balance.white_patch(rgb),
        "shades of grey, p = 6": lambda rgb, white: white_balance.shades_of_grey(rgb),
        "von Kries, white known": lambda rgb, white: white_balance.von_kries(rgb, white, color.D65),
        "Bradford, white known": lambda rgb, white: white_balance.bradford(rgb, white, color.D65),
    }
    found: dict[str, list[object]] = {name: [] for name in ways}
    for light, factors in LIGHTS.items():
        taken = tint(chart, factors)
        white = color.linear_to_xyz(np.array(factors))
        for name, way in ways.items():
            shown = way(taken, white)
            off = np.abs(shown.astype(np.int64) - chart).max(axis=2)
            found[name] += [spread(shown), float(off.mean())]
            if light == "lamp light" or name == "as it was taken":
                panels.append(panel(f"{light}: {name}" if name == "as it was taken" else name, shown, 2))
    rows = [(name, *values) for name, values in found.items()]
    neutral = white_balance.bradford(chart, color.D65, color.D65)
    error = float(np.abs(neutral.astype(np.int64) - chart).mean())
    rows.append(("Bradford from a white to itself", spread(neutral), error, "", ""))
    headings = (
        "",
        *(f"{light}: {what}" for light in LIGHTS for what in ("worst tint of a grey, levels", "mean error, levels")),
    )
    return Result(Table(headings, tuple(rows)), tuple(panels))


# The checker shadow. All lengths are pixels of a picture of 160 x 120.
BOARD = np.array([(80.0, 20.0), (152.0, 58.0), (80.0, 104.0), (8.0, 58.0)])  # back, right, front, left
DARK, LIGHT, SHADOW = 0.18, 0.36, 0.5  # reflectances of the checks, and the light left in the shadow
CHECKS = 5
A, B = (51, 43), (94, 68)  # the middles of check (0, 2), dark, and of check (3, 2), light


def board_point(u: float, v: float) -> tuple[float, float]:
    """Return where a place of the board, 0 to 1 each way, lies in the picture: bilinear between its corners."""
    back, right, front, left = BOARD
    place = back * (1 - u) * (1 - v) + right * u * (1 - v) + front * u * v + left * (1 - u) * v
    return float(place[0]), float(place[1])


def check_numbers() -> Array:
    """Return which check each pixel shows, (120, 160), -1 for none: u + 5 v."""
    grid = [[board_point(i / CHECKS, j / CHECKS) for i in range(CHECKS + 1)] for j in range(CHECKS + 1)]
    rings = [[grid[j][i], grid[j][i + 1], grid[j + 1][i + 1], grid[j + 1][i]] for j in range(CHECKS) for i in range(CHECKS)]
    return zones(rings, (160, 120))


def shadow_share(softness: int) -> Float64Array:
    """Return the share of light that reaches each pixel: SHADOW in the shadow's core, 1 outside, in steps between."""
    core = np.array([(146, 62), (120, 44), (88, 50), (52, 58), (46, 70), (66, 80), (100, 76), (128, 78)], np.float64)
    middle, steps = core.mean(axis=0), max(softness, 1)
    total = np.zeros((120, 160))
    for k in range(steps):
        grown = middle + (core - middle) * (1 + 0.5 * (k / steps if softness else 0.25))
        total += coverage(grown, (160, 120), mode="area") / steps
    return 1 - (1 - SHADOW) * np.rint(total * 4096) / 4096


def checker_picture(softness: int = 12) -> UInt8Array:
    """Return the board with a cylinder and its shadow, (120, 160, 3)."""
    check = check_numbers()
    is_light = (check % CHECKS + check // CHECKS) % 2 == 1
    light = np.where(is_light, LIGHT, DARK) * shadow_share(softness)
    grey = np.where(check >= 0, color.to_uint8(color.linear_to_srgb(light)), 236).astype(np.uint8)
    canvas = Canvas(160, 120, "white")
    canvas.pixels[..., :3] = grey[..., None]

    # The cylinder stands at the right and keeps the light from the board.
    x = np.linspace(118, 146, 29)
    shade = 0.25 + 0.5 * np.sqrt(np.clip(1 - ((x - 124) / 24) ** 2, 0, 1))
    for left, share in zip(x, shade, strict=False):
        tone = np.rint(np.array([70, 150, 90]) * share + 20).astype(np.uint8)
        drop = 5 * np.sqrt(max(0.0, 1 - ((left - 132) / 14.5) ** 2))
        canvas.polygon([(left, 26), (left + 1, 26), (left + 1, 58 + drop), (left, 58 + drop)], tone)
    angle = np.linspace(0, 2 * np.pi, 60)
    canvas.polygon(np.stack([132.5 + 14.5 * np.cos(angle), 26 + 5 * np.sin(angle)], axis=1), (126, 200, 140), antialias=True)
    return canvas.pixels[..., :3].copy()


def checker_shadow() -> Result:
    """Draw the checker shadow, read both checks, and draw it again with a strip that joins them."""
    picture = checker_picture()
    a, b = (int(picture[y, x, 0]) for x, y in (A, B))
    strip = Canvas.from_array(np.dstack([picture, np.full((120, 160), 255, np.uint8)]))
    strip.polyline([A, B], (a, a, a), width=9)
    sharp = checker_picture(softness=0)
    check = check_numbers()
    numbers = [int(check[y, x]) for x, y in (A, B)]
    around = [
        float(picture[y - 14 : y + 15, x - 14 : x + 15][check[y - 14 : y + 15, x - 14 : x + 15] >= 0].mean()) for x, y in (A, B)
    ]
    patches = beside(np.full((24, 24, 3), a, np.uint8), np.full((24, 24, 3), b, np.uint8), gap=0)
    rows = (
        ("check A, of dark paint in the light: sRGB code", a), ("check B, of light paint in the shadow", b), ("equal", a == b),
        ("A: paint x light", DARK), ("B: paint x light", LIGHT * SHADOW),
        ("mean of what surrounds A", around[0]), ("mean of what surrounds B", around[1]),
        ("A is of dark paint, B of light", numbers[0] % 2 != numbers[1] % 2),
        ("sharp shadow: A equal to B", int(sharp[A[1], A[0], 0]) == int(sharp[B[1], B[0], 0])),
    )  # fmt: skip
    marked = Canvas.from_array(np.dstack([picture, np.full((120, 160), 255, np.uint8)]))
    for letter, place in ((LETTER_A, A), (LETTER_B, B)):
        for stroke in letter:
            marked.polyline(np.array(stroke) + place, "white", width=1.0, antialias=True)
    panels = (
        panel("Which is darker, A or B?", marked.pixels, 3), panel("A strip in the colour of both", strip.pixels, 3),
        panel("A sharp shadow is taken for paint more easily", sharp, 3), panel("A and B without the board", patches, 3),
    )  # fmt: skip
    return Result(Table(("", ""), rows), panels)


LETTER_A = [[(-2.5, 3), (0, -3.5), (2.5, 3)], [(-1.5, 1), (1.5, 1)]]
LETTER_B = [[(-2, 3), (-2, -3.5), (1, -3.5), (2, -2), (1, -0.5), (-2, -0.5)], [(1, -0.5), (2.4, 1.2), (1, 3), (-2, 3)]]

EXPERIMENTS = (
    Experiment(
        "hue-saturation-value", "S2", "28-34", "Review: HSV Color Space",
        "Hue, saturation, value",
        "Red and green make yellow, whose hue lies between theirs; a matrix would add the hues. Greys have no hue, and "
        "black is V = 0. White has V = 1 like every pure colour, so V is the distance from black alone.",
        hue_saturation_value, (74,), rgb_to_hsv, "np.stack([_hexagon_hue",
    ),
    Experiment(
        "luma-and-chroma", "S2", "36-50", "Review: YIQ Color Space",
        "Y, I and Q",
        "The slide's matrix: its rows add up to 1, 0 and 0, so a grey has no I and no Q, and a black and white set can "
        "show Y alone. Green weighs most, then red, then blue.",
        luma_chroma, (75, 76), color.rgb_to_yiq, "i = forward[1, 0]",
    ),
    Experiment(
        "luminance-and-intensity", "S2", "52-66", "Review: Luminance vs. Intensity",
        "How bright is a colour?",
        "The mean of the three channels says that green and blue are equally bright; luminance says what is seen. V of "
        "HSV is the largest channel and neither of them, though the slide puts them together; and .333 three times is "
        ".999, so white becomes 254.7.",
        luminance_and_intensity, (76, 77), brightness.weigh, "green + (red *", slips=(15,),
    ),
    Experiment(
        "white-balance", "S2", "68-77", "Review: Color Constancy",
        "White balance",
        "A chart of paints under lamp light. Where nothing is known, grey world takes the mean for grey and white patch "
        "the brightest for white; where the white is known, it is adapted in the cones. The six greys tell how well it "
        "went.",
        balance, (78,), white_balance.grey_world, "_minkowski_mean(channel, 1)",
    ),
    Experiment(
        "checker-shadow", "S3", "632-660", "Lighting Perception",
        "Check A and check B",
        "Dark paint in the light and light paint in the shadow send the same light to the eye, to the last bit. B looks "
        "lighter because its surround is darker, and because the soft edge tells of a shadow: a lamp has a size, so its "
        "shadow has a rim.",
        checker_shadow, (117,), checker_picture, "np.where(is_light",
    ),
)  # fmt: skip
