"""Run the race: `python -m benchmarks --scenes A,B,C,M,T,L,PS,start --reps 7 -o table.md`.

Every peer runs in a worker process of its own, so that none warms or fragments the memory of another. The workers wait on
their standard input and are asked in turns, so that a slow minute of the machine hits all of them. Ratios are made of CPU time,
because other programs may use the core too; wall time stands beside it.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import exact, plane_scenes, registry, report
from benchmarks.entry import Entry, MissingError

ROOT = Path(__file__).resolve().parent.parent
SHORTEST = 0.02  # Seconds; a call that is shorter is repeated until it takes this long, because clocks tick coarsely.
COLD_REPETITIONS = 3  # Compiling everything takes many seconds.
TRIANGLE = """
import numpy as np, scanspan
clip = np.array([[-0.8, -0.7, 0, 1], [0.9, -0.5, 0, 1], [0, 0.8, 0, 1.0]])
assert (scanspan.rasterize(clip, np.array([[0, 1, 2]]), (256, 256)).primitive == 0).any()
"""
OPENCV_TRIANGLE = """
import numpy as np, cv2
v = np.array([[-0.8, -0.7, -1], [0.9, -0.5, -1], [0, 0.8, -1]], np.float32)
c, z = np.zeros((256, 256, 3), np.float32), np.full((256, 256), 4, np.float32)
white, view = np.ones((3, 3), np.float32), np.eye(4, dtype=np.float32)[:3]
cv2.triangleRasterize(v, np.array([[0, 1, 2]], np.int32), white, c, z, view, 1.57, 0.5, 4)
"""


MARK, END_MARK = "<!-- speed: python -m benchmarks writes this table -->", "<!-- end of speed -->"


def last_core() -> int | None:
    """Return the core to pin workers to: the last one this process may use, or None where pinning does not exist."""
    return max(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else None


def environment(core: int | None) -> dict[str, str]:
    """Return the environment of a worker: one thread in every library, and this checkout to import from."""
    single = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
    paths = [str(ROOT), str(ROOT / "src"), os.environ.get("PYTHONPATH", "")]
    pinned = {} if core is None else {"SCANSPAN_BENCH_CORE": str(core)}
    return {**os.environ, **single, **pinned, "PYTHONPATH": os.pathsep.join(path for path in paths if path)}


def _judge(entry: Entry, scene: Any, path: str) -> dict[str, Any]:
    """Draw what is compared with the exact picture, and return how it compares."""
    entry.convert()
    result = entry.result(entry.draw())
    right: exact.Answer = {}
    with np.load(path) as stored:
        for name in stored.files:
            if name.partition("-")[0] == entry.gives:
                right.setdefault(entry.gives, []).append(stored[name])
    covered, wrong = exact.judge(scene, entry.gives, result, right)
    return {"gives": entry.gives, "covered": covered, "wrong": wrong}


def work(peer: str, scene_name: str, scale: float, path: str) -> None:
    """Serve as a worker: make the peer ready, then time one repetition for each line that comes in."""
    core = os.environ.get("SCANSPAN_BENCH_CORE")
    if core is not None:
        os.sched_setaffinity(0, {int(core)})
    scene = registry.make_scene(scene_name, scale)
    try:
        entry = registry.PEERS[peer].make(scene)
        part = plane_scenes.checked_part(scene)
        drawn = entry if part is scene else registry.PEERS[peer].make(part)
    except MissingError as missing:
        print(json.dumps({"absent": str(missing)}), flush=True)
        return

    # What is judged warms up, too: it compiles, and touches the memory.
    if peer == registry.FILL:
        entry.draw()
    judged = {"gives": entry.gives} if peer == registry.FILL else _judge(drawn, part, path)
    print(json.dumps(judged), flush=True)
    calls = 1
    for _ in sys.stdin:
        before_convert = time.process_time()
        entry.convert()
        converted = time.process_time() - before_convert
        took = _time_calls(entry, calls)
        if calls == 1 and took["wall"] < SHORTEST:
            calls = min(10_000, math.ceil(SHORTEST / max(1e-7, took["wall"])))
            took = _time_calls(entry, calls)
        print(json.dumps({**took, "convert": converted}), flush=True)


def _time_calls(entry: Entry, calls: int) -> dict[str, float]:
    """Return the seconds that a call takes."""
    wall, cpu = time.perf_counter(), time.process_time()
    for _ in range(calls):
        entry.draw()
    return {"wall": (time.perf_counter() - wall) / calls, "cpu": (time.process_time() - cpu) / calls}


class Worker:
    """A worker process and what it has reported."""

    def __init__(self, peer: str, scene_name: str, scale: float, path: Path, core: int | None) -> None:
        command = [sys.executable, "-m", "benchmarks", "--worker", peer, scene_name, str(scale), str(path)]
        pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self.timings = report.Timings()
        self.taken = 0.0  # Seconds of all repetitions, converting too.
        self.started = subprocess.Popen(command, env=environment(core), cwd=ROOT, **pipes)
        about = self._read()
        self.timings.absent = about.get("absent", "")
        self.timings.gives, self.timings.covered = about.get("gives", ""), about.get("covered", 0)
        self.timings.wrong = about.get("wrong")

    def _read(self) -> dict[str, Any]:
        assert self.started.stdout is not None
        line = self.started.stdout.readline()
        answer: dict[str, Any] = json.loads(line) if line else {"absent": "the worker failed, see above"}
        return answer

    def repeat(self) -> None:
        """Ask for one repetition."""
        if self.timings.absent or self.started.stdin is None:
            return
        began = time.perf_counter()
        self.started.stdin.write("again\n")
        self.started.stdin.flush()
        answer = self._read()
        self.timings.absent = answer.get("absent", "")
        for name in ("cpu", "wall", "convert"):
            getattr(self.timings, name).append(answer.get(name, math.nan))
        self.taken += time.perf_counter() - began

    def close(self) -> None:
        """Let the worker end."""
        self.started.communicate()


def race(name: str, repetitions: int, scale: float, budget: float, core: int | None) -> report.Race:
    """Race on a scene all peers that can draw it."""
    scene = registry.make_scene(name, scale)
    about = report.About(name, scene.count, scene.unit, scene.area, scene.size, scene.kind)
    workers: dict[str, Worker] = {}
    with tempfile.TemporaryDirectory(prefix="scanspan-bench-") as folder:
        path = Path(folder) / "right.npz"
        right = exact.answer(plane_scenes.checked_part(scene))
        stored: dict[str, Any] = {f"{form}-{k}": found for form, several in right.items() for k, found in enumerate(several)}
        np.savez(path, **stored)
        del scene, right, stored
        try:
            for peer in registry.peers_of(about.kind):
                workers[peer] = Worker(peer, name, scale, path, core)
            for _ in range(repetitions):
                for worker in workers.values():
                    if worker.taken < budget:
                        worker.repeat()
        finally:
            for worker in workers.values():
                worker.close()
    return about, {peer: worker.timings for peer, worker in workers.items()}


def _children_cpu() -> float:
    """Return the CPU seconds of all processes that this one has started and that have ended."""
    try:
        import resource
    except ImportError:
        times = os.times()
        return times.children_user + times.children_system
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _time_process(code: str, variables: dict[str, str], times: report.Timings) -> None:
    """Run a program in a fresh interpreter and add its times, or say why it failed."""
    before, started = _children_cpu(), time.perf_counter()
    done = subprocess.run([sys.executable, "-c", code], env=variables, cwd=ROOT, capture_output=True, text=True, check=False)
    wall = time.perf_counter() - started
    if done.returncode:
        times.absent = (done.stderr.strip().splitlines() or ["failed without a message"])[-1]
        return
    times.wall.append(wall)
    times.cpu.append(_children_cpu() - before)


def first_kernels(variables: dict[str, str]) -> str:
    """Return how many kernels a first triangle compiles, and how long that takes."""
    told = "\nfrom scanspan.jit import compile_seconds\nfrom scanspan.view.metadata import compiled_kernels"
    told += "\nprint(len(compiled_kernels()), compile_seconds())"
    done = subprocess.run([sys.executable, "-c", TRIANGLE + told], env=variables, cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        return "What a first triangle compiles could not be counted.\n"
    kernels, took = done.stdout.split()
    return f"A first triangle compiles {kernels} kernels with what they call, which takes {report.seconds(float(took))}.\n"


def starts(repetitions: int, core: int | None) -> str:
    """Time whole processes: interpreters that import, and the first triangle with an empty and with a filled kernel cache."""
    programs = {"python": "pass", "import numpy": "import numpy", "import scanspan": "import scanspan"}
    programs |= {"import cv2, one triangle": OPENCV_TRIANGLE}
    cold, cached = "scanspan, one triangle, kernels to compile", "scanspan, one triangle, kernels cached"
    timings = {name: report.Timings() for name in (*programs, cold, cached)}
    variables = environment(core)
    if core is not None:
        os.sched_setaffinity(0, {core})
    with tempfile.TemporaryDirectory(prefix="scanspan-bench-") as folder:
        for repetition in range(repetitions):
            for name, code in programs.items():
                _time_process(code, variables, timings[name])
            if repetition < COLD_REPETITIONS:
                _time_process(TRIANGLE, {**variables, "NUMBA_CACHE_DIR": os.path.join(folder, str(repetition))}, timings[cold])
            _time_process(TRIANGLE, {**variables, "NUMBA_CACHE_DIR": os.path.join(folder, "0")}, timings[cached])
        counted = first_kernels({**variables, "NUMBA_CACHE_DIR": os.path.join(folder, "counted")})
    return f"{report.start_table(timings)}\n{counted}"


def write(path: Path, text: str) -> None:
    """Write a file whole or not at all."""
    partial = path.with_name(path.name + ".partial")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)


def put_between(path: Path, table: str) -> None:
    """Put a table between the two marks of a file, in the place of what is there."""
    text = path.read_text(encoding="utf-8")
    start, end = text.index(MARK) + len(MARK), text.index(END_MARK)
    write(path, f"{text[:start]}\n\n{table}\n{text[end:]}")


def main(arguments: list[str] | None = None) -> int:
    """Run the race as a program."""
    everything = ",".join(registry.ALL)
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="Race scanspan against other rasterizers.")
    parser.add_argument("--scenes", default=everything, help=f"some of {everything}, or one such as M1M alone (default: all)")
    parser.add_argument("--reps", type=int, default=5, help="repetitions, taken in turns (default: 5)")
    parser.add_argument("--seconds", type=float, default=2.0, help="after which a peer sits out on a scene (default: 2)")
    parser.add_argument("--scale", type=float, default=1.0, help="share of the triangles or such of a scene (default: 1)")
    parser.add_argument("-o", dest="output", type=Path, help="write the tables to this file as well")
    parser.add_argument("--readme", type=Path, help=f"put a short table between {MARK} and {END_MARK} of this file")
    parser.add_argument("--worker", nargs=4, metavar=("PEER", "SCENE", "SCALE", "RIGHT"), help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.worker:
        peer, scene_name, scale, path = options.worker
        work(peer, scene_name, float(scale), path)
        return 0
    try:
        names = registry.scene_names(options.scenes)
    except ValueError as error:
        parser.error(str(error))
    if options.reps < 1 or not 0 < options.scale <= 1 or not options.seconds > 0:
        parser.error("--reps must be at least 1, --scale above 0 and at most 1, and --seconds above 0")

    core, races = last_core(), []
    kinds = {registry.make_scene(name, 0.001).kind for name in names if name != registry.START}
    parts = [report.heading(options.reps, core, options.scale, options.seconds, kinds)]
    print(parts[0], flush=True)
    for name in names:
        if name == registry.START:
            parts.append(starts(options.reps, core))
        else:
            races.append(race(name, options.reps, options.scale, options.seconds, core))
            parts.append(report.scene_table(*races[-1]))
        print(parts[-1], flush=True)
    if races:
        parts.append(report.summary_table(races))
        print(parts[-1], flush=True)
    if options.output:
        write(options.output, "\n".join(parts))
    if options.readme:
        put_between(options.readme, report.short_table(races))
    return 0


if __name__ == "__main__":
    sys.exit(main())
