"""Remember what the last run did, for the panel and for reports of bugs."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Summary:
    """title: the operator; rows: pairs of a name and a value, as the panel shows them."""

    title: str
    rows: tuple[tuple[str, str], ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass
class State:
    summary: Summary | None = None
    error: str = ""
    warnings: list[str] = field(default_factory=list)


state = State()


def figures(readings, texture_size: float, metres: float) -> tuple[tuple[str, str], ...]:
    """Rows about the active UVs of readings; none where there is nothing to measure."""
    from ..pipelines.distortion import ON_SUBDIVISION, measure_readings, on_subdivision
    from ..pipelines.subdivision import evaluated
    from ..pipelines.texel_density import Texels, texel_density
    from ..solver.errors import MeshError

    try:
        place = (("Measured", ON_SUBDIVISION),) if on_subdivision(readings) else ()
        readings = [evaluated(reading) for reading in readings]
        found = measure_readings(readings, overlap=False)
        pixels = texel_density(readings, Texels(texture_size, metres))
    except MeshError:
        return ()
    return (
        *place,
        ("Area error", f"{100 * found.area_l1:.2f} %"),
        ("Shear", f"{found.angle_mean:.3f}"),
        ("Folded faces", f"{found.folds}"),
        ("Islands", f"{found.charts}"),
        ("Texel density", f"{pixels:.4g} px/m"),
    )


def seconds(value: float) -> str:
    return f"{value:.2f} s" if value < 10 else f"{value:.0f} s"
