"""What a user can choose, in one place for the operator, the panels and the command line."""

from __future__ import annotations

from dataclasses import dataclass

# identifier, label, description; the solver and the command line use the identifier in lower case.
BOUNDARIES = (
    ("FREE", "Free", "The outline follows from the surface: the least shear"),
    ("DISK", "Disk", "Every island becomes a disk"),
    ("SQUARE", "Square", "Every island becomes a square"),
)
QUALITIES = (
    ("DRAFT", "Draft", "Fast; areas a few percent off where the surface is hard to flatten"),
    ("STANDARD", "Standard", "Areas right to within about one percent of the texture"),
    ("EXACT", "Exact", "Areas right to about a tenth of a percent of the texture; several times slower"),
)
SEAMS = (
    (
        "AUTO",
        "Auto",
        "Islands follow the seams; what they leave closed, ringed or knotted is cut open along short paths",
    ),
    ("EXISTING", "Existing", "Islands follow the seams alone; what they do not open into a disk is refused"),
    ("CHARTS", "Charts", "Many islands of little distortion, inside those that the seams make"),
)
DEFAULT_BOUNDARY = "FREE"
DEFAULT_SEAMS = "AUTO"
DEFAULT_QUALITY = "STANDARD"
DEFAULT_BALANCE = 0.0
DEFAULT_MARGIN = 4
DEFAULT_TEXTURE_SIZE = 1024


@dataclass(frozen=True)
class Settings:
    """How to unwrap.

    boundary, quality : an identifier of the lists above in lower case
    balance : from 0, exact areas, to 1, least shear
    margin : pixels of a texture `texture_size` pixels wide; pack : arrange the islands in the unit square
    seams : an identifier of the list above in lower case; fill_holes : take all boundaries of a part but the longest
        for filled; max_shear : cut islands further until their mean shear is below, 0 for no such cuts
    """

    boundary: str = DEFAULT_BOUNDARY.lower()
    quality: str = DEFAULT_QUALITY.lower()
    balance: float = DEFAULT_BALANCE
    margin: float = DEFAULT_MARGIN
    texture_size: int = DEFAULT_TEXTURE_SIZE
    pack: bool = True
    seams: str = DEFAULT_SEAMS.lower()
    fill_holes: bool = False
    max_shear: float = 0.0

    def solver_arguments(self) -> dict:
        """How to map a chart: keyword arguments of `solver.parameterize.unwrap_chart`."""
        return {"boundary": self.boundary, "quality": self.quality, "balance": self.balance}

    def preparation_arguments(self) -> dict:
        """How to make charts: keyword arguments of `solver.preparation.prepare`."""
        return {"seams": "existing" if self.seams == "existing" else "auto", "fill_holes": self.fill_holes}


@dataclass(frozen=True)
class RefineSettings(Settings):
    """How to refine existing UVs; the boundary is free.

    keep_boundary : the outline of every island stays exactly as it is; pack : arrange the islands anew
    """

    pack: bool = False
    keep_boundary: bool = False
