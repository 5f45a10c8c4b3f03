"""The section that matches one object with another: landmarks, the match, and the strain of shapes."""

from __future__ import annotations

import bpy

from .section import Section, big_button, class_of, draw_settings, settings_of

MATCH = "object.omt_match"
LANDMARKS = ("object.omt_landmarks", "object.omt_landmarks_suggest", "object.omt_landmarks_clear")
STRAIN = "object.omt_strain"
SIMILAR = "object.omt_similar"


def _draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    row = layout.row(align=True)
    settings = settings_of(context, MATCH)
    for operator, text in zip(LANDMARKS, ("Landmarks", "Suggest", "Clear"), strict=True):
        if class_of(operator) is not None:
            button = row.operator(operator, text=text)
            # Without a prefix, which stands for no landmarks, the button sets those of the last time.
            if settings.landmark_prefix:
                button.prefix = settings.landmark_prefix
    draw_settings(layout.column(), MATCH, settings)
    big_button(layout, MATCH, "MOD_DATA_TRANSFER")
    if class_of(STRAIN) is not None:
        layout.operator(STRAIN, icon="MOD_SIMPLEDEFORM")
    if class_of(SIMILAR) is not None:
        layout.operator(SIMILAR, icon="VIEWZOOM")


SECTION = Section("match", "Match", _draw, (MATCH,))
