"""Every handler of an exception, cut out of its function and run by itself: what it takes, and what it does.

`handlers.tsv` keeps both, in words, where what a handler asks holds and where it does not, so that a handler takes more
or fewer, tells something else, or forgets something on purpose, or it is a bug; OMT_UV_ACCEPT=1 writes it anew. One
that is not in the table fails. Whether what it is there for happens is the matter of tests of its module.
"""

from __future__ import annotations

from pathlib import Path

from handlers import does, handlers, in_vain, taken
from kept import check

TABLE = Path(__file__).with_name("handlers.tsv")


def test_handlers_take_and_do_what_the_table_says():
    lines = []
    for handler in handlers():
        done, otherwise = does(handler, True), does(handler, False)
        name = [handler.module, handler.function, str(handler.place)]
        lines.append("\t".join([*name, taken(handler), done, "" if otherwise == done else otherwise]).rstrip())
    assert len(lines) > 200
    check(TABLE, lines)
    known = {tuple(line.split("\t")[:3]) for line in TABLE.read_text(encoding="utf-8").splitlines()}
    assert {tuple(line.split("\t")[:3]) for line in lines} <= known, "OMT_UV_ACCEPT=1 adds them"


def test_no_handler_names_an_exception_in_vain():
    found = [f"{h.module} {h.function}: {', '.join(kinds)}" for h in handlers() if (kinds := in_vain(h))]
    assert not found, "\n".join(found)
