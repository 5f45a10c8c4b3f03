"""The sections of one operator each: a painted region magnified, weights, a new mesh, a globe."""

from __future__ import annotations

from .section import operator_section

MAGNIFY = operator_section("magnify", "Magnify", "uv.omt_magnify", "VIEWZOOM")
WEIGHTS = operator_section("weights", "Weights", "object.omt_weights", "MOD_VERTEX_WEIGHT", parent="magnify")
REMESH = operator_section("remesh", "Remesh", "object.omt_remesh", "MOD_REMESH")
SPHERE = operator_section("sphere", "Sphere", "uv.omt_sphere", "WORLD")
