"""Zhengyu Su 2015, Optimal Mass Transport and Its Applications: maps between areas and angles, figures 11 and 12.

usage: su_2015.py      writes build/papers/su_2015
"""

from __future__ import annotations

from common import BUILD, models, saved, told

FOLDER = BUILD / "su_2015"
MODELS = ("lion", "snail")
BALANCES = (0.0, 0.25, 0.5, 0.75, 1.0)


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


def main() -> None:
    from omt_uv.display.plots import plot

    rows, curves = sweeps()
    told(FOLDER, "sweeps", rows)
    saved(FOLDER / "sweeps.png", [plot(curves, "mean shear", below="area error")], 480)
    print(f"\nPictures are in {FOLDER}")


if __name__ == "__main__":
    main()
