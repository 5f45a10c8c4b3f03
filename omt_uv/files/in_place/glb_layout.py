"""Replace accessors of a binary glTF file by others, without a byte of the old ones left behind."""

from __future__ import annotations

import json
from collections.abc import Iterator

import numpy as np

from .glb_data import ALIGNMENT, COMPONENTS, WIDTHS, Glb, accessor, mentions

CODES = {np.dtype(kind).str: code for code, kind in COMPONENTS.items()}
# What buffer views say that they hold: attributes of vertices, or indices of these.
ATTRIBUTES = 34962
ELEMENTS = 34963


class GlbChange:
    """The accessors of a file as they change: its JSON is changed in place, its bytes at the end, by `result`."""

    def __init__(self, glb: Glb, grows: bool = False):
        self.glb = Glb(json.loads(json.dumps(glb.doc)), glb.binary, glb.others)
        self._grows = grows
        self.doc = self.glb.doc
        self._written: dict[int, bytes] = {}
        self._left: set[int] = set()
        self._patches: list[tuple[int, int, np.ndarray]] = []

    def users(self) -> dict[int, int]:
        """How often primitives name each accessor."""
        count: dict[int, int] = {}
        for mesh in self.doc.get("meshes", []):
            for primitive in mesh["primitives"]:
                for index in named(primitive):
                    count[index] = count.get(index, 0) + 1
        return count

    def overwrite(self, index: int, values: np.ndarray) -> bool:
        """Write values where an accessor has them, if they are as many floats, and no other accessor reads there."""
        of = self.doc["accessors"][index]
        if self._grows:
            return False
        if COMPONENTS[of["componentType"]] != values.dtype.str or "sparse" in of or "bufferView" not in of:
            return False
        if of["count"] != len(values) or not self._is_alone(index):
            return False
        view = self.doc["bufferViews"][of["bufferView"]]
        stride = view.get("byteStride", 0) or values.dtype.itemsize * values.shape[1]
        self._patches.append((view.get("byteOffset", 0) + of.get("byteOffset", 0), stride, values))
        _set_bounds(of, values)
        return True

    def _is_alone(self, index: int) -> bool:
        """Whether no other accessor or view reads the bytes of an accessor, as far as that is easily told."""
        of = self.doc["accessors"][index]
        size = 4 * WIDTHS[of["type"]]
        for k, other in enumerate(self.doc["accessors"]):
            if k == index or other.get("bufferView") != of["bufferView"]:
                continue
            stride = self.doc["bufferViews"][of["bufferView"]].get("byteStride", 0)
            here, there = of.get("byteOffset", 0), other.get("byteOffset", 0)
            width = WIDTHS[other["type"]] * np.dtype(COMPONENTS[other["componentType"]]).itemsize
            if stride:
                # Columns of one table of vertices.
                a, b = here % stride, there % stride
                if a < b + width and b < a + size:
                    return False
            elif here < there + width * other["count"] and there < here + size * of["count"]:
                return False
        begin, end = self._span(of["bufferView"])
        spans = [self._span(k) for k in range(len(self.doc["bufferViews"])) if k != of["bufferView"]]
        return not any(a < end and begin < b for a, b in spans)

    def _span(self, view: int) -> tuple[int, int]:
        """Where a view of the file's own bytes begins and ends."""
        of = self.doc["bufferViews"][view]
        if of.get("buffer", 0) != 0:
            return 0, 0
        return of.get("byteOffset", 0), of.get("byteOffset", 0) + of["byteLength"]

    def replace(self, index: int | None, values: np.ndarray, owned: bool, like: dict, target: int) -> int:
        """Store values (k,width) as an accessor, in the place of one that nothing else names, and return its index."""
        row = values.dtype.itemsize * values.shape[1]
        # Attributes of vertices begin at multiples of 4.
        stride = row + -row % 4 if target == ATTRIBUTES else row
        raw = np.zeros((len(values), stride), np.uint8)
        raw[:, :row] = np.ascontiguousarray(values).view(np.uint8).reshape(len(values), row)
        view = {"buffer": 0, "byteLength": raw.size, "target": target}
        if stride != row:
            view["byteStride"] = stride
        of = {k: v for k, v in like.items() if k not in ("bufferView", "byteOffset", "sparse", "min", "max")}
        of |= {"bufferView": self._view(index if owned else None, view, raw.tobytes())}
        of |= {"componentType": CODES[values.dtype.str], "count": len(values)}
        if of["componentType"] == 5126:
            of.pop("normalized", None)
        if "min" in like or "max" in like:
            of |= {"min": [], "max": []}
            _set_bounds(of, values)
        if owned and index is not None:
            self.doc["accessors"][index] = of
            return index
        self.doc["accessors"].append(of)
        return len(self.doc["accessors"]) - 1

    def _view(self, index: int | None, view: dict, raw: bytes) -> int:
        """The index of a new view, which is that of one that nothing needs any more, if there is one."""
        views = self.doc["bufferViews"]
        if index is not None:
            old = self.doc["accessors"][index]
            self.doc["accessors"][index] = {}
            mentioned = set(mentions(self.doc))
            sparse = old.get("sparse", {})
            named = (old, sparse.get("indices", {}), sparse.get("values", {}))
            gone = {of["bufferView"] for of in named if "bufferView" in of} - mentioned - self._written.keys()
            self._left |= {k for k in gone if views[k].get("buffer", 0) == 0}
        free = sorted(self._left - self._written.keys())
        place = free[0] if free else len(views)
        self._written[place] = raw
        if place == len(views):
            views.append(view)
        else:
            # Kept until `result` has cut its bytes.
            views[place] = view | {"_old": (*self._span(place),)}
        return place

    def result(self) -> Glb:
        """The file with everything that was overwritten and replaced."""
        binary = bytearray(self.glb.binary)
        for at, stride, values in self._patches:
            rows: np.ndarray = np.ndarray(values.shape, values.dtype, binary, at, (stride, values.dtype.itemsize))
            rows[:] = values
        views = self.doc["bufferViews"]
        gone = [views[k].pop("_old", None) for k in self._written]
        gone += [self._span(k) for k in self._left - self._written.keys()]
        kept = [k for k in range(len(views)) if k not in self._written and views[k].get("buffer", 0) == 0]
        dead = np.zeros(len(binary) + 1, bool)
        for span in filter(None, [] if self._grows else gone):
            dead[span[0] : span[1]] = True
        for k in kept:
            begin, end = self._span(k)
            dead[begin:end] = False
        whole = len(binary) // ALIGNMENT * ALIGNMENT
        dead[:whole] = np.repeat(dead[:whole].reshape(-1, ALIGNMENT).all(axis=1), ALIGNMENT)
        dead[whole:] = False
        before = np.cumsum(dead)
        for k in kept:
            begin, _ = self._span(k)
            if before[begin]:
                views[k]["byteOffset"] = int(begin - before[begin] + dead[begin])
        out = bytearray(np.frombuffer(binary, np.uint8)[~dead[:-1]].tobytes())
        for k, raw in sorted(self._written.items()):
            out += bytes(-len(out) % ALIGNMENT)
            views[k]["byteOffset"] = len(out)
            out += raw
        if self._written:
            self.doc["buffers"][0]["byteLength"] = len(out)
        return Glb(self.doc, bytes(out), self.glb.others)


def named(primitive: dict) -> Iterator[int]:
    """Accessors that a primitive names."""
    yield from primitive["attributes"].values()
    for target in primitive.get("targets", []):
        yield from target.values()
    if "indices" in primitive:
        yield primitive["indices"]


def _set_bounds(of: dict, values: np.ndarray) -> None:
    """Set the bounds of an accessor that has some."""
    for name, bound in (("min", values.min), ("max", values.max)):
        if name in of and len(values):
            of[name] = bound(axis=0).tolist()


def rows_of(glb: Glb, index: int) -> np.ndarray:
    """Values of an accessor, copied."""
    return np.array(accessor(glb, index))
