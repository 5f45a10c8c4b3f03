"""What is decided by a bound of files and what is loaded, on either side of it and on it."""

from __future__ import annotations

import os
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from omt_uv.errors import UserError
from omt_uv.files import verified
from omt_uv.files.in_place import obj_text, plain_obj

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_positions_are_near_within_so_many_of_their_extents(size):
    far = plain_obj.FARTHEST
    for reach, near in ((far, True), (far * (1 + 1e-9), False), (0.5 * far, True)):
        for sign in (1, -1):
            for axis in range(3):
                shift = np.zeros(3)
                # The farthest coordinate is `reach` times the extent, which is 1.
                shift[axis] = sign * (reach - (axis < 2 and sign > 0))
                assert plain_obj._is_near(size * (CORNERS + shift)) == near, (reach, sign, axis)
    assert not plain_obj._is_near(plain_obj.GREATEST * CORNERS)
    assert plain_obj._is_near(np.nextafter(plain_obj.GREATEST, 0) * CORNERS)
    assert not plain_obj._is_near(np.where(CORNERS > 0, np.nan, CORNERS))


# A tetrahedron, all of whose edges are inside.
BODY = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def body(cosine, length=1.0):
    """It with normals of which one has this cosine with the others, at two corners of the second face; the text, and
    the numbers (12,) of normals."""
    lines = ["v 0 0 0", "v 1 0 0", "v 0 1 0", "v 0 0 1", f"vn 0 0 {length:.17g}"]
    lines.append(f"vn {np.sqrt(1 - cosine**2):.17g} 0 {cosine:.17g}")
    named = np.zeros(12, int)
    named[3:5] = 1
    corners = zip(BODY.ravel() + 1, named + 1, strict=True)
    words = [f"{v}//{n}" for v, n in corners]
    lines += [f"f {' '.join(words[k : k + 3])}" for k in (0, 3, 6, 9)]
    return obj_text.read("\n".join(["o one", *lines, ""]).encode()), named


@pytest.mark.parametrize(
    "apart, found",
    [
        (0.0, []),
        (0.5 * plain_obj.SAME, []),
        (2 * plain_obj.SAME, None),
        (0.5 * plain_obj.OTHER, None),
        (1.01 * plain_obj.OTHER, [[0, 1], [0, 3], [1, 3]]),
        (1.0, [[0, 1], [0, 3], [1, 3]]),
        (1.9, [[0, 1], [0, 3], [1, 3]]),
    ],
)
def test_edges_are_sharp_where_normals_are_certainly_apart_at_either_end(apart, found):
    sharp = plain_obj._sharp_edges(*body(1 - apart))
    assert (None if sharp is None else sorted(sharp.tolist())) == found


@pytest.mark.parametrize("length, taken", [(plain_obj.LEAST_NORMAL * 1.01, True), (plain_obj.LEAST_NORMAL, False)])
def test_normals_count_from_their_least_length_on(length, taken):
    assert (plain_obj._sharp_edges(*body(1.0, length)) is not None) == taken


@pytest.mark.parametrize("share", [0.5, 2.0])
@pytest.mark.parametrize("turn", [1, -1])
def test_quads_are_cut_along_the_other_diagonal_where_their_halves_certainly_face_away(share, turn):
    """Of nearly right angles between both halves, none is certain."""
    # The halves meet at the first diagonal: the angle between them is that of their normals.
    cosine = -turn * share * plain_obj.UNDECIDED
    a, c = np.array([0.0, 0, 0]), np.array([2.0, 0, 0])
    b = np.array([1.0, -1, 0])
    d = np.array([1.0, -cosine, np.sqrt(1 - cosine**2)])
    found = plain_obj._triangles(np.array([a, b, c, d]), np.array([0, 4]), np.array([4]))
    if share < 1:
        assert found is None
        return
    left, right = np.cross(b - a, c - a), np.cross(d - a, c - a)
    assert found.tolist() == ([[0, 1, 3], [1, 2, 3]] if left @ right > 0 else [[0, 1, 2], [0, 2, 3]])


