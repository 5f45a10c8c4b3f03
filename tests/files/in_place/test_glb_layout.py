"""Accessors of files that are put together at random are replaced, and every other one keeps its values."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from omt_uv.files.in_place import glb, glb_data, glb_layout
from omt_uv.files.in_place.glb_data import COMPONENTS, WIDTHS, Glb
from omt_uv.files.in_place.imported import InPlaceError

KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}


def random_file(seed, count=6):
    """A file of views with one accessor, a table of two, or none; values by accessor; which views are pictures."""
    rng = np.random.default_rng(seed)
    doc = {"asset": {"version": "2.0"}, "buffers": [{}], "bufferViews": [], "accessors": [], "images": []}
    raw, values = bytearray(), []
    for _ in range(count):
        raw += bytes(-len(raw) % glb_data.ALIGNMENT)
        kind, rows = rng.integers(0, 4), int(rng.integers(1, 9))
        if kind == 0:
            data = rng.integers(0, 256, 13, dtype=np.uint8).tobytes()
            doc["images"].append({"bufferView": len(doc["bufferViews"]), "mimeType": "image/png"})
            doc["bufferViews"].append({"buffer": 0, "byteOffset": len(raw), "byteLength": len(data)})
            raw += data
            continue
        widths = [int(rng.integers(1, 5))] if kind < 3 else [3, 2]
        table = np.concatenate([rng.random((rows, w)).astype(np.float32) for w in widths], axis=1)
        if kind == 2:
            code = int(rng.choice([5121, 5123]))
            table = rng.integers(0, 200, (rows, widths[0])).astype(COMPONENTS[code])
        else:
            code = 5126
        view = {"buffer": 0, "byteOffset": len(raw), "byteLength": table.nbytes}
        if kind == 3:
            view["byteStride"] = 20
        at = 0
        for w in widths:
            of = {"bufferView": len(doc["bufferViews"]), "byteOffset": 4 * at, "componentType": code,
                  "count": rows, "type": KINDS[w], "min": [0] * w, "max": [1] * w}  # fmt: skip
            if code != 5126:
                of["normalized"] = True
            doc["accessors"].append(of)
            values.append(table[:, at : at + w])
            at += w
        doc["bufferViews"].append(view)
        raw += table.tobytes()
    doc["buffers"][0]["byteLength"] = len(raw)
    primitives = [{"attributes": {f"_{k}": k}} for k in range(len(values))]
    doc["meshes"] = [{"primitives": primitives}]
    return Glb(doc, bytes(raw), []), values


def read(glb, index):
    """The values of an accessor by its own words, byte by byte."""
    of = glb.doc["accessors"][index]
    view = glb.doc["bufferViews"][of["bufferView"]]
    kind, width = np.dtype(COMPONENTS[of["componentType"]]), WIDTHS[of["type"]]
    stride = view.get("byteStride", 0) or kind.itemsize * width
    begin = view.get("byteOffset", 0) + of.get("byteOffset", 0)
    rows = [glb.binary[begin + k * stride : begin + k * stride + kind.itemsize * width] for k in range(of["count"])]
    return np.array([np.frombuffer(row, kind) for row in rows])


@pytest.mark.parametrize("code", COMPONENTS)
@pytest.mark.parametrize("beside", [0, 1, 4])
@pytest.mark.parametrize("count", [0, 1, 5])
def test_values_that_end_where_the_file_ends_are_read_and_one_byte_fewer_is_none(code, beside, count):
    """Of every type and width, each alone and in rows with others: what stands behind the last of them may be gone."""
    kind = np.dtype(COMPONENTS[code])
    for (width, name), begin in product(KINDS.items(), (0, 8)):
        size = kind.itemsize * width
        stride = size + beside * kind.itemsize
        raw = np.random.default_rng(width).integers(0, 256, begin + stride * max(count - 1, 0) + size, np.uint8)
        doc = {"buffers": [{}], "bufferViews": [{"byteOffset": begin, "byteStride": stride * bool(beside)}],
               "accessors": [{"bufferView": 0, "componentType": code, "count": count, "type": name}]}  # fmt: skip
        whole = Glb(doc, raw.tobytes(), [])
        found = glb_data.accessor(whole, 0)
        assert found.shape == (count, width) and found.tobytes() == read(whole, 0).tobytes()
        if count:
            with pytest.raises(InPlaceError, match=r"leads out of the file|counts \d+ values"):
                glb_data.accessor(Glb(doc, raw.tobytes()[:-1], []), 0)


def pictures(glb):
    views = [glb.doc["bufferViews"][image["bufferView"]] for image in glb.doc["images"]]
    return [glb.binary[v["byteOffset"] : v["byteOffset"] + v["byteLength"]] for v in views]


@pytest.mark.parametrize("seed", range(25))
def test_what_is_replaced_has_its_values_and_all_else_keeps_them(seed):
    glb, values = random_file(seed)
    rng = np.random.default_rng(100 + seed)
    change = glb_layout.GlbChange(glb)
    assert change.users() == dict.fromkeys(range(len(values)), 1)
    expected, overwritten = dict(enumerate(values)), 0
    for index in rng.permutation(len(values))[:3]:
        old = values[index]
        shorter = rng.random() < 0.5
        new = rng.random((len(old) + (2 if shorter else 0), old.shape[1])).astype(np.float32)
        if change.overwrite(int(index), new):
            overwritten += 1
            assert old.dtype == np.float32 and not shorter
        else:
            like = change.doc["accessors"][int(index)]
            found = change.replace(int(index), new, True, like, glb_layout.ATTRIBUTES)
            assert found == index
            # Floats are what they are.
            assert "normalized" not in change.doc["accessors"][found]
        expected[int(index)] = new
    result = change.result()
    for index, rows in expected.items():
        np.testing.assert_array_equal(read(result, index), rows)
        of = result.doc["accessors"][index]
        if rows is not values[index]:
            assert of["min"] == rows.min(axis=0).tolist() and of["max"] == rows.max(axis=0).tolist()
            assert of["count"] == len(rows)
        # They begin where their components may.
        view = result.doc["bufferViews"][of["bufferView"]]
        size = np.dtype(COMPONENTS[of["componentType"]]).itemsize
        assert (view.get("byteOffset", 0) + of.get("byteOffset", 0)) % size == 0
    assert pictures(result) == pictures(glb)
    assert (
        result.doc["buffers"][0]["byteLength"]
        == len(result.binary)
        == max(v.get("byteOffset", 0) + v["byteLength"] for v in result.doc["bufferViews"])
    )
    # Nothing of what was given is touched.
    for index, rows in enumerate(values):
        np.testing.assert_array_equal(read(glb, index), rows)


@pytest.mark.parametrize("seed", range(8))
def test_no_bytes_of_the_old_are_left_behind(seed):
    """Whoever replaces an accessor again and again by one of the same size has a file as long as before."""
    glb, values = random_file(seed)
    index = max(range(len(values)), key=lambda k: values[k].nbytes)
    sizes = []
    for k in range(4):
        change = glb_layout.GlbChange(glb)
        new = np.full((20, 2), k, np.float32)
        change.replace(index, new, True, change.doc["accessors"][index] | {"type": "VEC2"}, glb_layout.ATTRIBUTES)
        glb = change.result()
        sizes.append(len(glb.binary))
        np.testing.assert_array_equal(read(glb, index), new)
    assert sizes[1] == sizes[2] == sizes[3] <= sizes[0] + glb_data.ALIGNMENT


def test_integers_stay_normalized_and_new_ones_come_at_the_end():
    glb, values = random_file(3)
    (index, *_) = [k for k, v in enumerate(values) if v.dtype != np.float32] or [None]
    assert index is not None
    change = glb_layout.GlbChange(glb)
    like, new = change.doc["accessors"][index], (values[index] + 1).astype(values[index].dtype)
    added = change.replace(index, new, False, like, glb_layout.ATTRIBUTES)
    assert added == len(values) and change.doc["accessors"][added]["normalized"]
    result = change.result()
    np.testing.assert_array_equal(read(result, added), new)
    np.testing.assert_array_equal(read(result, index), values[index])
    view = result.doc["bufferViews"][result.doc["accessors"][added]["bufferView"]]
    # Rows of attributes begin at multiples of four, those of indices one after the other.
    row = new.itemsize * new.shape[1]
    assert view.get("byteStride", row) % 4 == 0 and view["target"] == glb_layout.ATTRIBUTES
    change = glb_layout.GlbChange(glb)
    added = change.replace(None, new, False, like, glb_layout.ELEMENTS)
    view = change.doc["bufferViews"][change.doc["accessors"][added]["bufferView"]]
    assert "byteStride" not in view and view["byteLength"] == new.nbytes


def test_what_others_read_is_not_overwritten():
    table = np.arange(20, dtype=np.float32).reshape(4, 5)
    of = {"bufferView": 0, "componentType": 5126, "count": 4}
    doc = {
        "buffers": [{"byteLength": 80}],
        "bufferViews": [{"buffer": 0, "byteLength": 80, "byteStride": 20}],
        "accessors": [of | {"type": "VEC3"}, of | {"byteOffset": 12, "type": "VEC2"}],
    }
    new = np.zeros((4, 2), np.float32)

    def may(**of):
        glb = Glb({**doc, "accessors": [doc["accessors"][0] | of, doc["accessors"][1]]}, table.tobytes(), [])
        return glb_layout.GlbChange(glb).overwrite(1, new)

    assert may() and not may(type="VEC4") and may(byteOffset=8, type="SCALAR") is not False
    assert not may(byteOffset=12, type="SCALAR") and not may(byteOffset=16, type="SCALAR")
    assert not glb_layout.GlbChange(Glb(doc, table.tobytes(), []), grows=True).overwrite(1, new)
    change = glb_layout.GlbChange(Glb(doc, table.tobytes(), []))
    assert not change.overwrite(1, new[:3]) and change.overwrite(1, new)
    np.testing.assert_array_equal(read(change.result(), 0), table[:, :3])


@pytest.mark.parametrize(
    ("most", "code", "given"), [(65534, 5123, None), (65535, 5123, 5125), (65536, 5123, 5125), (9, 5125, 5125)]
)
def test_numbers_of_vertices_are_as_wide_as_the_largest_takes(most, code, given):
    """Of all primitives together; what was wide stays so, and what keeps its vertices is not written. The largest
    number of two bytes begins a primitive anew, and is no vertex."""
    written = {}

    class Change:
        doc = {"accessors": [{"componentType": code}, {"componentType": code}]}

        def replace(self, index, values, owned, like, target):
            written[index] = (values, owned)
            return index

    corners = np.arange(6).reshape(2, 3)
    parts = [glb.Part({"indices": k}, corners[k], corners[k], None) for k in (0, 1)]
    parts.append(glb.Part({"indices": 1, "mode": 4}, corners[0], corners[0], None))
    new = np.array([[0, 1, 2], [3, 4, most], [0, 1, 2]])
    new[0, 0] = 7
    glb._write_indices(Change(), parts, new.ravel(), {0: 1, 1: 2})
    assert set(written) == {0, 1}
    for k in (0, 1):
        values, owned = written[k]
        assert np.array_equal(values[:, 0], new[k]) and owned == (k == 0)
        assert values.dtype == (np.uint32 if given else np.uint16)


@pytest.mark.parametrize("change", ["another buffer", "a buffer elsewhere"])
def test_values_in_other_files_are_refused(change):
    file, values = random_file(3)
    view = file.doc["accessors"][0]["bufferView"]
    assert np.array_equal(glb_data.accessor(file, 0), values[0])
    if change == "another buffer":
        file.doc["bufferViews"][view]["buffer"] = 1
        file.doc["buffers"].append({"byteLength": 3})
    else:
        file.doc["buffers"][0]["uri"] = "cube.bin"
    with pytest.raises(glb_data.InPlaceError, match="in other files"):
        glb_data.accessor(file, 0)
