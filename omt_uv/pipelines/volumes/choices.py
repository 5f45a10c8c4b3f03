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
