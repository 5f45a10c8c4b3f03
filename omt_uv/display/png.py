"""Pictures as the bytes of PNG files, small, and without an image data-block."""

from __future__ import annotations

import struct
import zlib

import numpy as np

SIGNATURE = b"\x89PNG\r\n\x1a\n"
# Of the format: eight bits of each of red, green, blue; rows as differences from the row above.
DEPTH = 8
RGB = 2
UP = 2


def png_bytes(picture: np.ndarray) -> bytes:
    """A picture (h,w,3) in [0,1], top row first, as a PNG file (ISO/IEC 15948)."""
    pixels = np.round(np.clip(picture, 0, 1) * 255).astype(np.uint8)
    height, width = pixels.shape[:2]
    rows = pixels.reshape(height, 3 * width)
    above = np.vstack([np.zeros((1, 3 * width), np.uint8), rows[:-1]])
    lines = np.hstack([np.full((height, 1), UP, np.uint8), rows - above])
    header = struct.pack(">IIBBBBB", width, height, DEPTH, RGB, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(lines.tobytes(), 9)), (b"IEND", b""))
    return SIGNATURE + b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)) for name, data in chunks
    )
