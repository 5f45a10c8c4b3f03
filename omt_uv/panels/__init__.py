"""Menus, the sidebar's tab and the preferences: they draw, and run nothing themselves.

Imports operators, session, display and blender.
Main names: OMTUVPreferences, Section, TabPanel, draw_menu.
"""

from ..solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    menus="draw_menu",
    preferences="OMTUVPreferences",
    section="Section operator_section",
    sidebar="MainPanel TabPanel",
)
