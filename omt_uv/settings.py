"""What a user can choose, in one place for the operator, the panels and the command line."""

from __future__ import annotations

from dataclasses import dataclass

# identifier, label, description; the solver and the command line use the identifier in lower case.
BOUNDARIES = (
    ("DISK", "Disk", "The boundary of every chart becomes a circle"),
    ("SQUARE", "Square", "The boundary of every chart becomes a square"),
)
DEFAULT_BOUNDARY = "DISK"
DEFAULT_MARGIN = 4
DEFAULT_TEXTURE_SIZE = 1024


@dataclass(frozen=True)
class Settings:
    """How to unwrap: `boundary` in lower case, `margin` in pixels of a texture `texture_size` pixels wide."""

    boundary: str = DEFAULT_BOUNDARY.lower()
    margin: float = DEFAULT_MARGIN
    texture_size: int = DEFAULT_TEXTURE_SIZE
    pack: bool = True

    def solver_arguments(self) -> dict:
        """Keyword arguments of `solver.parameterize.unwrap`."""
        return {"boundary": self.boundary}
