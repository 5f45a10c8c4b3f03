"""Lines, bars and gaps of what panels and menus draw: what is cut says so, bars say what stands in them, gaps part."""

from __future__ import annotations

import re
import sys
from types import SimpleNamespace

import bpy

import pytest
import scenes

TEXT = "faces are folded, and the islands of these lie on others where nobody would look for them at first sight "


class Drawn:
    """A layout that writes down what is drawn in turn: kind, text, and what else is given."""

    def __init__(self, record):
        self.__dict__.update(record=record)

    def __setattr__(self, name, value):
        pass

    def __getattr__(self, name):
        if name in ("column", "row", "split", "box", "grid_flow", "column_flow"):
            return lambda *_, **__: Drawn(self.record)

        def write(*given, **named):
            text = named.get("text", next((word for word in given if isinstance(word, str)), ""))
            self.record.append((name, text, named))
            return SimpleNamespace()

        return write


def drawn(draw, *given):
    record: list = []
    draw(Drawn(record), *given)
    return record


@pytest.mark.parametrize("width", [12, 13, 30, 37, 70])
@pytest.mark.parametrize("length", [0, 1, 11, 12, 13, 40, 90, 100, 400])
def test_a_notice_fills_its_lines_and_says_where_it_is_cut(package, width, length):
    result, last_run = package("panels.result"), package("session.last_run")
    text = " ".join((TEXT * 4)[:length].split())
    record = drawn(result.draw_notice, last_run.Summary("Unwrap", (), (last_run.Notice(text),)), width)
    lines = [words for kind, words, _ in record if kind == "label"][: result.LINES]
    assert len(lines) == result.LINES and max(map(len, lines)) <= width
    kept = " ".join(line for line in lines if line)
    if kept.endswith(" ..."):
        kept = kept.removesuffix(" ...").strip()
        # It goes on, and as much stands there as there is room for.
        assert text.startswith(kept) and len(kept) < len(text)
        assert len(last_run.lines(text, width)) > result.LINES and len(lines[-1]) > width - 12 - 4
    else:
        assert kept == text


@pytest.mark.parametrize("count", [0, 1, 2, 5])
def test_notices_are_shown_one_after_the_other_with_their_number_and_remedy(package, count):
    result, last_run = package("panels.result"), package("session.last_run")
    actions = package("remedies").ACTIONS
    notices = tuple(last_run.Notice(f"text {k}", actions[k % len(actions)][0] if k % 2 else "") for k in range(count))
    before = last_run.state.shown
    try:
        for shown in range(2 * count + 1):
            last_run.state.shown = shown
            record = drawn(result.draw_notice, last_run.Summary("Unwrap", (), notices), 60)
            buttons = [(kind, text) for kind, text, named in record if kind == "operator"]
            k = shown % max(count, 1)
            assert record[0][1] == (f"text {k}" if count else "")
            titles = [text for _, text in buttons if text in {label for _, label, _ in actions}]
            assert titles == ([actions[k % len(actions)][1]] if count and k % 2 else [])
            numbers = [text for _, text in buttons if re.fullmatch(r"\d+ of \d+", text)]
            assert numbers == ([f"{k + 1} of {count}"] if count > 1 else [])
            assert len(buttons) == len(titles) + len(numbers) + (count > 0)
    finally:
        last_run.state.shown = before


@pytest.mark.parametrize("fraction", [0.0, 0.25, 0.994, 1.0])
def test_bars_are_as_full_as_their_words_say(package, monkeypatch, fraction):
    module = package("session.queue")
    jobs = [module.Job("Object 1"), module.Job("Object 2")]
    jobs[0].progress = fraction
    monkeypatch.setattr(module, "state", module.Queue(jobs))
    bars = [named for kind, _, named in drawn(package("panels.arrange").draw_queue, bpy.context) if kind == "progress"]
    assert [bar["factor"] for bar in bars] == [fraction, 0.0]
    assert [bar["text"] for bar in bars] == [f"{100 * fraction:.0f} %", "0 %"]
    current = SimpleNamespace(fraction=fraction, stage="Charts", seconds=12.34)
    (bar,) = (named for kind, _, named in drawn(package("panels.unwrap").draw_run, current) if kind == "progress")
    assert bar == {"factor": fraction, "text": "Charts, 12.3 s"}


def test_without_bars_a_line_says_how_far_it_is(package):
    record = []
    layout = SimpleNamespace(label=lambda **named: record.append(named))
    package("blender.versions").progress_bar(layout, 0.257, "Charts")
    assert [named["text"] for named in record] == ["Charts  26 %"]


def gaps(record):
    """Entries between gaps: a list for every part."""
    parts: list[list[str]] = [[]]
    for kind, text, _ in record:
        if kind == "separator":
            parts.append([])
        else:
            parts[-1].append(text)
    return parts


def test_gaps_of_the_submenu_part_its_groups(package):
    menus, found = package("panels.menus"), package("panels.section").class_of
    record: list = []
    menus.UV_MT_omt.draw(SimpleNamespace(layout=Drawn(record)), bpy.context)
    groups = [[name for name in group if found(name)] for group in menus.ENTRIES]
    assert gaps(record) == groups and all(groups)


def test_gaps_stand_between_things(package):
    """In every section, every settings of an operator and every menu: none first, none last, no two in a row."""
    scenes.bump()
    records = {}
    for section in package("panels.sidebar").SECTIONS:
        records[section.name] = drawn(section.draw, bpy.context)
    for cls in package("registration").CLASSES:
        if issubclass(cls, bpy.types.Operator) and "draw" in vars(cls):
            properties = bpy.context.window_manager.operator_properties_last(scenes.name_of(cls))
            draw = getattr(sys.modules[cls.__module__], "draw_settings", None)
            if draw is not None:
                records[cls.bl_idname] = drawn(draw, properties)
        if issubclass(cls, bpy.types.Menu) and cls.__name__ == "UV_MT_omt_presets":
            record: list = []
            cls.draw(SimpleNamespace(layout=Drawn(record)), bpy.context)
            records[cls.__name__] = record
    assert len(records) > 25 and sum(len(gaps(record)) > 1 for record in records.values()) > 3
    for name, record in records.items():
        assert all(gaps(record)) or not record, name


def test_settings_that_are_hidden_are_not_drawn(package):
    """Of an operator that draws none of its own: all others stand below one another, in their order."""
    section = package("panels.section")
    for name in ("wm.omt_help", "uv.omt_flow", "uv.omt_density_set"):
        properties = bpy.context.window_manager.operator_properties_last(name)
        every = [p.identifier for p in properties.bl_rna.properties if p.identifier != "rna_type"]
        hidden = {p.identifier for p in properties.bl_rna.properties if p.is_hidden}
        record = [text for kind, text, _ in drawn(section.draw_settings, name, properties) if kind == "prop"]
        assert not hidden & set(record), name
        if not hasattr(sys.modules[section.class_of(name).__module__], "draw_settings"):
            assert record == [name for name in every if name not in hidden]
    help_of = bpy.context.window_manager.operator_properties_last("wm.omt_help").bl_rna.properties
    assert any(p.is_hidden for p in help_of)
