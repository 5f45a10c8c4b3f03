"""List what a user can choose, in one place for the operators, the panels and the command line."""

from __future__ import annotations

from dataclasses import dataclass

# Context of our words where Blender's own dictionary has another meaning of the same one.
CONTEXT = "OMT UV"
# identifier, label, description; the solver and the command line use the identifier in lower case.
BOUNDARIES = (
    ("FREE", "Free", "The outline follows from the surface: the least shear"),
    ("DISK", "Disk", "Every island becomes a disk"),
    ("SQUARE", "Square", "Every island becomes a square"),
    (
        "RECTANGLE",
        "Rectangle",
        "Every island becomes a rectangle, by itself of the aspect that it would have without shear: trims, straps",
    ),
)
MAPS = (
    ("AUTHALIC", "Area Preserving", "Exact areas, or a balance between these and the least shear"),
    ("CONFORMAL", "Conformal", "Angles alone, as papers compare with it: areas vary, and nothing is refined"),
    (
        "POLAR",
        "Polar Factorisation",
        "Cells of optimal transport from the conformal map, as papers have it: "
        "balance is between exact areas of cells and the conformal map",
    ),
)
QUALITIES = (
    ("DRAFT", "Draft", "Fast; areas a few percent off where the surface is hard to flatten"),
    ("STANDARD", "Standard", "Areas right to within about one percent of the texture"),
    ("EXACT", "Exact", "Areas right to about a tenth of a percent of the texture; several times slower"),
)
SEAMS = (
    (
        "AUTO",
        "Auto",
        "Islands follow the seams; what they leave closed, ringed or knotted is cut open along short paths",
    ),
    ("EXISTING", "Existing", "Islands follow the seams alone; what they do not open into a disk is refused"),
    ("CHARTS", "Charts", "Many islands of little distortion, inside those that the seams make"),
)
PROJECTIONS = (
    ("EQUIRECT", "Equirectangular", "Longitude and latitude: for globe textures and panoramas as they are"),
    ("LAMBERT", "Lambert Equal Area", "A cylinder that keeps areas: every part gets its share of the texture"),
    ("OCTAHEDRAL", "Octahedral Equal Area", "A square folded from an octahedron, which keeps areas with less shear"),
)
IMAGE_LAYOUTS = (
    ("EQUIRECT", "Panorama", "Longitude and latitude: the whole sphere as it is seen all around"),
    ("SINUSOIDAL", "Flat Picture", "Any picture, wrapped around the globe without pinching it at the poles"),
)
SPHERE_METHODS = (
    ("NEWTON", "Newton", "Optimal transport on the sphere, refined"),
    ("FLOW", "Flow", "The flow of Dominitz and Tannenbaum, refined"),
    ("MOSER", "Moser", "Moser's flow alone, with no refinement: areas nearly right, much shear, for comparison"),
)
DEFAULT_PROJECTION = "EQUIRECT"
DEFAULT_SPHERE_METHOD = "NEWTON"
DEFAULT_BOUNDARY = "FREE"
DEFAULT_MAP = "AUTHALIC"
DEFAULT_SEAMS = "AUTO"
DEFAULT_QUALITY = "STANDARD"
DEFAULT_BALANCE = 0.0
# Pixels between islands, and along a side of the texture.
DEFAULT_MARGIN = 4
DEFAULT_TEXTURE_SIZE = 1024
# UDIM number of the unit square.
FIRST_TILE = 1001
COUNTS = (
    ("VERTICES", "Vertices", "As many vertices as asked"),
    ("FACES", "Faces", "As many triangles as asked"),
    ("EDGE", "Edge Length", "As many triangles as make edges of this length on average, in the units of the scene"),
)
DENSITIES = (
    ("UNIFORM", "Uniform", "Triangles of one size everywhere"),
    ("CURVATURE", "Curvature", "Smaller triangles where the surface curves"),
    ("GAUSSIAN", "Gaussian Curvature", "Smaller triangles at tips, dents and saddles, and not where it bends one way"),
    ("SALIENCY", "Saliency", "Smaller triangles where the shape draws attention"),
    ("WEIGHTS", "Vertex Group", "Smaller triangles where the weights of a vertex group are large"),
    ("ATTRIBUTE", "Attribute", "Vertices per area in proportion to an attribute of floats, on vertices or faces"),
)
STRATEGIES = (
    (
        "APP-CFP",
        "Even, Well Shaped",
        "Vertices where areas ask for them, joined where angles are right (APP, CFP): "
        "sample on the area-preserving map, triangulate on the conformal map",
    ),
    ("APP-APP", "Areas Alone", "For comparison (APP, APP): sample and triangulate on the area-preserving map"),
    ("CFP-CFP", "Angles Alone", "For comparison (CFP, CFP): sample and triangulate on the conformal map"),
    (
        "CFP-APP",
        "Angles, Then Areas",
        "For comparison (CFP, APP): sample on the conformal map, triangulate on the area-preserving one",
    ),
)
DEFAULT_STRATEGY = "APP-CFP"

