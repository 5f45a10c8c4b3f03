"""Runs on many machines: the same tasks on a cluster of dask.distributed.

What travels is text: a task as JSON there, its record as JSON back, and, where no folder is shared, the bytes of the
files. Dask itself sends functions by pickle: who may connect to a scheduler may run anything on its workers, so a
cluster of our own is bound to this machine, and one that spans machines belongs behind TLS.
"""

from __future__ import annotations

import contextlib
import json
import queue
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..supervision import Errand, Outcome, watch
from ..temporary import own_folder
from .child import Record, hash_of, run_task
from .plan import BatchError, BatchPlan, FileTask, kept, words_of

if TYPE_CHECKING:
    from distributed import Client

LOCAL = "local"
HERE = "127.0.0.1"
LOOPBACK = ("127.", "localhost", "[::1]")
# On a worker: the words that start the program, where it is not that of the worker's Python.
PROGRAM_VARIABLE = "OMT_UV_PROGRAM"
# A worker may die once of a file; the second one sets it aside.
DEATHS = 1


class Cluster:
    """The workers that a scheduler has."""

    def __init__(self, plan: BatchPlan, start: Sequence[str], address: str, send: bool = False) -> None:
        """`address` is that of a scheduler, or "local", or "local:N" for N workers on this machine.

        send : the files go to the workers and come back; otherwise workers share the folders under the same paths

        Raises
        ------
        BatchError : dask.distributed is not installed, or nothing answers
        """
        self.plan, self.start, self.send = plan, tuple(start), send
        self._stopped = False
        self._ended: queue.SimpleQueue = queue.SimpleQueue()
        try:
            import distributed
        except ModuleNotFoundError as error:
            raise BatchError(f"{error}. A cluster needs dask.distributed: pip install 'omt-uv[farm]'.") from error
        self._local: Any = None
        try:
            if address == LOCAL or address.startswith(f"{LOCAL}:"):
                self._local = _local_cluster(address)
                address = self._local.scheduler_address
            self.client: Client = distributed.Client(address, timeout=20, set_as_default=False)
        except BatchError:
            raise
        except (OSError, ValueError) as error:
            raise BatchError(f"{address}: no scheduler answers ({error}). Start one: dask scheduler.") from error

    def warnings(self) -> list[str]:
        """What a user should know about the cluster before anything is sent."""
        told = []
        address = str(self.client.scheduler_info()["address"])
        place = address.partition("://")[2]
        if address.startswith("tcp://") and not place.startswith(LOOPBACK):
            told.append(f"{address} is neither of this machine nor encrypted; see TLS in docs/farm.md")
        if not self._threads():
            told.append(f"{address} has no workers yet; the batch waits for them")
        allowed = self.client.run_on_scheduler(_allowed_failures)
        if allowed != DEATHS:
            told.append(
                f"{address} lets a file end {allowed + 1} workers before it is set aside; start it with "
                "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES=1 for 2"
            )
        return told

    def run(self, tasks: Sequence[FileTask]) -> Iterator[tuple[FileTask, Record | None]]:
        waiting = list(reversed(tasks))
        owner: dict[str, FileTask] = {}
        while (waiting or owner) and not self._stopped:
            # None waits on a worker for another: it would count as one that the worker has died of.
            while waiting and len(owner) < max(self._threads(), 1):
                task = waiting.pop()
                yield task, None
                future = self._submit(task)
                owner[future.key] = task
                future.add_done_callback(self._ended.put)
            future = self._ended.get()
            if future is None:
                break
            task = owner.pop(future.key)
            yield task, self._record(task, future)
            future.release()

    def stop(self) -> None:
        self._stopped = True
        self._ended.put(None)

    def close(self) -> None:
        """Leave the scheduler; a local cluster ends."""
        with contextlib.suppress(OSError, TimeoutError):
            self.client.close(timeout=5)
        if self._local is not None:
            self._local.close(timeout=10)

    def _threads(self) -> int:
        return sum(self.client.nthreads().values())

    def _submit(self, task: FileTask):
        """Hand a task to the scheduler, the bytes of its file with it if they are to be sent."""
        data = None
        if self.send:
            try:
                data = task.path.read_bytes()
            except OSError:
                # The run will say so.
                data = b""
        text = json.dumps({"plan": _plain(self.plan), "task": _plain(task)})
        return self.client.submit(run_remote, text, data, pure=False, key=f"omt_uv-{task.name}-{id(task)}")

    def _record(self, task: FileTask, future) -> Record:
        """What came of a task.

        Raises
        ------
        BatchError : the scheduler is gone, or a worker lacks this program
        """
        from distributed.scheduler import KilledWorker

        if future.status == "finished":
            text, files = future.result()
            record = Record(**json.loads(text))
            if self.send and record.status == 0:
                record = self._received(task, record, files)
            return replace(record, words=[*self.start, *words_of(self.plan, task, {})])
        if future.status != "error":
            raise BatchError(
                "The scheduler has gone away. Start it again, and then this batch: it goes on where it was."
            )
        error = future.exception()
        if isinstance(error, KilledWorker):
            text = f"{task.path}: ended {DEATHS + 1} workers and is set aside; --retry tries it again"
            return Record(status=5, seconds=0.0, message=text, aside=True, input_hash=hash_of(task.path))
        raise BatchError(f"A worker cannot do its work ({type(error).__name__}: {error}). Has it the same omt-uv?")

    def _received(self, task: FileTask, record: Record, files: dict[str, bytes]) -> Record:
        """The record of files that came back, after they are written."""
        outputs = {}
        for name, data in files.items():
            if name == "preview":
                path = self.plan.beside(".previews") / f"{task.name}.png"
            else:
                assert task.output is not None
                path = task.output.parent / Path(name).name
            with kept(path):
                path.parent.mkdir(parents=True, exist_ok=True)
                _write_whole(path, data)
            if name != "preview":
                outputs[str(path)] = (hash_of(path), len(data))
        preview = str(self.plan.beside(".previews") / f"{task.name}.png") if "preview" in files else ""
        return replace(record, outputs=outputs, preview=preview)


