"""The options of `scanspan render`: what they are called, what the help says of them, and in which panel it stands.

They have f3d's names wherever f3d has such an option.

Source: F3D, "Command line options".
"""

from __future__ import annotations

from functools import partial
from typing import Annotated

import typer

# The options of `render`, by the panel of the help in which they stand.
_output = partial(typer.Option, rich_help_panel="Output")
_camera = partial(typer.Option, rich_help_panel="Camera")
_look = partial(typer.Option, rich_help_panel="Look")
_points = partial(typer.Option, rich_help_panel="Point clouds")
_limit = partial(typer.Option, rich_help_panel="Limits and machine")

Model = Annotated[
    str,
    typer.Argument(
        metavar="MODEL", help="OBJ, PLY, STL, OFF, glTF, GLB, 3MF, IV, a zip of one, or LAS, LAZ, XYZ, CSV, PTS, NPY."
    ),
]
Output = Annotated[
    str | None,
    _output(
        "-o", "--output", metavar="FILE",
        help="The picture: .png .jpg .ppm .npy, or .npz for arrays; - is a PNG on standard output. "
        "By default the model's name with .png, in the current folder.",
    ),
]  # fmt: skip
Resolution = Annotated[str | None, _output(metavar="W,H", help="Width and height in pixels; 1280,960 by default.")]
Size = Annotated[str | None, _output(metavar="WxH", help="The same as 1920x1080, or one number for a square.")]
Views = Annotated[
    str | None,
    _output(metavar="NAMES", help="Several views at one scale on a labelled sheet of that size, such as iso,front,right,top."),
]
Aov = Annotated[
    str | None,
    _output(
        metavar="NAMES",
        help="Arrays for a .npz: color, depth, primitive, object, barycentric, normal, position, uv; all by default.",
    ),
]
Metadata = Annotated[str | None, _output("--json", metavar="FILE", help="Camera matrices, counts, coverage and more, as JSON.")]
Up = Annotated[
    str | None, _camera(metavar="AXIS", help="+X -X +Y -Y +Z or -Z is up. By default +Z for STL, 3MF and LAS, else +Y.")
]
Direction = Annotated[
    str | None,
    _camera(
        "--camera-direction", metavar="NAME|X,Y,Z",
        help="iso (from 1,1,1; the default), front, back, left, right, top or bottom; or the direction of sight.",
    ),
]  # fmt: skip
Position = Annotated[str | None, _camera("--camera-position", metavar="X,Y,Z", help="Where the eye stands.")]
FocalPoint = Annotated[str | None, _camera("--camera-focal-point", metavar="X,Y,Z", help="What it looks at.")]
ViewUp = Annotated[str | None, _camera("--camera-view-up", metavar="X,Y,Z", help="What points up in the picture.")]
ViewAngle = Annotated[float, _camera("--camera-view-angle", metavar="DEGREES", help="Vertical field of view.")]
Zoom = Annotated[float, _camera("--camera-zoom-factor", metavar="FACTOR", help="1 fits the model, 2 shows it twice as large.")]
Azimuth = Annotated[
    float, _camera("--camera-azimuth-angle", metavar="DEGREES", show_default=False, help="Then walk round it, to the right.")
]
Elevation = Annotated[
    float, _camera("--camera-elevation-angle", metavar="DEGREES", show_default=False, help="Then rise above it.")
]
Orthographic = Annotated[bool, _camera("--camera-orthographic", help="No perspective.")]
NoBackground = Annotated[bool, _look("--no-background", help="A transparent background.")]
BackgroundColor = Annotated[
    str | None, _look(metavar="COLOR", help="A CSS name, '#rrggbb', 255,128,0 or 1.0,0.5,0.0. By default a soft gradient.")
]
Color = Annotated[str | None, _look(metavar="COLOR", help="One colour instead of all materials, textures and vertex colours.")]
Shading = Annotated[str, _look(metavar="NAME", help="auto (the file's normals, else smooth), smooth or flat.")]
CreaseAngle = Annotated[float, _look(metavar="DEGREES", help="Faces that meet at less look smooth.")]
Edges = Annotated[bool, _look("-e", "--edges", help="Draw the edges of the faces.")]
LineWidth = Annotated[float, _look(metavar="PIXELS", help="Width of the edges.")]
Cull = Annotated[str, _look(metavar="NAME", help="Leave out one side of the faces: none, back or front.")]
NoTextures = Annotated[bool, _look("--no-textures", help="Leave the textures out.")]
PointSize = Annotated[
    str | None,
    _points(
        metavar="PIXELS|NAME", help="Pixels; or density (the default), which closes surfaces; or spacing, one size for all."
    ),
]
PointShape = Annotated[str | None, _points(metavar="NAME", help="disc (the default), square or gaussian.")]
ColorBy = Annotated[
    str | None,
    _points(
        metavar="NAME", help="auto (colours where there are any, else elevation), rgb, elevation, intensity, class, return."
    ),
]
EyeDome = Annotated[
    bool | None, _points("--eye-dome/--no-eye-dome", show_default=False, help="Darken what lies behind an edge; on by default.")
]
Bounds = Annotated[str | None, _points(metavar="X0,Y0[,Z0],X1,Y1[,Z1]", help="Keep the points in a box, given by two corners.")]
Classification = Annotated[str | None, _points(metavar="NAMES", help="Keep some classes, such as ground,building or 2,6.")]
Returns = Annotated[str | None, _points(metavar="NAMES", help="Keep some returns: first, last, single, or numbers.")]
Samples = Annotated[int, _look(metavar="N", help="Samples a pixel: 1, 2, 4, 8 or 16. More are smoother.")]
Algorithm = Annotated[str, _limit(metavar="NAME", help="All paint the same picture; `scanspan info` lists them.")]
Order = Annotated[str, _limit(metavar="NAME", help="rows, serpentine, tiles, morton or hilbert; the picture is the same.")]
SubpixelBits = Annotated[
    int, _limit(metavar="BITS", help="Corners are snapped to 1/2^BITS pixel, 4 to 16; depth at grazing angles gains from 16.")
]
Threads = Annotated[int | None, _limit(metavar="N", help="By default one for each processor. The picture is the same.")]
MaxPixels = Annotated[int | None, _limit(metavar="N", help="Refuse larger pictures; 268435456 by default.")]
MaxBytes = Annotated[int | None, _limit(metavar="N", help="Refuse larger files; 2147483648 by default.")]
MaxTriangles = Annotated[int | None, _limit(metavar="N", help="Refuse larger models; 100000000 by default.")]
MaxTexturePixels = Annotated[int | None, _limit(metavar="N", help="Leave out larger textures; 67108864 by default.")]
MaxFaceCorners = Annotated[int | None, _limit(metavar="N", help="Refuse faces with more corners; 10000 by default.")]
MaxPoints = Annotated[int | None, _limit(metavar="N", help="Refuse larger clouds; 100000000 by default.")]
Nonfinite = Annotated[str, _limit(metavar="NAME", help="Vertices that are NaN or infinite: error, or drop their faces.")]
FileType = Annotated[str | None, _limit(metavar="NAME", help="Read the file as obj, ply, ..., whatever its name is.")]
Verbose = Annotated[bool, _limit("--verbose", help="Tell more on standard error.")]
Every = Annotated[bool, typer.Option("--all", help="Those of every algorithm too; that takes minutes.")]
