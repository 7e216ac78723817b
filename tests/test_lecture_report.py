"""The report on the lectures and the commands that make it: one page with everything in it, and nothing from elsewhere."""

from __future__ import annotations

import base64
import io
import re
import sys
from itertools import chain
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from PIL import Image

from scanspan.cli import main
from scanspan.lectures import experiments
from scanspan.lectures.experiments import EXPERIMENTS
from scanspan.lectures.experiments.experiment import written
from scanspan.lectures.report import LECTURES, small_png, write_page
from tests.experimenting import cached_experiments, found

MOST_BYTES = 3_000_000


class Page:
    """What stands on a page, which has to be well-formed: all elements, and the tables, pictures and words of each section."""

    def __init__(self, text: str) -> None:
        assert text.startswith("<!doctype html>")
        self.elements = list(ET.fromstring(text.removeprefix("<!doctype html>")).iter())
        self.sections = {one.get("id"): self.contents(one) for one in self.elements if one.tag == "section"}

    @staticmethod
    def contents(section: ET.Element) -> dict[str, list]:
        """Return what stands in a section."""
        return {
            "rows": [["".join(cell.itertext()) for cell in row] for row in section.iter("tr")],
            "images": [image.get("src", "") for image in section.iter("img")],
            "captions": ["".join(caption.itertext()) for caption in section.iter("figcaption")],
            "text": list(section.itertext()),
        }


@pytest.fixture(scope="module")
def text() -> str:
    return write_page(cached_experiments())


@pytest.fixture(scope="module")
def page(text: str) -> Page:
    return Page(text)


def addresses(text: str) -> list[str]:
    """Return everything that a browser would fetch, or follow, from a page."""
    return re.findall(r"""(?:src|href|srcset|poster|action|data)\s*=\s*["']([^"']*)["']|url\(([^)]*)\)|@import\s+(\S+)""", text)


def check_alone(text: str) -> None:
    """Assert that a page fetches nothing, runs nothing, and links only to itself."""
    for groups in addresses(text):
        address = "".join(groups)
        assert address.startswith(("data:image/png;base64,", "#")), address[:80]
    lower = text.lower()
    for word in ("<script", "<link", "<iframe", "http:", "https:", "//cdn", "onload=", "onclick="):
        assert word not in lower


def test_the_page_stands_alone(text: str) -> None:
    check_alone(text)
    assert len(text.encode()) < MOST_BYTES


@pytest.mark.parametrize(
    "fault", ['<img src="picture.png">', '<link rel="stylesheet" href="a.css">', "<style>a { background: url(b.png) }</style>",
              '<script>1</script>', '<a href="https://example.org">x</a>'],
)  # fmt: skip
def test_a_page_that_needs_more_is_noticed(fault: str) -> None:
    with pytest.raises(AssertionError):
        check_alone(f"<body>{fault}</body>")


def test_every_tag_is_closed_and_every_link_leads_somewhere(page: Page) -> None:
    names = [one.get("id") for one in page.elements if one.get("id")]
    assert len(set(names)) == len(names)
    links = [one.get("href", "") for one in page.elements if one.tag == "a"]
    assert {link.removeprefix("#") for link in links} <= set(names)
    assert all(link.startswith("#") for link in links)
    assert all(one.get("alt") for one in page.elements if one.tag == "img")
    views = [one.get("content") for one in page.elements if one.get("name") == "viewport"]
    assert views == ["width=device-width, initial-scale=1"]


def test_every_experiment_is_on_the_page_in_order(page: Page) -> None:
    assert list(page.sections) == [one.name for one in EXPERIMENTS]
    assert [one.get("id") for one in page.elements if one.tag == "h2" and one.get("id")] == list(LECTURES)


@pytest.mark.parametrize("name", [one.name for one in EXPERIMENTS])
def test_the_page_has_what_the_functions_return(page: Page, name: str) -> None:
    section, result = page.sections[name], found(name)

    # The numbers, to the letter.
    head = [list(result.numbers.headings)] if any(result.numbers.headings) else []
    assert section["rows"] == head + [[written(cell) for cell in row] for row in result.numbers.rows]

    # The pictures, to the bit.
    assert section["captions"] == [shown.caption for shown in result.panels]
    for address, shown in zip(section["images"], result.panels, strict=True):
        stored = Image.open(io.BytesIO(base64.b64decode(address.split(",")[1]))).convert("RGB")
        assert np.array_equal(np.asarray(stored), shown.pixels)

    # The idea, the slide, the line that does it, and how to run it.
    one = next(one for one in EXPERIMENTS if one.name == name)
    everything = "".join(section["text"])
    source = one.find_source()
    for part in (one.idea, one.title, one.slide, f"{source.file}:{source.line}", one.statement, f"scanspan lecture run {name}"):
        assert part in everything


def test_pictures_are_small() -> None:
    few, many = np.zeros((90, 90, 3), np.uint8), np.random.default_rng(1).integers(0, 256, (40, 40, 3)).astype(np.uint8)
    few[20:40, 30:50] = (200, 30, 10)
    assert len(small_png(few)) < 250
    for pixels in (few, many):
        assert np.array_equal(np.asarray(Image.open(io.BytesIO(small_png(pixels))).convert("RGB")), pixels)


# The page in the documentation


def as_number(word: str) -> float | None:
    """Return a written number, None for anything else."""
    try:
        return float(word.replace(",", ""))
    except ValueError:
        return None