@pytest.mark.parametrize("more", [0, 1])
def test_paths_are_as_long_as_blender_holds(monkeypatch, more):
    path = Path("/" + "/".join(["a" * 99] * 4))
    monkeypatch.setattr(verified, "MOST_PATH_BYTES", len(str(path)) - more)
    if more:
        with pytest.raises(
            UserError, match=rf"the path has {len(str(path))} bytes, and Blender holds {len(str(path)) - 1}"
        ):
            verified.check_length(path)
    else:
        verified.check_length(path)


@pytest.mark.parametrize("locks, bound", [(True, "ABANDONED"), (False, "ABANDONED_WITHOUT_LOCKS")])
@pytest.mark.parametrize("over", [-60, 60])
def test_what_is_left_behind_goes_once_it_is_old(tmp_path, monkeypatch, locks, bound, over):
    """Of a process that lives: only its age tells."""
    path = tmp_path / f"{verified.PREFIX}{os.getpid()}_x.obj"
    path.write_bytes(b"")
    age = getattr(verified, bound) + over
    os.utime(path, (path.stat().st_mtime - age,) * 2)
    if not locks:
        monkeypatch.setattr(verified, "fcntl", None)
    assert verified._is_abandoned(path, tmp_path / "none") == (over > 0)


@pytest.mark.parametrize("kind", ["huge", "strange"])
@pytest.mark.parametrize("used", [True, False])
def test_coordinates_that_are_huge_or_none_are_counted_by_vertices(package_of_blender, kind, used):
    loaded, mesh = package_of_blender
    value = np.float32(loaded.HUGE) if kind == "huge" else np.float32(np.nan)
    rows = CORNERS.tolist() + ([] if used else [[5, 5, 5], [6, 6, 6]])
    obj = mesh(rows)
    chosen = (0, 2) if used else (3, 4)
    for v in chosen:
        obj.data.vertices[v].co = (value, value, 0)
    texts = loaded._coordinates(Path("x.blend"), [obj])
    # Exactly that much is none; those that faces need are an error later on.
    assert texts == ([] if kind == "huge" or used else ["2 of its vertices have coordinates beyond single precision, "
                                                        "or none"])  # fmt: skip
    if kind == "huge":
        for v in chosen:
            obj.data.vertices[v].co = (0, -np.nextafter(value, np.float32(np.inf)), 0)
        assert loaded._coordinates(Path("x.blend"), [obj, obj]) == ["4 of its vertices have coordinates above 1e+18"]


@pytest.fixture
def package_of_blender():
    pytest.importorskip("bpy")
    import scenes

    from omt_uv.files import loaded

    return loaded, lambda rows: scenes.add(rows, [(0, 1, 2)])


def test_an_answer_is_of_use_up_to_its_bounds(monkeypatch):
    """A servant goes on below its number of runs, with as much memory as is said, and after what was told."""
    from omt_uv.batch import servant

    for runs, rest, status, goes_on in ((servant.MOST_RUNS - 1, servant.MOST_AT_REST, 0, True),
                                        (servant.MOST_RUNS, 0, 0, False), (1, servant.MOST_AT_REST + 1, 0, False),
                                        (1, 0, servant.FAILURE, True), (1, 0, 5, False)):  # fmt: skip
        one = servant.Servant.__new__(servant.Servant)
        one.start, one.runs, one.folder = (), runs - 1, Path("/nowhere")
        answer = {"status": status, "at_rest": rest, "processor": 1.0, "memory": 2}
        monkeypatch.setattr(one, "_asked", lambda _task, answer=answer: answer, raising=False)
        outcome = one.watch(SimpleNamespace(words=["a"], timeout=0.0))
        assert outcome.status == status and one.usable == goes_on, (runs, rest, status)
