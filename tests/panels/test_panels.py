"""Panels and menus draw what exists. There is no window here, so a recording layout stands in for Blender's."""

from __future__ import annotations

import types
import urllib.request
from pathlib import Path

import bpy

import numpy as np
import pytest
import scenes

ROOT = Path(__file__).resolve().parents[2]


# Sections without a button of their own: settings of the one that they stand in.
SETTINGS_ALONE = {"more", "magnify_more", "magnify_image"}


class Layout:
    """Takes every call that the panels make, and checks names against the operators."""

    def __init__(self, record):
        self.record = record

    def column(self, **_):
        return Layout(self.record)

    row = split = box = column

    def separator(self, **_):
        pass

    def label(self, text="", **_):
        self.record.append(f"label {text}")

    def progress(self, factor, text):
        assert 0 <= factor <= 1
        self.record.append(f"progress {text}")

    def template_icon(self, icon_value, scale):
        self.record.append("icon")

    def template_list(self, name, _, data, listed, chosen, active, **_more):
        assert hasattr(bpy.types, name) and {listed, active} <= set(data.bl_rna.properties.keys()) and data == chosen
        for item in getattr(data, listed):
            getattr(bpy.types, name).draw_item(None, bpy.context, self, data, item, 0, chosen, active)

    ui_units_x = 0

    def prop(self, data, name, **_):
        assert name in data.bl_rna.properties, name
        self.record.append(name)

    def prop_search(self, data, name, owner, collection, **_):
        assert hasattr(owner, collection)
        self.prop(data, name)

    def menu(self, name, **_):
        assert hasattr(bpy.types, name), name
        self.record.append(name)

    emboss = operator_context = ""

    def operator(self, name, **_):
        group, verb = name.split(".")
        if name == "wm.url_open":
            return types.SimpleNamespace()
        assert verb in dir(getattr(bpy.ops, group)), name
        self.record.append(name)
        return types.SimpleNamespace()


def settings_of(name):
    properties = bpy.context.window_manager.operator_properties_last(name).bl_rna.properties
    return {p.identifier for p in properties if not p.is_readonly} - {"rna_type"}


def our_classes(package, base):
    return [cls for cls in package("registration").CLASSES if issubclass(cls, base)]


def draw(panel):
    """What a panel draws, None where it is not shown."""
    record = []
    if hasattr(panel, "poll") and not panel.poll(bpy.context):
        return None
    stand_in = types.SimpleNamespace(layout=Layout(record), section=getattr(panel, "section", None))
    for method in ("draw_header_preset", "draw"):
        if method in dir(panel):
            getattr(panel, method)(stand_in, bpy.context)
    return record


@pytest.fixture(params=["EMPTY", "OBJECT", "EDIT", "SCULPT"])
def mode(request):
    """Panels are drawn in every mode, and without an object."""
    if request.param != "EMPTY":
        scenes.bump()
        bpy.ops.object.mode_set(mode=request.param)


@pytest.mark.parametrize("prefix", ["VIEW3D", "IMAGE"])
def test_the_tab_shows_every_setting_of_every_operator(package, prefix, mode):
    drawn = {}
    for panel in our_classes(package, bpy.types.Panel):
        if panel.bl_idname.startswith(prefix):
            assert panel.bl_category == "OMT"
            drawn[panel.bl_idname.removeprefix(f"{prefix}_PT_omt_uv")] = draw(panel)
    assert set(drawn[""]) | set(drawn["_more"]) >= settings_of("uv.omt_unwrap") | {"uv.omt_unwrap"}
    for section in package("panels.sidebar").SECTIONS:
        panel = drawn[f"_{section.name}" if section.name else ""]
        if panel is None:
            assert not any(map(package("panels.section").class_of, section.operators))
        else:
            assert section.name in SETTINGS_ALONE or set(section.operators) <= set(panel)
            assert panel
    magnify = {entry for name in ("magnify", "magnify_more", "magnify_image") for entry in drawn[f"_{name}"] or ()}
    assert not drawn["_magnify"] or magnify >= settings_of("uv.omt_magnify") - {"attribute", "further"}
    assert {"density", "scope", "uv.omt_density_get"} <= set(drawn["_density"])