def _local_cluster(address: str):
    """A scheduler and workers of this machine, that no other machine can reach."""
    import dask
    from distributed import LocalCluster

    from .pool import cores

    count = address.partition(":")[2]
    if count and not count.isdecimal():
        raise BatchError(f"{address}: write local:N for N workers")
    dask.config.set({"distributed.scheduler.allowed-failures": DEATHS, "distributed.worker.daemon": False})
    return LocalCluster(
        host=HERE, n_workers=int(count or cores()), threads_per_worker=1, dashboard_address=f"{HERE}:0", memory_limit=0
    )


def _allowed_failures(dask_scheduler) -> int:
    """How many workers may die of a task before it fails; runs on the scheduler."""
    return int(dask_scheduler.allowed_failures)


def run_remote(text: str, data: bytes | None) -> tuple[str, dict[str, bytes]]:
    """Run a task on a worker: its record as JSON, and the files it made, by name, if `data`, its input, was sent."""
    given = json.loads(text)
    plan, task = _plan_of(given["plan"]), _task_of(given["task"])
    start = started_by()
    if data is None:
        return json.dumps(asdict(run_task(plan, task, start, _alone))), {}
    with own_folder() as here:
        name = Path(task.name).name
        (here / "in").mkdir()
        (here / "in" / name).write_bytes(data)
        output = None if task.output is None else here / "out" / task.output.name
        inner = replace(plan, output=here / "out")
        record = run_task(inner, replace(task, path=here / "in" / name, output=output), start, _alone)
        message = record.message.replace(str(here / "in" / name), str(task.path))
        files = {Path(path).name: Path(path).read_bytes() for path in record.outputs}
        if output is not None:
            # What belongs to a result goes with it: the materials of an .obj.
            files |= {p.name: p.read_bytes() for p in output.parent.glob("*") if p.suffix == ".mtl"}
        if record.preview:
            files["preview"] = Path(record.preview).read_bytes()
    return json.dumps(asdict(replace(record, message=message, outputs={}, preview=""))), files


def started_by() -> tuple[str, ...]:
    """The words that start the program on this machine: of its variable, or of the Python that runs."""
    import os
    import shlex

    return tuple(shlex.split(os.environ.get(PROGRAM_VARIABLE, ""))) or (sys.executable, "-m", "omt_uv")


def _alone(errand: Errand) -> Outcome:
    """A child of its own, which ends with the worker, as it waits for the end of a pipe."""
    return watch(errand, lambda _child: None)


def _plain(thing) -> dict:
    """A dataclass as values that JSON has."""
    return {k: str(v) if isinstance(v, Path) else v for k, v in asdict(thing).items()}


def _plan_of(values: dict) -> BatchPlan:
    return BatchPlan(**{**values, "options": tuple(values["options"]), "output": Path(values["output"])})


def _task_of(values: dict) -> FileTask:
    output = values["output"]
    return FileTask(**{**values, "path": Path(values["path"]), "output": None if output is None else Path(output)})


def _write_whole(path: Path, data: bytes) -> None:
    """Write a file beside its place first, so that it is there whole or not at all."""
    import os

    made = path.with_name(f".omt_uv_{os.getpid()}_{path.name}")
    with open(made, "wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    os.replace(made, path)
