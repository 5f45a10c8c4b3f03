"""The types of attributes of Blender's meshes, and how their values are read and written in bulk."""

from __future__ import annotations

import numpy as np

# Type of an attribute: property of its elements, numbers each, numpy type, and whether values can be interpolated.
TYPES: dict[str, tuple[str, int, type, bool]] = {
    "FLOAT": ("value", 1, np.float32, True),
    "FLOAT2": ("vector", 2, np.float32, True),
    "FLOAT_VECTOR": ("vector", 3, np.float32, True),
    "FLOAT_COLOR": ("color", 4, np.float32, True),
    "BYTE_COLOR": ("color", 4, np.float32, True),
    "QUATERNION": ("value", 4, np.float32, False),
    "FLOAT4X4": ("value", 16, np.float32, False),
    "INT": ("value", 1, np.int32, False),
    "INT8": ("value", 1, np.int32, False),
    "INT16_2D": ("value", 2, np.int32, False),
    "INT32_2D": ("value", 2, np.int32, False),
    "BOOLEAN": ("value", 1, bool, False),
}