def test_every_section_stands_behind_the_one_that_it_is_part_of(package):
    """In the order of use, in both editors."""
    sections = package("panels.sidebar").SECTIONS
    names = [section.name for section in sections]
    assert len(set(names)) == len(names)
    for k, section in enumerate(sections):
        assert section.parent is None or section.parent in names[:k]
    tops = [section.title for section in sections if section.parent is None]
    order = ["OMT UV", "Inspect", "Magnify", "Remesh", "Sphere"]
    assert [title for title in tops if title in order] == order
    for panel in our_classes(package, bpy.types.Panel):
        assert panel.bl_order == names.index(panel.section.name)


@pytest.mark.parametrize("name", ["unwrap", "refine", "seams"])
def test_redo_panels_show_every_setting_once(package, name):
    record = []
    properties = bpy.context.window_manager.operator_properties_last(f"uv.omt_{name}")
    package(f"operators.{name}").draw_settings(Layout(record), properties)
    assert sorted(record) == sorted(settings_of(f"uv.omt_{name}"))


@pytest.mark.parametrize(
    ("operator", "module"),
    [("object.omt_remesh", "remesh"), ("uv.omt_sphere", "sphere"), ("uv.omt_magnify", "magnify")],
)
def test_settings_that_count_for_some_choices_only_come_with_them(package, operator, module):
    """Each at most once at a time, and each for some choice of one of the others."""
    properties = bpy.context.window_manager.operator_properties_last(operator)
    switches = [
        (
            p.identifier,
            p.enum_items.keys() if p.type == "ENUM" else {"BOOLEAN": [False, True], "STRING": ["", "A"]}[p.type],
        )
        for p in properties.bl_rna.properties
        if p.type in ("ENUM", "BOOLEAN", "STRING") and p.identifier in settings_of(operator)
    ]
    switches += [("levels", [1, 3])] if module == "remesh" else []
    # The tab has a list of the object's in its place.
    seen = {"further"} & settings_of(operator)
    for name, values in switches:
        for value in values:
            setattr(properties, name, value)
            record = []
            package(f"operators.{module}").draw_settings(Layout(record), properties)
            assert len(record) == len(set(record))
            seen |= set(record)
        properties.property_unset(name)
    assert seen == settings_of(operator)


def test_the_list_of_further_regions_is_that_of_the_object(package):
    obj = scenes.bump()
    properties = bpy.context.window_manager.operator_properties_last("uv.omt_magnify")
    draw_settings = package("operators.magnify").draw_settings
    record = []
    draw_settings(Layout(record), properties, listed=False)
    assert "further" in record and "uv.omt_region_add" not in record
    for group in ("eyes", "gone"):
        obj.omt_uv_regions.rows.add().group = group
    obj.vertex_groups.new(name="eyes")
    record = []
    draw_settings(Layout(record), properties)
    assert "further" not in record and {"uv.omt_region_add", "uv.omt_region_remove"} < set(record)
    assert record.count("group") == 2 and record.count("factor") == 3
    # One that is there is chosen from the groups, one that is not stays as it is written.
    searched = []
    layout = Layout([])
    layout.prop_search = lambda item, *_, **__: searched.append(item.group)
    layout.column = layout.row = lambda **_: layout
    for item in obj.omt_uv_regions.rows:
        bpy.types.UV_UL_omt_regions.draw_item(None, bpy.context, layout, None, item, 0, None, "")
    assert searched == ["eyes"]


def test_a_group_about_to_be_made_is_no_search_that_finds_nothing(package):
    """Blender shows that in red, as if it were wrong; a group that is there can be chosen from a list."""
    obj = scenes.bump()
    drawn = []

    class Recorder(Layout):
        def prop(self, data, name, **_):
            drawn.append(("field", name))

        def prop_search(self, data, name, owner, collection, **_):
            drawn.append(("search", name))

    properties = bpy.context.window_manager.operator_properties_last("object.omt_weights")
    package("operators.regions.weights").draw_settings(Recorder([]), properties)
    assert properties.weight_group and ("field", "weight_group") in drawn
    obj.vertex_groups.new(name=properties.weight_group)
    package("operators.regions.weights").draw_settings(Recorder([]), properties)
    assert ("search", "weight_group") in drawn


