"""The section of cells of equal area."""

from __future__ import annotations

from .section import operator_section

SECTION = operator_section("partition", "Partition", "mesh.omt_partition", "MESH_ICOSPHERE")
