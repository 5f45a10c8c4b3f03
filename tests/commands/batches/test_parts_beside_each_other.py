"""Parts of a batch, and the whole of it, may be at work at the same time: each has files of its own to do, and a
manifest of its own to say so."""

from __future__ import annotations

import pytest

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5\nf 1 2 3\nf 1 3 4\n"
NAMES = [f"{name}.obj" for name in "abcdefghijkl"]


@pytest.mark.parametrize("counts", [(1,), (2,), (3, 1), (1, 2, 3), (5, 4)], ids=str)
def test_parts_that_run_at_once_do_not_meet_and_do_together_what_the_whole_does(package, monkeypatch, tmp_path, counts):
    (tmp_path / "in").mkdir()
    for name in NAMES:
        (tmp_path / "in" / name).write_text(SQUARE)
    parts = [(k, n) for n in counts for k in range(1, n + 1)]
    done, engine = {}, package("batch.engine")

    def carried_out(plan, tasks, manifest, *_):
        """Begin the next part before this one ends."""
        part = parts[len(done)]
        done[part] = [task.name for task in tasks]
        manifest.due(plan, tasks, False)
        begin()
        assert sorted(row["name"] for row in manifest.rows()) == sorted(done[part])
        return engine.BatchResult({"done": len(tasks)}, len(tasks), 0)

    def begin():
        if len(done) < len(parts):
            k, n = parts[len(done)]
            words = ["batch", "seams", tmp_path / "in", "-o", tmp_path / "out", "--part", f"{k}/{n}"]
            assert package("cli").main([str(word) for word in words]) == 0, f"{k}/{n}"

    monkeypatch.setattr(engine, "carry_out", carried_out)
    begin()
    assert list(done) == parts
    for n in counts:
        assert sorted(name for k in range(1, n + 1) for name in done[k, n]) == NAMES
    assert len(package("batch.manifest").found_beside(tmp_path / "out")) == len(parts)
