"""The report on the lectures and the commands that make it: one page with everything in it, and nothing from elsewhere."""

from __future__ import annotations

import base64
import io
import re
import sys
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from scanspan.cli import main
from scanspan.lectures import experiments
from scanspan.lectures.experiments import EXPERIMENTS
from scanspan.lectures.experiments.experiment import written
from scanspan.lectures.report import LECTURES, small_png, write_page
from tests.experimenting import cached_experiments, found

VOID = {"meta", "img", "link", "br", "hr", "input"}
MOST_BYTES = 3_000_000


class Page(HTMLParser):
    """What stands on a page: sections with their tables and pictures, links, and tags that are not closed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.sections: dict[str, dict[str, list]] = {}
        self.current: dict[str, list] = {"rows": [], "images": [], "captions": [], "text": []}
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        named = dict(attrs)
        self.tags.append((tag, named))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "section":
            self.current = self.sections[named["id"]] = {"rows": [], "images": [], "captions": [], "text": []}
        elif tag == "tr":
            self.current["rows"].append([])
        elif tag in ("td", "th"):
            self.current["rows"][-1].append("")
        elif tag == "img":
            self.current["images"].append(named["src"])
        elif tag == "figcaption":
            self.current["captions"].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in ("td", "th"):
            self.current["rows"][-1][-1] += data
        elif self.open and self.open[-1] == "figcaption":
            self.current["captions"][-1] += data
        self.current["text"].append(data)


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
    assert page.open == []
    names = {named["id"] for _, named in page.tags if "id" in named}
    links = [named["href"] for tag, named in page.tags if tag == "a"]
    assert {link[1:] for link in links} <= names
    assert all(link.startswith("#") for link in links)
    assert all(named.get("alt") for tag, named in page.tags if tag == "img")
    assert [named.get("content") for tag, named in page.tags if named.get("name") == "viewport"] == [
        "width=device-width, initial-scale=1"
    ]


def test_every_experiment_is_on_the_page_in_order(page: Page) -> None:
    assert list(page.sections) == [one.name for one in EXPERIMENTS]
    assert [named["id"] for tag, named in page.tags if tag == "h2" and "id" in named] == list(LECTURES)


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
        for a, b in zip(sum(old["rows"], []), sum(section["rows"], []), strict=True):
            x, y = as_number(a), as_number(b)
            assert a == b or (x is not None and y is not None and y == pytest.approx(x, rel=1e-3, abs=1e-9)), f"{name}: {a}, {b}"


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
    assert "triangle (0, 0), (5, 0), (5, 5)      15                    15" in out
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
    assert "2/2" in err or EXPERIMENTS[0].name in err


def test_lecture_alone_tells_what_there_is(run) -> None:
    code, out, _ = run()
    assert code == 0
    assert "list" in out
    assert "run" in out
