"""List what a user can choose of flows and volumes, for operators, panels and commands; identifiers in lower case."""

from __future__ import annotations

FLOW_PATHS = (
    ("RIGID", "Rigid", "Points of one handle turn together on their way"),
    ("STRAIGHT", "Straight", "Every point goes straight to its end"),
    ("RADIUS", "Radius", "Directions and distances from the middle change evenly"),
    ("BLEND", "Blend", "Straight in the middle, along the radius path far out"),
)
FLOW_HANDLES = (
    ("SELECTED", "Selection", "The selected vertices go where Move and Rotate say"),
    ("EMPTIES", "Empties", "Every object NAME with a partner NAME.to takes its place to that of the partner"),
    ("GROUPS", "Vertex Groups", "Every vertex group with an object of its name, or NAME.to, goes to it"),
    ("HOOKS", "Hooks", "Vertices of Hook modifiers go along with their objects"),
)
FLOW_RESULTS = (
    ("KEY", "Shape Key", "A new shape key, or one for every frame"),
    ("MESH", "Mesh", "The vertices themselves move"),
)
FLOW_WALLS = (
    ("FREE", "None", "Everything around may flow"),
    ("BALL", "Ball", "Nothing leaves the ball around an object"),
    ("MESH", "Mesh", "Nothing leaves a closed mesh"),
)
DEFAULT_RADIUS = 0.2
DEFAULT_PATH = "RIGID"
# How many chords a curved path has.
DEFAULT_SAMPLES = 32
VOLUME_DOMAINS = (
    ("BALL", "Ball", "The unit ball: every part gets its share of the volume"),
    ("CUBE", "Cube", "The cube from -1 to 1"),
    ("BODY", "Body", "The inside of another closed mesh, by way of the ball"),
)
VOLUME_METHODS = (
    ("NEWTON", "Newton", "Volumes exact around every vertex, nothing inverted"),
    ("FLOW", "Flow", "The flow of Hu, Zou and Hua, for comparison: it inverts some tetrahedra"),
)
VOLUME_LIBRARIES = (
    ("TETGEN", "TetGen", "Keeps the surface, which has to be closed and free of crossing faces"),
    ("TETWILD", "fTetWild", "Takes open and crossing surfaces, too, and replaces them by one close by"),
)
VOLUME_RESULTS = (
    ("TETS", "Tetrahedra", "A new object of all tetrahedra, with places in the domain as an attribute"),
    ("SHELLS", "Shells", "New objects that divide the body into parts of equal volume, like the skins of an onion"),
    ("POINTS", "Points", "A new object of points inside, evenly dense"),
    ("SLICE", "Slice", "A new object that cuts the body, coloured by how much the map dilates"),
    ("ATTRIBUTE", "Attribute", "Places in the domain as an attribute of the mesh itself"),
)
AXES = (
    ("X", "X", "Across the X axis"),
    ("Y", "Y", "Across the Y axis"),
    ("Z", "Z", "Across the Z axis"),
)
DEFAULT_TETS = 40_000
