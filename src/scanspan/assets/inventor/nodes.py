"""The table of node types: their fields, the types of these, and what holds where nothing is said.

One line a type, continued where it is indented. A star marks a type that may have children. An enumeration lists its words,
the default first. The names of Inventor 1.0 that were changed later stand in ALIASES.

Source: Wernecke, The Inventor Mentor, and the reference pages of Inventor 2.1, "File format/defaults" of each class.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

BINDING = "PER_VERTEX_INDEXED OVERALL PER_PART PER_PART_INDEXED PER_FACE PER_FACE_INDEXED PER_VERTEX NONE DEFAULT"
WHOLE = "OVERALL PER_PART PER_PART_INDEXED PER_FACE PER_FACE_INDEXED PER_VERTEX PER_VERTEX_INDEXED NONE DEFAULT"
CULLED = " ".join(
    f"{name}:Enum(AUTO ON OFF)" for name in ("renderCaching", "boundingBoxCaching", "renderCulling", "pickCulling")
)
CAMERA = (
    "viewportMapping:Enum(ADJUST_CAMERA CROP_VIEWPORT_FILL_FRAME CROP_VIEWPORT_LINE_FRAME CROP_VIEWPORT_NO_FRAME LEAVE_ALONE) "
    "position:Vec3f=0,0,1 orientation:Rotation aspectRatio:Float=1 "
    "nearDistance:Float=1 farDistance:Float=10 focalDistance:Float=5"
)
LIGHT = "on:Bool=1 intensity:Float=1 color:Color=1,1,1"
INDICES = (
    "coordIndex:MFInt32=0 materialIndex:MFInt32=-1 normalIndex:MFInt32=-1 textureCoordIndex:MFInt32=-1 vertexProperty:Node"
)
UNINDEXED = "startIndex:Int32 vertexProperty:Node"
INTERVAL = "on:Bool=1 speed:Float=1"
ANCHOR = "name:String description:String map:Enum(NONE POINT)"

TABLE = f"""
Separator* {CULLED}
Annotation* {CULLED}
LocateHighlight* {CULLED} mode:Enum(AUTO ON OFF) style:Enum(EMISSIVE EMISSIVE_DIFFUSE) color:Color=.3,.3,.3
Selection* {CULLED} policy:Enum(SHIFT TOGGLE SINGLE)
WWWAnchor* {CULLED} mode:Enum(AUTO ON OFF) style:Enum(EMISSIVE EMISSIVE_DIFFUSE) color:Color=.3,.3,.3 {ANCHOR}
WWWInline* {CULLED} name:String bboxCenter:Vec3f bboxSize:Vec3f alternateRep:Node
Group*
TransformSeparator*
Switch* whichChild:Int32=-1
PathSwitch*
Blinker* whichChild:Int32=-1 {INTERVAL}
LevelOfDetail* screenArea:MFFloat=0
LOD* range:MFFloat center:Vec3f
Array* numElements1:Short=1 numElements2:Short=1 numElements3:Short=1 separation1:Vec3f=1,0,0 separation2:Vec3f=0,1,0
  separation3:Vec3f=0,0,1 origin:Enum(FIRST CENTER LAST)
MultipleCopy* matrix:MFMatrix
File name:String
Info string:String
Label label:Name
Units units:Enum(METERS CENTIMETERS MILLIMETERS MICROMETERS MICRONS NANOMETERS ANGSTROMS KILOMETERS FEET INCHES POINTS
  YARDS MILES NAUTICAL_MILES)
Coordinate3 point:MFVec3f=0,0,0
Coordinate4 point:MFVec4f=0,0,0,1
Normal vector:MFVec3f
NormalBinding value:Enum({BINDING})
VertexProperty vertex:MFVec3f normal:MFVec3f texCoord:MFVec2f texCoord3:MFVec3f orderedRGBA:MFUInt32
  normalBinding:Enum({BINDING}) materialBinding:Enum({WHOLE})
Material ambientColor:MFColor=.2,.2,.2 diffuseColor:MFColor=.8,.8,.8 specularColor:MFColor=0,0,0
  emissiveColor:MFColor=0,0,0 shininess:MFFloat=.2 transparency:MFFloat=0
MaterialBinding value:Enum({WHOLE})
BaseColor rgb:MFColor=.8,.8,.8
PackedColor orderedRGBA:MFUInt32=3435973887 rgb:MFUInt32
LightModel model:Enum(PHONG BASE_COLOR)
DrawStyle style:Enum(FILLED LINES POINTS INVISIBLE) pointSize:Float lineWidth:Float linePattern:UShort=65535
ShapeHints vertexOrdering:Enum(UNKNOWN_ORDERING CLOCKWISE COUNTERCLOCKWISE) shapeType:Enum(UNKNOWN_SHAPE_TYPE SOLID)
  faceType:Enum(CONVEX UNKNOWN_FACE_TYPE) creaseAngle:Float windingType:Enum(NO_WINDING_TYPE) hints:BitMask
