"""What a user chooses of a match, for operators and commands."""

from __future__ import annotations

DEFAULT_PREFIX = "LM_"
MATCH_MODES = (
    ("TRANSFER", "Transfer", "What the selected object carries, UV maps, groups, shape keys, onto the active one"),
    ("WRAP", "Wrap", "A shape key of the selected object in the shape of the active one"),
    ("MORPH", "Morph", "The same shape key, part of the way"),
    ("CHECKER", "Checker", "Colours on both objects that show what corresponds"),
)
MATCH_DOMAINS = (
    ("AUTO", "Automatic", "The disk where both are open by more than a small hole, the sphere otherwise"),
    ("SPHERE", "Sphere", "All holes are closed for the match"),
    ("DISK", "Disk", "Both keep their longest boundary, which slides along the other"),
    ("CHARTS", "Charts Cut Alike", "Any topology: seams cut both into disks that correspond, and go onto one another"),
)
# What can be transferred, by the words of the command line.
TRANSFERS = (
    ("UV", "UV Maps", "UV maps, and seams where their islands end"),
    ("GROUPS", "Vertex Groups", "Weights, as those of a rig"),
    ("COLOURS", "Colours", "Colour attributes"),
    ("SHAPE_KEYS", "Shape Keys", "Shape keys, turned as the surface is"),
    ("FACE_SETS", "Face Sets", "Face sets of Sculpt Mode"),
    ("MATERIALS", "Materials", "Materials, face by face"),
    ("ATTRIBUTES", "Attributes", "Other attributes of vertices, corners and faces"),
)
DEFAULT_TRANSFERS = ("UV", "GROUPS", "COLOURS", "SHAPE_KEYS", "FACE_SETS", "MATERIALS")