def test_the_page_in_the_documentation_is_up_to_date(page: Page, repository: Path) -> None:
    path = repository / "docs" / "lectures" / "index.html"
    kept = path.read_text("utf-8")
    check_alone(kept)
    assert path.stat().st_size < MOST_BYTES
    there = Page(kept)
    assert list(there.sections) == list(page.sections)
    for name, section in page.sections.items():
        old = there.sections[name]
        assert old["captions"] == section["captions"], f"{name}: make lectures renews the page"

        # Numbers alike but for rounding, which may differ from machine to machine.
        assert [[row[0], len(row)] for row in old["rows"]] == [[row[0], len(row)] for row in section["rows"]]
        for a, b in zip(chain(*old["rows"]), chain(*section["rows"]), strict=True):
            x, y = as_number(a), as_number(b)
            is_close = x is not None and y is not None and y == pytest.approx(x, rel=1e-3, abs=1e-9)
            assert a == b or is_close, f"{name}: {a}, {b}"


# The commands


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Give a function that runs the command in a folder of its own: exit code, standard output, standard error."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(experiments, "EXPERIMENTS", tuple(cached_experiments()))

    def call(*words):
        code = main(["lecture", *words])
        told = capsys.readouterr()
        return code, told.out, told.err

    return call


def test_list_shows_them_by_lecture_and_slide(run) -> None:
    code, out, err = run("list")
    assert (code, err) == (0, "")
    assert [line.split()[0] for line in out.splitlines()[:-1] if not line.startswith(" ")] == list(LECTURES)
    names = [line.split()[0] for line in out.splitlines() if line.startswith(" ")]
    assert names == [one.name for one in EXPERIMENTS]
    assert "  moving-slivers" in out
    assert "[Triangle Rasterization Issues, lines 371-373]" in out
    assert f"{len(EXPERIMENTS)} experiments; " in out


def test_list_can_be_narrowed(run) -> None:
    _, out, _ = run("list", "--lecture", "1")
    assert {line.split()[0] for line in out.splitlines() if line.startswith(" ")} == {
        one.name for one in EXPERIMENTS if one.lecture == "S1"
    }
    _, out, _ = run("list", "--search", "Hippo")
    assert [line.split()[0] for line in out.splitlines() if line.startswith(" ")] == ["polygonal-approximation"]
    code, out, err = run("list", "--search", "cabbage")
    assert (code, out) == (2, "")
    assert err == f"scanspan: error: --search = 'cabbage': no experiment has it; there are {len(EXPERIMENTS)}\n"
    code, _, err = run("list", "--lecture", "7")
    assert code == 2
    assert "--lecture" in err


def test_run_prints_the_numbers_and_writes_the_picture(run) -> None:
    code, out, err = run("run", "golden-triangles", "-o", "golden.png")
    assert (code, err) == (0, "")
    assert re.search(r"(?m)^triangle \(0, 0\), \(5, 0\), \(5, 5\) +15 +15$", out)
    assert "scanspan/raster/edge.py:" in out
    assert out.endswith("\ngolden.png\n")
    assert np.array_equal(np.asarray(Image.open("golden.png").convert("RGB")), found("golden-triangles").picture)


def test_run_without_an_output_writes_nothing(run) -> None:
    code, out, _ = run("run", "golden-triangles")
    assert code == 0
    assert ".png" not in out
    assert not list(Path().iterdir())


def test_run_writes_into_a_folder(run) -> None:
    code, out, _ = run("run", "checker-shadow", "-o", "new/folder/")
    assert code == 0
    assert out.endswith(str(Path("new/folder/checker-shadow.png")) + "\n")
    assert Path("new/folder/checker-shadow.png").is_file()
    assert run("run", "checker-shadow", "-o", "new")[0] == 0
    assert Path("new/checker-shadow.png").is_file()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("moving-sliver",), "unknown experiment 'moving-sliver'; did you mean 'moving-slivers'?"),
        (("al",), "did you mean 'all'?"),
        (("golden-triangles", "-o", "a.gif"), "--output"),
        (("golden-triangles", "-o", "a.npz"), "--output = 'a.npz': a picture is no .npz; expected .png, .jpg, .ppm or .npy"),
        (("golden-triangles", "-o", "no/a.png"), "--output = 'no/a.png': the folder 'no' does not exist"),
        (("golden-triangles", "-o", ""), "--output"),
        (("all", "-o", "file"), "--output = 'file': expected the name of a folder"),
        ((), "Missing argument 'NAME'"),
    ],
)
def test_what_cannot_be_run_is_refused(run, words: tuple[str, ...], message: str) -> None:
    Path("file").write_text("")
    code, out, err = run("run", *words)
    assert (code, out) == (2, "")
    assert message in err
    assert len(err.splitlines()) == 1


def test_run_all_makes_the_report(run, monkeypatch, text: str) -> None:
    code, out, err = run("run", "all", "-o", "out/")
    assert (code, err) == (0, "")
    assert out == f"{len(EXPERIMENTS)} experiments\n{Path('out/index.html')}\n"
    assert Path("out/index.html").read_text("utf-8") == text

    # On a terminal there is a bar.
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    monkeypatch.setattr(experiments, "EXPERIMENTS", tuple(cached_experiments()[:2]))
    code, out, err = run("run", "all")
    assert code == 0
    assert out == f"2 experiments\n{Path('out/index.html')}\n"
    assert "2/2" in err


def test_lecture_alone_tells_what_there_is(run) -> None:
    code, out, _ = run()
    assert code == 0
    assert "list" in out
    assert "run" in out
