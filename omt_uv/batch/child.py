"""One run of a batch, in a child process of its own: what came of it, as plain values that travel as JSON."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ..supervision import PROGRAM, Errand, Outcome
from ..temporary import own_folder
from .plan import BatchPlan, FileTask, hash_of, words_of

ERROR = f"{PROGRAM}: error: "
WARNING = f"{PROGRAM}: warning: "
# Characters of a message that are kept.
LONGEST = 2000


@dataclass(frozen=True)
class Record:
    """What came of a run.

    status : exit status; message : the error, in one line; report : JSON text of the command, "" for none; outputs :
    hash and bytes of every file that was written, by its path; preview : its path, "" for none; aside : whether it
    has ended workers
    """

    status: int
    seconds: float
    processor: float | None = None
    memory: int | None = None
    message: str = ""
    warnings: list[str] = field(default_factory=list)
    words: list[str] = field(default_factory=list)
    report: str = ""
    outputs: dict[str, tuple[str, int]] = field(default_factory=dict)
    preview: str = ""
    input_hash: str = ""
    host: str = ""
    aside: bool = False


def run_task(plan: BatchPlan, task: FileTask, start: Sequence[str], watched: Callable[[Errand], Outcome]) -> Record:
    """Run the command on one file; `start` are the words of the program, `watched` carries the errand out."""
    # Read before the run: a file that changes meanwhile is done again.
    input_hash = hash_of(task.path)
    preview = plan.beside(".previews") / f"{task.name}.png" if plan.previews else None
    with own_folder() as folder:
        places: dict[str, Path] = {}
        if plan.reports:
            places["report"] = folder / "report.json"
        if preview is not None:
            places["preview"] = preview
        for path in (preview, task.output):
            if path is not None:
                path.parent.mkdir(parents=True, exist_ok=True)
        words = [*start, *words_of(plan, task, places)]
        folders = tuple({path.parent for path in (preview, task.output) if path is not None})
        errand = Errand(words, str(task.path), folders, plan.timeout, plan.memory > 0)
        outcome = watched(errand)
        report = _text_of(places.get("report")) if plan.reports else outcome.out
    done = outcome.status == 0
    return Record(
        status=outcome.status,
        seconds=outcome.seconds,
        processor=outcome.processor,
        memory=outcome.memory,
        message="" if done else message_of(outcome),
        warnings=told(outcome.err, WARNING),
        words=[*start, *words_of(plan, task, {})],
        report=report if done else "",
        outputs=outputs_of(task) if done else {},
        preview=str(preview) if done and preview is not None and preview.is_file() else "",
        input_hash=input_hash,
        host=socket.gethostname(),
    )


def message_of(outcome: Outcome) -> str:
    """What went wrong: what ended the run, or the last error that it has told, or its last words."""
    errors = told(outcome.err, ERROR)
    # Of options, the word before is the name of the command.
    lines = [line for line in outcome.err.splitlines() if line.strip()]
    text = outcome.text or (
        errors[-1] if errors else lines[-1] if lines else f"status {outcome.status}, without a word"
    )
    return text[:LONGEST]


def told(text: str, prefix: str) -> list[str]:
    """The lines with a prefix, without it; a line may begin with what a bar has left of another."""
    return [line.partition(prefix)[2] for line in text.splitlines() if prefix in line]


def outputs_of(task: FileTask) -> dict[str, tuple[str, int]]:
    """Hash and bytes of every file that a run has written, by its path; of levels of detail all."""
    if task.output is None:
        return {}
    found = [task.output] if task.output.is_file() else []
    levels = []
    k = 0
    while (path := task.output.with_name(f"{task.output.stem}_LOD{k}{task.output.suffix}")).is_file():
        levels.append(path)
        k += 1
    paths = found or levels
    return {str(path): (hash_of(path), os.path.getsize(path)) for path in paths}


def _text_of(path: Path | None) -> str:
    """The text of a file; "" where it was not written."""
    return path.read_text() if path is not None and path.is_file() else ""