@pytest.mark.parametrize(("group", "kind"), [("eyes", "search"), ("", "search"), ("gone", "field")])
def test_a_region_without_its_group_keeps_the_name(package, group, kind):
    """A search would lose a name that no group has; where there is none, or it is one of them, it is chosen."""
    obj = scenes.bump()
    obj.vertex_groups.new(name="eyes")
    obj.omt_uv_regions.rows.add().group = group
    drawn = []

    class Recorder(Layout):
        def column(self, **_):
            return self

        row = column

        def prop(self, data, name, **_):
            drawn.append(("field", name))

        def prop_search(self, data, name, owner, collection, **_):
            drawn.append(("search", name))

    (item,) = obj.omt_uv_regions.rows
    package("panels.tools").UV_UL_omt_regions.draw_item(None, bpy.context, Recorder([]), obj, item, 0, obj, "")
    assert drawn == [(kind, "group"), ("field", "factor")]


def test_settings_of_an_operator_that_draws_none_stand_one_below_the_other(package, monkeypatch):
    section = package("panels.section")
    module = package("operators.unwrap")
    monkeypatch.delattr(module, "draw_settings")
    properties = bpy.context.window_manager.operator_properties_last("uv.omt_unwrap")
    record = []
    section.draw_settings(Layout(record), "uv.omt_unwrap", properties)
    shown = [p.identifier for p in properties.bl_rna.properties if p.identifier != "rna_type" and not p.is_hidden]
    assert record == shown and len(shown) > 5


def test_strategies_have_plain_words(package):
    for operator, name in (("object.omt_remesh", "strategy"), ("uv.omt_unwrap", "kind")):
        properties = bpy.context.window_manager.operator_properties_last(operator).bl_rna.properties
        assert not any(item.name.isupper() or "-" in item.name for item in properties[name].enum_items)


def test_the_bar_of_colours_says_what_they_mean(package, monkeypatch):
    overlay, inspect = package("display.overlay"), package("panels.inspect")
    for kind, ends in package("display.colour_bar").ENDS.items():
        monkeypatch.setattr(overlay, "kind", lambda kind=kind: kind)
        record = []
        inspect.draw(Layout(record), bpy.context)
        assert {f"label {end}" for end in ends} <= set(record)


def test_the_result_of_the_last_run_is_shown(package):
    scenes.bump()
    bpy.ops.uv.omt_unwrap()
    (main,) = (p for p in our_classes(package, bpy.types.Panel) if p.bl_idname == "VIEW3D_PT_omt_uv_result")
    labels = [entry.removeprefix("label ") for entry in draw(main) if entry.startswith("label ")]
    assert "Unwrap Area Preserving" in labels
    for name in ("Area error", "Shear", "Folded faces", "Texel density"):
        assert labels[labels.index(name) + 1][0].isdigit()
    assert labels[labels.index("Unwrap Area Preserving") + 1].endswith(" s") and "Bump" in labels


def test_the_result_is_as_high_whatever_it_says(package):
    """Nothing below it moves: as many lines before the first run, after one, with warnings, after a refusal."""
    (main,) = (p for p in our_classes(package, bpy.types.Panel) if p.bl_idname == "VIEW3D_PT_omt_uv_result")
    state, last_run = package("session.last_run").state, package("session.last_run")

    def lines():
        return sum(entry.startswith("label ") for entry in draw(main)) + ("uv.omt_remedy" in draw(main))

    last_run.forget()
    high = lines()
    scenes.bump()
    bpy.ops.uv.omt_unwrap()
    assert lines() == high
    notices = tuple(last_run.Notice("far too long to fit into a line " * k, "MERGE") for k in (2, 9))
    last_run.keep(last_run.Summary("Unwrap", (("Area error", "3 %"),), notices, ("Bump",)))
    for state.shown in (0, 1):
        assert lines() == high and "uv.omt_remedy" in draw(main)
    scenes.select([])
    scenes.error_of(bpy.ops.uv.omt_unwrap)
    assert state.summary.refused and lines() == high
    state.outdated = "the mesh has changed"
    assert lines() == high and "uv.omt_measure" in draw(main)


