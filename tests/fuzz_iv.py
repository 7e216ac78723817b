"""Read damaged Inventor files: `python -m tests.fuzz_iv ../shared/data/inventor --seconds 600 --seed 1`.

Files are truncated and mutated: bytes changed, taken out and put in, words of the language and counts that are too large among
them. Each is read, and some are drawn, saved and read again. What counts as a fault: an exception that is not one of ours or
that says "the file is damaged" (a reader that knows its format says what is wrong), more than a minute of a processor for one
file, or more than 1 GiB of memory beyond what the process has had before. A file that shows one is kept in a temporary folder
and named; the program then exits with 1. It prints what came out, so that no fault cannot come from reading nothing.
"""

from __future__ import annotations

import argparse
import gzip
import logging
import random
import resource
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

import scanspan as ss
from scanspan.errors import ScanspanError

SLOWEST = 60  # seconds of a processor for a file, whatever else the machine does
MOST_MEMORY = 1 << 30  # bytes, more than the process has had at the start
LARGE = 200_000  # bytes; one in five of such files is taken
FEW_TRIANGLES = 10_000  # of a scene that is drawn; more are drawn by another kernel, which would have to be compiled

WORDS = (
    b"Separator", b"USE", b"DEF a", b"ClipPlane { plane 1 1 1 .1 }", b"PointLight {}", b"SpotLight { cutOffAngle 1e30 }",
    b"Environment { attenuation 1e38 0 -1 }", b"Array { numElements1 99 numElements2 99", b"-1", b"999999999999", b"1e38", b"{",
    b"}", b"[", b"]", b'"', b"#", b"Material { transparency 0.5 }", b"NurbsProfile", b'Text3 { string "x" }', b"Cube {}",
    b"Transform { scaleFactor 0 0 0 }", b"\x7f\xff\xff\xff", b"\x80\0\0\0", b"MaterialBinding { value PER_PART }",
    b"VertexProperty { orderedRGBA 0xff }",
)  # fmt: skip
WHOLE_NUMBERS = (b"\0\0\0\0", b"\xff\xff\xff\xff", b"\x7f\xff\xff\xff", b"\0\0\xff\xff")


class TooSlow(BaseException):
    """A file took longer than SLOWEST."""


def stop(*_: object) -> None:
    """End the reading of one file."""
    raise TooSlow


def damage(content: bytes, draw: random.Random) -> bytes:
    """Return a file that was truncated, or changed in some places."""
    raw = bytearray(content)
    if draw.random() < 0.2:
        return bytes(raw[: draw.randrange(len(raw) + 1)])
    for _ in range(draw.choice((1, 1, 2, 5, 20))):
        if not raw:
            break
        place, way = draw.randrange(len(raw)), draw.randrange(6)
        if way == 0:
            raw[place] = draw.randrange(256)
        elif way == 1:
            raw[place] ^= 1 << draw.randrange(8)
        elif way == 2:
            del raw[place : place + draw.choice((1, 4, 16, 200))]
        elif way == 3:
            word = draw.choice(WORDS)
            raw[place:place] = b" " + word + b" " if draw.random() < 0.7 else word
        elif way == 4:
            other = draw.randrange(len(raw))
            raw[place:place] = raw[other : other + draw.choice((4, 40, 400))]
        else:
            raw[place : place + 4] = draw.choice(WHOLE_NUMBERS)
    return bytes(raw)


def read(path: Path, draw: random.Random) -> str:
    """Read a file, and sometimes draw it or save it; return what came of it."""
    try:
        scene = ss.load(path)
        if scene.triangle_count < FEW_TRIANGLES and draw.random() < 0.2:
            ss.render(scene, size=(24, 18), samples=1, threads=1)
        if scene.triangle_count < FEW_TRIANGLES and draw.random() < 0.1:
            ss.save(scene, path.with_name("b.iv"))
            ss.load(path.with_name("b.iv"))
    except ScanspanError as error:
        return "FAULT: damaged" if "the file is damaged" in str(error) else type(error).__name__
    except TooSlow:
        return "FAULT: too slow"
    except Exception as error:
        return f"FAULT: {type(error).__name__}: {error}"
    return "read"


def memory() -> int:
    """Return how much memory this process has used at most, in bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10


def compile_kernels(folder: Path) -> None:
    """Draw and save a scene that needs every kernel which the others need, so that no file has to wait for the compiler."""
    hole = ss.Polygons([[[(0, 0, 0), (4, 0, 0), (0, 4, 0)], [(1, 1, 0), (2, 1, 0), (1, 2, 0)]]], colors=(255, 0, 0, 99))
    image = ss.Texture([[[0, 99, 200, 99]]])
    cube = ss.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 1)], [(0, 1, 2)], attributes={"uv": [(0, 0), (1, 0), (0, 1)]})
    shapes = [hole, ss.Instance(cube, material=ss.Material("", texture=image)), ss.Points([(0, 0, 1)], (9, 9, 9, 9))]
    scene = ss.Scene([*shapes, ss.Segments([(0, 0, 1), (1, 1, 1)], [(0, 1)])], lights=[ss.Light("point", position=(3, 3, 3))])
    for lights in ("studio", "scene"):
        ss.render(scene, size=(24, 18), samples=1, threads=1, lights=lights)
    ss.save(scene, folder / "a.iv")


def run(folder: Path, seconds: float, seed: int) -> tuple[Counter[str], list[str]]:
    """Read damaged files for some time; return how often each result came, and what was at fault."""
    paths = sorted(path for path in folder.rglob("*.iv*") if path.is_file())
    draw, results, faults = random.Random(seed), Counter[str](), list[str]()
    kept = Path(tempfile.mkdtemp(prefix="fuzz_iv-"))
    compile_kernels(kept)
    signal.signal(signal.SIGPROF, stop)
    end, most = time.monotonic() + seconds, memory() + MOST_MEMORY
    while time.monotonic() < end:
        path = draw.choice(paths)
        content = path.read_bytes()
        if len(content) > LARGE and draw.random() < 0.8:
            continue
        target = kept / "a.iv"
        target.write_bytes(damage(gzip.decompress(content) if content[:2] == b"\x1f\x8b" else content, draw))
        before = memory()
        signal.setitimer(signal.ITIMER_PROF, SLOWEST)
        result = read(target, draw)
        signal.setitimer(signal.ITIMER_PROF, 0)
        if memory() > max(before, most):
            result = f"FAULT: {memory() >> 20} MiB"
        results[result[:60]] += 1
        if result.startswith("FAULT"):
            example = target.rename(kept / f"fault-{len(faults)}.iv")
            faults.append(f"{result} ({path.name}, kept as {example})")
    return results, faults


def main(arguments: list[str] | None = None) -> int:
    """Run, and print what was found."""
    options: Any = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    options.add_argument("folder", type=Path)
    options.add_argument("--seconds", type=float, default=600.0)
    options.add_argument("--seed", type=int, default=1)
    given = options.parse_args(arguments)
    logging.getLogger("scanspan").disabled = True
    results, faults = run(given.folder, given.seconds, given.seed)
    print(f"{sum(results.values()):,} damaged files, {memory() >> 20} MiB at most")
    for result, count in results.most_common():
        print(f"{count:8,}  {result}")
    print(*faults, sep="\n", end="\n" if faults else "")
    return 1 if faults or not results else 0


if __name__ == "__main__":
    sys.exit(main())