# Mean shear s1/s2 above which islands are cut further. A checker on a surface shows 1.5 at a glance, 1.2 hardly; seams
# for 1.35 are about as long as those that artists cut into heads and animals.
DEFAULT_MAX_SHEAR = 1.35
# What is magnified shears where the density changes: seams for less would be longer than an artist wants.
DEFAULT_MAGNIFIED_SHEAR = 1.5
# A result is good up to these, as shares of the area of the texture: standard quality keeps to the first one.
AREA_BOUND = 0.01
OVERLAP_BOUND = 1e-4


@dataclass(frozen=True)
class Settings:
    """How to unwrap.

    boundary, quality : an identifier of the lists above in lower case
    balance : from 0, exact areas, to 1, least shear
    margin : pixels of a texture `texture_size` pixels wide; pack : arrange the islands in the unit square; tile : UDIM
        number of the square, 1001 for the unit square; pack_around : leave room for islands of the tile that
        stay; turn_to_fit : turn islands any way that packs closer
    seams : an identifier of the list above in lower case; fill_holes : take all boundaries of a part but the longest
        for filled; max_shear : cut islands further until their mean shear is below, 0 for no such cuts
    cut_further : those whose seams were marked by hand, too
    kind : an identifier of MAPS in lower case; aspect : height over width of a rectangle, 0 for its own
    """

    boundary: str = DEFAULT_BOUNDARY.lower()
    quality: str = DEFAULT_QUALITY.lower()
    balance: float = DEFAULT_BALANCE
    margin: float = DEFAULT_MARGIN
    texture_size: int = DEFAULT_TEXTURE_SIZE
    pack: bool = True
    pack_around: bool = False
    turn_to_fit: bool = False
    tile: int = FIRST_TILE
    seams: str = DEFAULT_SEAMS.lower()
    fill_holes: bool = False
    max_shear: float = 0.0
    cut_further: bool = False
    kind: str = DEFAULT_MAP.lower()
    aspect: float = 0.0

    @property
    def tile_origin(self) -> tuple[int, int]:
        """Lower left corner of the UDIM tile: ten in a row."""
        row, column = divmod(self.tile - FIRST_TILE, 10)
        return column, row

    def unwrap_arguments(self) -> dict:
        """How to make and map charts: arguments of the solver's `UnwrapOptions`."""
        return {
            "boundary": self.boundary,
            "quality": self.quality,
            "balance": self.balance,
            "seams": "existing" if self.seams == "existing" else "auto",
            "fill_holes": self.fill_holes,
            # Charts are cut for their shear already.
            "max_shear": 0.0 if self.seams == "charts" else self.max_shear,
            "cut_further": self.cut_further,
            "kind": self.kind,
            "aspect": self.aspect,
        }


@dataclass(frozen=True)
class RefineSettings(Settings):
    """How to refine existing UVs; the boundary is free.

    keep_boundary : the outline of every island stays exactly as it is; pack : arrange the islands anew
    """

    pack: bool = False
    keep_boundary: bool = False


@dataclass(frozen=True)
class RemeshSettings:
    """How to make a new mesh.

    count_of : an identifier of COUNTS in lower case; count : vertices, faces, or the length of an edge
    density : an identifier of DENSITIES in lower case; factor : density where the weight, or the saliency, is 1 next to
        where it is 0; amount : how much curvature counts next to area; source : the vertex group or attribute;
        grading : most that the edge length may grow by per length, 0 for no limit
    preserve_* : features that edges of the new mesh follow; sharp_angle : edges with more than this many radians
        between their faces are sharp
    levels : how many meshes, each with `ratio` times the count of the one before
    strategy : an identifier of STRATEGIES in lower case
    """

    count_of: str = "vertices"
    count: float = 5000
    density: str = "uniform"
    factor: float = 4.0
    amount: float = 1.0
    source: str = ""
    grading: float = 0.0
    preserve_boundary: bool = True
    preserve_sharp: bool = False
    sharp_angle: float = 0.7
    preserve_seams: bool = True
    preserve_materials: bool = True
    preserve_attributes: bool = True
    levels: int = 1
    ratio: float = 0.5
    strategy: str = DEFAULT_STRATEGY.lower()