def test_the_result_names_its_object_or_how_many(package):
    about, summary = package("panels.result").about, package("session.last_run").Summary
    assert about(summary("Unwrap", objects=("Head",))) == "Head"
    assert about(summary("Unwrap", objects=tuple("ABCDE"))) == "5 objects" and about(summary("Unwrap")) == ""


def test_a_run_shows_its_progress(package):
    scenes.bump(20, 20)
    operator = scenes.stand_in("uv.omt_unwrap")
    running = package("session.run")
    (main,) = (p for p in our_classes(package, bpy.types.Panel) if p.bl_idname == "VIEW3D_PT_omt_uv")
    assert operator.begin(bpy.context) == {"RUNNING_MODAL"} or running.current is None
    if running.current is not None:
        record = draw(main)
        assert any(entry.startswith(("progress ", "label Charts")) for entry in record)
        assert "uv.omt_unwrap" not in record
        operator.cancel(bpy.context)


def test_every_operator_is_in_the_one_submenu(package):
    record = []
    menus = package("panels.menus")
    stand_in = types.SimpleNamespace(layout=Layout(record))
    menus.UV_MT_omt.draw(stand_in, bpy.context)
    hidden = {
        "uv.omt_preset",
        "wm.omt_copy_report",
        "wm.omt_help",
        "uv.omt_remedy",
        "uv.omt_notices",
        "uv.omt_live_end",
        "uv.omt_queue_stop",
        "uv.omt_region_add",
        "uv.omt_region_remove",
    }
    names = {scenes.name_of(cls) for cls in our_classes(package, bpy.types.Operator)}
    assert names - hidden == set(record) and len(record) == len(set(record))
    # From whichever editor it is opened, an entry does what a click on a button does.
    assert stand_in.layout.operator_context == "INVOKE_DEFAULT"
    for menu in menus.menus():
        entry = []
        menus.draw_menu(types.SimpleNamespace(layout=Layout(entry)), bpy.context)
        assert entry == ["UV_MT_omt"] and menus.draw_menu in menu.draw._draw_funcs


def test_in_weight_paint_the_submenu_has_the_weights_alone(package):
    obj = scenes.bump()
    obj.vertex_groups.new(name="Region")
    bpy.ops.object.mode_set(mode="WEIGHT_PAINT")
    record = []
    package("panels.menus").UV_MT_omt.draw(types.SimpleNamespace(layout=Layout(record)), bpy.context)
    assert record == ["object.omt_weights"]


def test_names_say_what_operators_do():
    """So that the search finds them by it, as it finds them by the submenu's name."""
    for name, word in (("uv.omt_unwrap", "Unwrap Area Preserving"), ("object.omt_remesh", "Remesh Area Preserving")):
        assert scenes.class_of(name).bl_label == word


def test_every_operator_has_its_page(package):
    links = package("links")
    root, places = links.manual()
    pages = dict(places)
    for cls in our_classes(package, bpy.types.Operator):
        name = scenes.name_of(cls)
        if name.startswith("wm.") or name == "uv.omt_preset":
            continue
        assert (ROOT / "docs" / "operators" / f"{links.PAGES[name]}.md").exists(), name
        assert root + pages[f"bpy.ops.{name}*"] == links.page(name)


