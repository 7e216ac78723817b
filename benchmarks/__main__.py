"""Run the race: `python -m benchmarks --scenes A,B,C,M,T,start --reps 7 -o table.md`.

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

from benchmarks import peers, report, scenes

ROOT = Path(__file__).resolve().parent.parent
SHORTEST = 0.02  # Seconds; a call that is shorter is repeated until it takes this long, because clocks tick coarsely.
COLD_REPETITIONS = 3  # Compiling everything takes many seconds.
ALL = "A,B,C,M,T,start"
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


def last_core() -> int | None:
    """Return the core to pin workers to: the last one this process may use, or None where pinning does not exist."""
    return max(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else None


def environment(core: int | None) -> dict[str, str]:
    """Return the environment of a worker: one thread in every library, and this checkout to import from."""
    single = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
    paths = [str(ROOT), str(ROOT / "src"), os.environ.get("PYTHONPATH", "")]
    pinned = {} if core is None else {"SCANSPAN_BENCH_CORE": str(core)}
    return {**os.environ, **single, **pinned, "PYTHONPATH": os.pathsep.join(path for path in paths if path)}


def work(peer: str, scene_name: str, scale: float) -> None:
    """Serve as a worker: make the peer ready, then time one repetition for each line that comes in."""
    core = os.environ.get("SCANSPAN_BENCH_CORE")
    if core is not None:
        os.sched_setaffinity(0, {int(core)})
    scene = scenes.make(scene_name, scale)
    try:
        entry = peers.PEERS[peer][0](scene)
    except peers.MissingError as missing:
        print(json.dumps({"absent": str(missing)}), flush=True)
        return

    # Warm up: compile, touch the memory, and see how often a call fits into the shortest time.
    entry.convert()
    arrays = entry.draw()
    started = time.perf_counter()
    entry.draw()
    calls = max(1, min(10_000, math.ceil(SHORTEST / max(1e-7, time.perf_counter() - started))))
    print(
        json.dumps({"covered": entry.covered(arrays), "count": scene.count, "area": scene.area, "size": scene.size}), flush=True
    )
    for _ in sys.stdin:
        before_convert = time.process_time()
        entry.convert()
        wall, cpu = time.perf_counter(), time.process_time()
        for _ in range(calls):
            entry.draw()
        took = {"wall": (time.perf_counter() - wall) / calls, "cpu": (time.process_time() - cpu) / calls}
        print(json.dumps({**took, "convert": cpu - before_convert}), flush=True)


class Worker:
    """A worker process and what it has reported."""

    def __init__(self, peer: str, scene_name: str, scale: float, core: int | None) -> None:
        command = [sys.executable, "-m", "benchmarks", "--worker", peer, scene_name, str(scale)]
        pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self.timings = report.Timings()
        self.started = subprocess.Popen(command, env=environment(core), cwd=ROOT, **pipes)
        self.about = self._read()
        self.timings.absent = self.about.get("absent", "")
        self.timings.covered = self.about.get("covered", 0)

    def _read(self) -> dict[str, Any]:
        assert self.started.stdout is not None
        line = self.started.stdout.readline()
        answer: dict[str, Any] = json.loads(line) if line else {"absent": "the worker failed, see above"}
        return answer

    def repeat(self) -> None:
        """Ask for one repetition."""
        if self.timings.absent or self.started.stdin is None:
            return
        self.started.stdin.write("again\n")
        self.started.stdin.flush()
        answer = self._read()
        self.timings.absent = answer.get("absent", "")
        for name in ("cpu", "wall", "convert"):
            getattr(self.timings, name).append(answer.get(name, math.nan))

    def close(self) -> None:
        """Let the worker end."""
        self.started.communicate()


def race(scene_name: str, repetitions: int, scale: float, core: int | None) -> str:
    """Race all peers on a scene and return its table."""
    workers: dict[str, Worker] = {}
    try:
        for peer in peers.PEERS:
            workers[peer] = Worker(peer, scene_name, scale, core)
        for _ in range(repetitions):
            for worker in workers.values():
                worker.repeat()
    finally:
        for worker in workers.values():
            worker.close()
    about = next((worker.about for worker in workers.values() if "count" in worker.about), None)
    if about is None:
        return f"### Scene {scene_name}: no peer could run\n"
    timings = {peer: worker.timings for peer, worker in workers.items()}
    return report.scene_table(scene_name, about["count"], about["area"], tuple(about["size"]), timings)


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
    return report.start_table(timings)


def main(arguments: list[str] | None = None) -> int:
    """Run the race as a program."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="Race scanspan against OpenCV and memory fill.")
    parser.add_argument("--scenes", default=ALL, help=f"some of {ALL}, or M100k and M1M alone (default: all)")
    parser.add_argument("--reps", type=int, default=7, help="repetitions, taken in turns (default: 7)")
    parser.add_argument("--scale", type=float, default=1.0, help="share of the triangles of a scene (default: 1)")
    parser.add_argument("-o", dest="output", type=Path, help="write the tables to this file as well")
    parser.add_argument("--worker", nargs=3, metavar=("PEER", "SCENE", "SCALE"), help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.worker:
        work(options.worker[0], options.worker[1], float(options.worker[2]))
        return 0

    # Take the scenes in the order asked for; M stands for both meshes.
    names = [name for chosen in options.scenes.split(",") for name in (scenes.KNOTS if chosen == "M" else [chosen])]
    unknown = [name for name in names if name not in (*scenes.NAMES, "start")]
    if unknown:
        parser.error(f"unknown scene {unknown[0]!r}; the valid ones are {ALL}, {','.join(scenes.KNOTS)}")
    if options.reps < 1 or not 0 < options.scale <= 1:
        parser.error("--reps must be at least 1, and --scale above 0 and at most 1")

    core = last_core()
    parts = [report.heading(options.reps, core, options.scale)]
    print(parts[0], flush=True)
    for name in names:
        parts.append(starts(options.reps, core) if name == "start" else race(name, options.reps, options.scale, core))
        print(parts[-1], flush=True)
    if options.output:
        partial = options.output.with_name(options.output.name + ".partial")
        partial.write_text("\n".join(parts))
        partial.replace(options.output)
    return 0


if __name__ == "__main__":
    sys.exit(main())