Complexity type:Enum(OBJECT_SPACE SCREEN_SPACE BOUNDING_BOX) value:Float=.5 textureQuality:Float=.5
Environment ambientIntensity:Float=.2 ambientColor:Color=1,1,1 attenuation:Vec3f=0,0,1 fogType:Enum(NONE HAZE FOG SMOKE)
  fogColor:Color=1,1,1 fogVisibility:Float
Texture2 filename:String image:Image wrapS:Enum(REPEAT CLAMP) wrapT:Enum(REPEAT CLAMP) model:Enum(MODULATE DECAL BLEND
  REPLACE) blendColor:Color=0,0,0 enableCompressedTexture:Bool
Texture3 filenames:MFString images:Image3 wrapR:Enum(REPEAT CLAMP) wrapS:Enum(REPEAT CLAMP) wrapT:Enum(REPEAT CLAMP)
  model:Enum(MODULATE DECAL BLEND REPLACE) blendColor:Color=0,0,0
Texture2Transform translation:Vec2f rotation:Float scaleFactor:Vec2f=1,1 center:Vec2f
Texture3Transform translation:Vec3f rotation:Rotation scaleFactor:Vec3f=1,1,1 scaleOrientation:Rotation center:Vec3f
TextureCoordinate2 point:MFVec2f=0,0
TextureCoordinate3 point:MFVec3f=0,0,0
TextureCoordinateBinding value:Enum(PER_VERTEX_INDEXED PER_VERTEX NONE DEFAULT)
TextureCoordinateDefault
TextureCoordinateEnvironment
TextureCoordinatePlane directionS:Vec3f=1,0,0 directionT:Vec3f=0,1,0
Translation translation:Vec3f
Rotation rotation:Rotation
RotationXYZ axis:Enum(X Y Z) angle:Float
Scale scaleFactor:Vec3f=1,1,1
Transform translation:Vec3f rotation:Rotation scaleFactor:Vec3f=1,1,1 scaleOrientation:Rotation center:Vec3f
MatrixTransform matrix:Matrix
ResetTransform whatToReset:BitMask
AntiSquish sizing:Enum(AVERAGE_DIMENSION BIGGEST_DIMENSION SMALLEST_DIMENSION LONGEST_DIAGONAL X Y Z) recalcAlways:Bool=1
Rotor rotation:Rotation=0,0,1,0 {INTERVAL}
Pendulum rotation:Rotation rotation0:Rotation rotation1:Rotation {INTERVAL}
Shuttle translation:Vec3f translation0:Vec3f translation1:Vec3f {INTERVAL}
PerspectiveCamera {CAMERA} heightAngle:Float=.785398
OrthographicCamera {CAMERA} height:Float=2
DirectionalLight {LIGHT} direction:Vec3f=0,0,-1
PointLight {LIGHT} location:Vec3f=0,0,1
SpotLight {LIGHT} location:Vec3f=0,0,1 direction:Vec3f=0,0,-1 dropOffRate:Float cutOffAngle:Float=.785398
Font name:Name=defaultFont size:Float=10
FontStyle name:Name=defaultFont size:Float=10 family:Enum(SERIF SANS TYPEWRITER) style:BitMask
ProfileCoordinate2 point:MFVec2f=0,0
ProfileCoordinate3 point:MFVec3f=0,0,1
LinearProfile index:MFInt32=0 linkage:Enum(START_FIRST START_NEW ADD_TO_CURRENT)
NurbsProfile index:MFInt32=0 linkage:Enum(START_FIRST START_NEW ADD_TO_CURRENT) knotVector:MFFloat
PickStyle style:Enum(SHAPE BOUNDING_BOX UNPICKABLE SHAPE_ON_TOP BOUNDING_BOX_ON_TOP SHAPE_FRONTFACES)
ClipPlane plane:Plane=1,0,0,0 on:Bool=1
PolygonOffset factor:Float=1 units:Float=1 styles:BitMask on:Bool=1
TransparencyType value:Word
ColorIndex index:MFInt32
EventCallback
Callback
Cube width:Float=2 height:Float=2 depth:Float=2
Sphere radius:Float=1
Cone parts:BitMask bottomRadius:Float=1 height:Float=2
Cylinder parts:BitMask radius:Float=1 height:Float=2
IndexedFaceSet {INDICES}
IndexedLineSet {INDICES}
IndexedPointSet {INDICES}
IndexedTriangleStripSet {INDICES}
FaceSet {UNINDEXED} numVertices:MFInt32=-1
LineSet {UNINDEXED} numVertices:MFInt32=-1
TriangleStripSet {UNINDEXED} numVertices:MFInt32=-1
PointSet {UNINDEXED} numPoints:Int32=-1
MarkerSet {UNINDEXED} numPoints:Int32=-1 markerIndex:MFInt32=0
QuadMesh {UNINDEXED} verticesPerColumn:Int32=1 verticesPerRow:Int32=1
NurbsSurface numUControlPoints:Int32 numVControlPoints:Int32 numSControlPoints:Int32 numTControlPoints:Int32
  uKnotVector:MFFloat vKnotVector:MFFloat sKnotVector:MFFloat tKnotVector:MFFloat