def test_every_address_is_that_of_a_page_that_is_there(package, monkeypatch, tmp_path):
    """In a checkout, in the zip, and where a release has a website; where there are no pages nothing points to one."""
    links = package("links")
    for name in [*links.PAGES, "", "uv.omt_preset"]:
        assert urllib.request.urlopen(links.page(name)).read(), name
    (tmp_path / "help").mkdir()
    monkeypatch.setattr(links, "PLACES", ((tmp_path / "help", "/index.html"),))
    root = (tmp_path / "help").as_uri()
    assert links.page("uv.omt_unwrap") == f"{root}/operators/unwrap/index.html"
    assert links.page() == f"{root}/operators/index.html"
    monkeypatch.setattr(links, "PLACES", ())
    assert links.page("uv.omt_unwrap") == "" and links.manual() == ("", ())
    assert not bpy.ops.wm.omt_help.poll()
    monkeypatch.setattr(links, "WEBSITE", "https://example.org/")
    assert links.page("uv.omt_unwrap") == "https://example.org/operators/unwrap/"
    assert links.manual()[0] == "https://example.org/"


def test_keys_are_of_operators_and_menus_that_there_are(package):
    for key in package("panels.keymap").KEYS:
        assert hasattr(bpy.types, key.menu) if key.menu else scenes.class_of(key.operator)


def test_everything_has_a_tooltip(package):
    """Every operator, property and choice says what it does, in one sentence or more without a final full stop."""
    for cls in our_classes(package, (bpy.types.Operator, bpy.types.AddonPreferences)):
        rna = cls.bl_rna
        assert issubclass(cls, bpy.types.AddonPreferences) or len(cls.__doc__ or "") > 10, cls
        inherited = {p.identifier for p in rna.base.properties} | {"rna_type"}
        if issubclass(cls, bpy.types.Operator):
            rna = bpy.context.window_manager.operator_properties_last(scenes.name_of(cls)).bl_rna
        for prop in rna.properties:
            if prop.is_readonly or prop.identifier in inherited:
                continue
            texts = [prop.description]
            if prop.type == "ENUM":
                texts += [item.description for item in prop.enum_items]
            for text in texts:
                assert len(text) > 5, f"{cls.__name__}.{prop.identifier}: {text!r}"
                assert not text.endswith("."), f"{cls.__name__}.{prop.identifier}: Blender adds the full stop"
            assert prop.name, prop.identifier


@pytest.mark.parametrize("mode", ["SCULPT", "WEIGHT_PAINT", "VERTEX_PAINT"])
def test_wrong_modes_grey_the_buttons(package, mode):
    scenes.bump()
    bpy.ops.object.mode_set(mode=mode)
    for name in ("uv.omt_unwrap", "uv.omt_refine", "uv.omt_seams", "uv.omt_measure", "uv.omt_overlay"):
        assert not scenes.class_of(name).poll(bpy.context)


@pytest.mark.parametrize(
    ("operator", "names"), [("uv.omt_unwrap", {"Character", "Scan", "Lightmap"}), ("uv.omt_sphere", {"Globe"})]
)
def test_presets_name_what_the_operator_has(package, operator, names):
    presets = package("session.presets")
    files = presets.files(operator)
    assert names <= {path.stem for path in files}
    assert "PRESET" in scenes.class_of(operator).bl_options
    properties = bpy.context.window_manager.operator_properties_last(operator)
    for path in files:
        values = presets.values(path)
        assert values.keys() <= settings_of(operator)
        assert bpy.ops.uv.omt_preset(operator=operator, filepath=str(path)) == {"FINISHED"}
        for name, value in values.items():
            assert getattr(properties, name) == pytest.approx(value)
    for prop in properties.bl_rna.properties:
        properties.property_unset(prop.identifier)


def test_a_broken_preset_is_refused(tmp_path):
    (tmp_path / "Bad.py").write_text("op.margin = open('/')\n")
    message = scenes.error_of(bpy.ops.uv.omt_preset, filepath=str(tmp_path / "Bad.py"))
    assert "Bad.py cannot be used" in message


def test_the_report_has_what_a_bug_needs(package):
    scenes.cube()
    scenes.error_of(bpy.ops.uv.omt_density_set)
    text = package("operators.report").report_text(bpy.context)
    for word in (
        "OMT UV",
        "Blender",
        "numpy",
        "scipy",
        "xatlas",
        "8 vertices",
        "6 faces",
        "last error: There are no UVs",
    ):
        assert word in text
    assert "Cube" not in text  # no names of files or objects


