"""Zhengyu Su 2015, Optimal Mass Transport and Its Applications: maps between areas and angles, figures 11 and 12; and
expressions of faces told apart by their distances, as in figure 23.

usage: su_2015.py [SEED] [bare]      writes build/papers/su_2015; faces of ten people from SEED on, 100 unless it is
said; with `bare` whole heads without markers, too, which takes as long again
"""

from __future__ import annotations

import sys

from common import BUILD, models, saved, told
from heads import EXPRESSIONS, hairline, head, nose, scan, with_expression

FOLDER = BUILD / "su_2015"
MODELS = ("lion", "snail")
BALANCES = (0.0, 0.25, 0.5, 0.75, 1.0)
PEOPLE = 10
NEIGHBOURS = (1, 3, 5, 7)
# Expressions are as strong as people are.
STRENGTHS = (0.9, 1.1)


def sweeps() -> tuple[list[dict], dict[str, list[tuple[float, float]]]]:
    """Rows of the polar factorisation and of the slider, and curves of shear over area error."""
    import meshes

    from omt_uv.solver.mesh.charts import strict_charts
    from omt_uv.solver.mesh.surface import triangle_surface
    from omt_uv.solver.parameterization.chart_map import map_chart
    from omt_uv.solver.parameterization.options import MapOptions
    from omt_uv.solver.progress import drain

    rows: list[dict] = []
    curves: dict[str, list[tuple[float, float]]] = {}
    for name in models(MODELS):
        (chart,) = strict_charts(triangle_surface(*meshes.load_model(name)))
        for balance in BALANCES:
            row: dict = {"model": name, "balance": balance}
            for kind, title in (("polar", "polar"), ("authalic", "slider")):
                found = drain(map_chart(chart, options=MapOptions(boundary="disk", kind=kind, balance=balance)))
                row |= {f"{title}: area error": found.area_l1, f"{title}: shear": found.angle_mean}
                curves.setdefault(f"{name}, {title}", []).append((found.area_l1, found.angle_mean))
            rows.append(row)
    return rows, curves


def expressions(first: int, bare: bool) -> None:
    """Scans, and whole heads, of ten people with three expressions each: how often neighbours tell the expression, of
    all and of those of others; the matrix and the map of the scans. Bare: of whole heads without markers, too."""
    import numpy as np

    from omt_uv.display.distance_plots import map_picture, matrix_picture
    from omt_uv.solver.signatures.embedding import classical_scaling
    from omt_uv.solver.signatures.marked import marked_signature
    from omt_uv.solver.signatures.signature import signature

    of = [(person, kind) for person in range(first, first + PEOPLE) for kind in EXPRESSIONS]
    faces = []
    for person, kind in of:
        V, F = head(person)
        strength = np.random.default_rng(person).uniform(*STRENGTHS)
        faces.append((with_expression(V, kind, strength), F))
    people, kinds = (np.array(column) for column in zip(*of, strict=True))
    whole = _distances([marked_signature(V, F, nose(V), hairline(V)) for V, F in faces])
    away = _distances([marked_signature(*scan(V, F)) for V, F in faces])
    rows = [*_told_by(whole, "whole heads", people, kinds), *_told_by(away, "scans", people, kinds)]
    if bare:
        free = _distances([signature(V, F) for V, F in faces])
        rows += _told_by(free, "whole heads without markers", people, kinds)
    told(FOLDER, f"expressions {first}", rows)
    pictures = [matrix_picture(away, list(kinds)), map_picture(classical_scaling(away), people.tolist(), list(kinds))]
    saved(FOLDER / "faces.png", pictures, 600, colours=0)


def _distances(steps: list):
    """Distances (n,n) of the signatures that these solvers make."""
    import numpy as np

    from omt_uv.solver.progress import drain
    from omt_uv.solver.signatures.wasserstein import distance_of, prepared

    found = [prepared(drain(one)) for one in steps]
    away = np.zeros((len(found), len(found)))
    for i, a in enumerate(found):
        for j in range(i):
            away[i, j] = away[j, i] = distance_of(a, found[j]).raw
    return away


def _told_by(away, what: str, people, kinds) -> list[dict]:
    """How often neighbours tell the class, of distances (n,n) and of those of others."""
    import numpy as np

    from omt_uv.solver.signatures.embedding import classes_of_nearest

    others = np.where(people[:, None] == people, np.inf, away)
    rows = []
    for name, matrix in ((what, away), (f"{what}, of others", others)):
        shares = {
            f"{k} nearest": float(np.mean(np.array(classes_of_nearest(matrix, kinds, k)) == kinds)) for k in NEIGHBOURS
        }
        rows.append({"of": name, **shares})
    return rows


def main() -> None:
    from omt_uv.display.plots import plot

    words = sys.argv[1:]
    seeds = [int(word) for word in words if word != "bare"]
    expressions(seeds[0] if seeds else 100, "bare" in words)
    rows, curves = sweeps()
    told(FOLDER, "sweeps", rows)
    saved(FOLDER / "sweeps.png", [plot(curves, "mean shear", below="area error")], 480)
    print(f"\nPictures are in {FOLDER}")


if __name__ == "__main__":
    main()