IndexedNurbsSurface numUControlPoints:Int32 numVControlPoints:Int32 coordIndex:MFInt32 uKnotVector:MFFloat
  vKnotVector:MFFloat numSControlPoints:Int32 numTControlPoints:Int32 textureCoordIndex:MFInt32=-1 sKnotVector:MFFloat
  tKnotVector:MFFloat
NurbsCurve numControlPoints:Int32 knotVector:MFFloat
IndexedNurbsCurve numControlPoints:Int32 coordIndex:MFInt32 knotVector:MFFloat
Text2 string:MFString spacing:Float=1 justification:Enum(LEFT RIGHT CENTER)
Text3 string:MFString spacing:Float=1 justification:Enum(LEFT RIGHT CENTER) parts:BitMask
AsciiText string:MFString spacing:Float=1 justification:Enum(LEFT RIGHT CENTER) width:MFFloat
"""

# Names that were changed, and classes that are read as another.
ALIASES = {
    "IndexedTriangleMesh": "IndexedTriangleStripSet",
    "TriangleMesh": "TriangleStripSet",
    "IndexedMarkerSet": "IndexedPointSet",
    "Antisquish": "AntiSquish",
    "Root": "Group",
    "Scene": "Separator",
}

WIDTHS = {"Vec2f": 2, "Vec3f": 3, "Vec4f": 4, "Color": 3, "Plane": 4, "Rotation": 4, "Matrix": 16, "Vec2s": 2, "Vec3d": 3}
WHOLE_NUMBERS = ("Int32", "UInt32", "Long", "ULong", "Short", "UShort")
NUMBERS = ("Float", "Double", "Time", *WHOLE_NUMBERS)
TEXTS = ("String", "Name", "Enum", "Word")
OTHERS = ("Bool", "BitMask", "Node", "Image", "Image3", "Trigger")


class FieldType(NamedTuple):
    """The type of a field: what one value is, whether there may be many, and the words of an enumeration."""

    kind: str  # of WIDTHS, NUMBERS, TEXTS or OTHERS
    is_many: bool
    words: tuple[str, ...] = ()
    default: Any = None


class NodeType(NamedTuple):
    """A type of node: its fields by name, and whether it may have children."""

    name: str
    fields: dict[str, FieldType]
    is_group: bool


def field_type(name: str) -> FieldType | None:
    """Return the type of a name such as "SFVec3f" or "MFEnum", as files describe types of their own; None for no such type."""
    kind = name[2:]
    known = kind in WIDTHS or kind in NUMBERS or kind in TEXTS or kind in OTHERS
    if name[:2] not in ("SF", "MF") or not known:
        return None
    kind = "Word" if kind == "Enum" else kind
    return FieldType(kind, name[:2] == "MF", (), empty(kind, name[:2] == "MF"))


def empty(kind: str, is_many: bool, listed: str = "") -> Any:
    """Return the value of a field where nothing is said, from the numbers or the text in the table."""
    if kind in WIDTHS:
        width = WIDTHS[kind]
        numbers = np.array([float(word) for word in listed.split(",") if word])
        if is_many:
            return numbers.reshape(-1, width)
        if kind == "Matrix":
            return np.eye(4)
        return numbers if len(numbers) else np.array([0.0, 0.0, 0.0, 1.0]) if kind == "Rotation" else np.zeros(width)
    if kind in NUMBERS:
        number = int if kind in WHOLE_NUMBERS else float
        if is_many:
            return np.array([number(word) for word in listed.split(",") if word], dtype=number)
        return number(listed or 0)
    if kind in TEXTS:
        return ([listed] if listed else []) if is_many else listed
    if kind == "Bool":
        return listed == "1"
    return () if kind == "BitMask" else [] if is_many else None


def _read_field(words: str) -> tuple[str, FieldType]:
    """Return a field of the table, "name:Type=default" or "name:Enum(FIRST SECOND)"."""
    name, _, rest = words.partition(":")
    kind, _, listed = rest.partition("=")
    kind, _, choices = kind.partition("(")
    is_many = kind.startswith("MF")
    kind = kind.removeprefix("MF")
    options = tuple(choices.rstrip(")").split())
    return name, FieldType(kind, is_many, options, options[0] if options else empty(kind, is_many, listed))


def _read_table() -> dict[str, NodeType]:
    """Return the table, by the name of the type."""
    types = {}
    for line in TABLE.strip().replace("\n  ", " ").splitlines():
        name, _, rest = line.partition(" ")
        parts, depth, start = [], 0, 0
        for place, mark in enumerate(rest + " "):
            depth += {"(": 1, ")": -1}.get(mark, 0)
            if mark == " " and depth == 0:
                parts.append(rest[start:place])
                start = place + 1
        fields = dict(_read_field(part) for part in parts if part)
        types[name.rstrip("*")] = NodeType(name.rstrip("*"), fields, name.endswith("*"))
    return types


NODES = _read_table()


def node_type(name: str) -> NodeType | None:
    """Return a type of node by the name that stands in a file, with or without So before it; None for one that is not known.

    >>> node_type("Cube").fields["width"].default
    2.0
    """
    plain = name.removeprefix("So") if name.removeprefix("So") in NODES else name
    return NODES.get(ALIASES.get(plain, plain))