# Of the operator alone: what it does depends on what it finds.
AUTO_SOURCE = ("AUTO", "Auto", "Inside the UV islands where every object has UVs, unwrapped anew otherwise")
SOURCES = (
    ("MESH", "New UVs", "Unwrap anew: every part of the surface gets its share, and the region what was asked"),
    (
        "UV",
        "Existing UVs",
        "Magnify inside the UV islands that are there, in their own outline, as under a glass",
    ),
)
REGIONS = (
    (
        "GROUP",
        "Vertex Group",
        "Painted in Weight Paint; or saliency or curvature, computed where no group has that name",
    ),
    ("ATTRIBUTE", "Attribute", "Floats on vertices or faces, such as those that Geometry Nodes store"),
)
DEFAULT_REGION = "GROUP"
OWN_BOUNDARY = ("OWN", "Own", "The outline that islands have: circles and straight sides stay, others are free")
DEFAULT_SOURCE = "MESH"
DEFAULT_FACTOR = 4.0


@dataclass(frozen=True)
class MagnifySettings(Settings):
    """How to magnify a painted region.

    factor : times its share; exact : of the whole texture, otherwise against what has weight 0
    source : an identifier of SOURCES in lower case; boundary : of BOUNDARIES, or "own" for existing UVs
    cascade : how often; k times the factor m is m^k
    """

    factor: float = DEFAULT_FACTOR
    exact: bool = True
    source: str = DEFAULT_SOURCE.lower()
    cascade: int = 1


@dataclass(frozen=True)
class GlobeSettings:
    """How to map closed parts to the sphere and the sphere to the plane.

    projection, quality, method : an identifier of the lists above in lower case
    balance : from 0, exact areas, to 1, least shear
    inside : scale the layout into the tile where faces across its edge reach beyond it
    fill_holes : take holes for filled, for the map alone
    """

    projection: str = DEFAULT_PROJECTION.lower()
    quality: str = DEFAULT_QUALITY.lower()
    balance: float = DEFAULT_BALANCE
    method: str = DEFAULT_SPHERE_METHOD.lower()
    inside: bool = False
    fill_holes: bool = False


WEIGHT_KINDS = (
    (
        "SALIENCY",
        "Saliency",
        "What stands out from its surroundings at several scales: features that the eye looks for",
    ),
    ("GAUSSIAN", "Gaussian Curvature", "Tips, saddles and dents, which no flat map keeps"),
    ("MEAN", "Mean Curvature", "Ridges and valleys as well"),
    ("SHARPNESS", "Edge Sharpness", "Vertices at sharp edges"),
    ("DISTANCE", "Distance", "Near to the selected vertices, along the surface"),
)
DEFAULT_KIND = "SALIENCY"
DEFAULT_GROUP = "omt_weights"
# Shares of the surface area with weight 0, and up to weight 1: what is left has four times its share on a third of the
# texture, and features keep room for what is around them.
DEFAULT_LOW = 0.8
DEFAULT_HIGH = 0.98

# What the cells of a power diagram fill.
DOMAINS = (
    ("DISK", "Disk", "Cells of the unit disk, for the largest part, cut open where it has to be"),
    ("SQUARE", "Square", "Cells of a square"),
    ("RECTANGLE", "Rectangle", "Cells of a rectangle of the part's own aspect"),
    ("SPHERE", "Sphere", "Cells of the sphere, for closed meshes"),
)

# What a partition becomes.
CELL_WRITES = (
    ("FACE_SETS", "Face Sets", "A face set of Sculpt Mode for each cell; cells follow faces"),
    ("MATERIALS", "Materials", "A material slot for each cell; cells follow faces"),
    ("SEAMS", "Seams", "Seams between cells, which follow faces: tiles of equal texels"),
    ("ATTRIBUTE", "Attribute", "The number of the cell, from 0, as an integer on faces; cells follow faces"),
    ("MESH", "Cut Mesh", "A new object, cut along the cells, so that their areas are exact"),
    ("POINTS", "Points", "A new object of one vertex for each cell, with normals and radii, for Geometry Nodes"),
)
DEFAULT_CELL_WRITE = "FACE_SETS"
DEFAULT_CELLS = 50
DEFAULT_RELAX = 5
CELL_ATTRIBUTE = "OMT Cell"
# Every one is a slot of the object.
MOST_MATERIALS = 1000


@dataclass(frozen=True)
class PartitionSettings:
    """Into what to divide a surface.

    cells : how many; relax : how often their sites move to the means; write : an identifier of CELL_WRITES in lower
    case; seed : of the first sites
    """

    cells: int = DEFAULT_CELLS
    relax: int = DEFAULT_RELAX
    write: str = DEFAULT_CELL_WRITE.lower()
    seed: int = 0
