"""OMT UV: area-preserving unwrapping by conformal maps and optimal mass transport."""

__version__ = "0.1.0"
