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
DEFAULT_BOUNDARY = "FREE"
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
    """

    boundary: str = DEFAULT_BOUNDARY.lower()
    quality: str = DEFAULT_QUALITY.lower()
    balance: float = DEFAULT_BALANCE
    margin: float = DEFAULT_MARGIN
    texture_size: int = DEFAULT_TEXTURE_SIZE
    pack: bool = True

    def solver_arguments(self) -> dict:
        """Keyword arguments of `solver.parameterize.unwrap`."""
        return {"boundary": self.boundary, "quality": self.quality, "balance": self.balance}


@dataclass(frozen=True)
class RefineSettings(Settings):
    """How to refine existing UVs; the boundary is free.

    keep_boundary : the outline of every island stays exactly as it is; pack : arrange the islands anew
    """

    pack: bool = False
    keep_boundary: bool = False