def test_the_report_names_none_of_several_objects(package):
    one, other = scenes.cube(), scenes.cube()
    one.name, other.name = "Lord of Hidden Lake", "Lord"
    scenes.select([one, other])
    for obj in (one, other):
        scenes.error_of(bpy.ops.uv.omt_density_set)
        text = package("operators.report").report_text(bpy.context)
        assert "Lord" not in text and "warning: There are no UVs" in text
        scenes.set_uv(obj, np.random.default_rng(0).random((24, 2)))


def test_the_choices_are_those_of_the_solver_and_of_the_command(package):
    """One list of boundaries and qualities, known to the solver."""
    settings, solver = package("settings"), package("solver.refinement.refine")
    assert {i.lower() for i, *_ in settings.BOUNDARIES} == set(solver.BOUNDARIES)
    operator = bpy.context.window_manager.operator_properties_last("uv.omt_unwrap").bl_rna.properties
    assert [item.identifier for item in operator["boundary"].enum_items] == [i for i, *_ in settings.BOUNDARIES]
    assert [item.identifier for item in operator["quality"].enum_items] == [i for i, *_ in settings.QUALITIES]


class Handing(Layout):
    """Keeps what is drawn of whose settings, and what every button is given."""

    def __init__(self, shown, buttons):
        super().__init__([])
        self.shown, self.buttons = shown, buttons

    def column(self, **_):
        return Handing(self.shown, self.buttons)

    row = split = box = column

    def prop(self, data, name, **_):
        self.shown.append((data, name))

    def operator(self, name, **_):
        self.buttons.append((name, given := types.SimpleNamespace()))
        return given


def test_a_button_beside_settings_is_given_those_that_it_has_as_well(package):
    """Its own are remembered by Blender; of what belongs to another button it would know nothing."""

    def same(one, other):
        return (one.name, one.description) == (other.name, other.description)

    scenes.bump()
    handed = set()
    for section in package("panels.sidebar").SECTIONS:
        shown, buttons = [], []
        section.draw(Handing(shown, buttons), bpy.context)
        for name, given in buttons:
            own = bpy.context.window_manager.operator_properties_last(name)
            if any(data.bl_rna.identifier == own.bl_rna.identifier for data, _ in shown):
                continue
            for data, prop in shown:
                if prop in settings_of(name) and same(own.bl_rna.properties[prop], data.bl_rna.properties[prop]):
                    handed.add((name, prop))
                    assert getattr(given, prop, None) == getattr(data, prop), (section.name, name, prop)
    assert {("uv.omt_density_get", "unit"), ("uv.omt_density_get", "texture_size")} <= handed


def test_landmarks_are_set_where_the_match_beside_looks_for_them(package):
    scenes.bump()
    properties = package("panels.section").settings_of(bpy.context, "object.omt_match")
    try:
        for properties.landmark_prefix in ("Landmark", "Joint", ""):
            buttons = []
            package("panels.match").SECTION.draw(Handing([], buttons), bpy.context)
            given = [getattr(given, "prefix", None) for name, given in buttons if "landmarks" in name]
            assert given == [properties.landmark_prefix or None] * 3
    finally:
        properties.property_unset("landmark_prefix")


@pytest.mark.parametrize("prefix", ["VIEW3D", "IMAGE"])
def test_the_help_of_a_section_is_the_page_of_its_first_operator(package, prefix):
    """That is what its title says, and not one of the buttons below."""
    sidebar = package("panels.sidebar")
    for section in sidebar.SECTIONS:
        button = types.SimpleNamespace()
        layout = types.SimpleNamespace(operator=lambda *_, button=button, **__: button)
        panel = getattr(bpy.types, sidebar._name(prefix, section.name))
        sidebar.TabPanel.draw_header_preset(types.SimpleNamespace(layout=layout, section=panel.section), None)
        assert panel.section is section and button.section == section.name
        assert button.operator == (section.operators[0] if section.operators else "uv.omt_measure")
