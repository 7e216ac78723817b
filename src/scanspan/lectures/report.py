"""The report: all experiments on one page, in the order of the lectures: the idea, pictures, numbers, the line that does it.

The page is one file. Pictures are in it as PNGs with as few colours as they have, small where pixels are the point, and shown
large by the browser; the style is in it too, and nothing is fetched from anywhere.

Source: the lectures; `experiments` for what is shown.
"""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Callable, Sequence
from importlib import resources

import numpy as np
from PIL import Image

from scanspan.lectures.experiments.experiment import Experiment, Result, Source, Table, written
from scanspan.lectures.experiments.figure import Panel
from scanspan.records import UInt8Array

LECTURES = {
    "S0": "Scan converting triangles (C#)",
    "S1": "Edge equations and rasterization issues",
    "S2": "Rasterization: colour, lines, fills, interpolation",
    "S3": "Scan-line hidden surfaces, homogeneous coordinates",
    "S4": "Scan converting triangles (Java, 12 bits)",
}
MOST_COLORS = 256


def small_png(pixels: UInt8Array) -> bytes:
    """Return pixels (H, W, 3) as a PNG file, with a palette where there are few enough colours.

    >>> len(small_png(np.zeros((64, 64, 3), np.uint8))) < 200
    True
    """
    packed = pixels.astype(np.int64) @ np.array([1 << 16, 1 << 8, 1])
    colors, numbers = np.unique(packed, return_inverse=True)
    if len(colors) <= MOST_COLORS:
        image = Image.fromarray(numbers.reshape(packed.shape).astype(np.uint8))
        image.putpalette(np.stack([colors >> 16, colors >> 8 & 255, colors & 255], axis=1).astype(np.uint8).tobytes())
    else:
        image = Image.fromarray(pixels)
    written_to = io.BytesIO()
    image.save(written_to, "PNG", optimize=True)
    return written_to.getvalue()


def figure(shown: Panel) -> str:
    """Return a panel as HTML."""
    address = base64.b64encode(small_png(shown.pixels)).decode()
    height, width = shown.pixels.shape[:2]
    across, down = width * shown.scale, height * shown.scale
    kind = ' class="pixels"' if shown.scale > 1 else ""
    caption = html.escape(shown.caption)
    return (
        f'<figure style="width:{across}px"><img{kind} width="{across}" height="{down}" loading="lazy" alt="{caption}" '
        f'src="data:image/png;base64,{address}"/><figcaption>{caption}</figcaption></figure>'
    )


def number_table(numbers: Table) -> str:
    """Return a table as HTML."""
    is_word = [k == 0 or all(isinstance(row[k], str) for row in numbers.rows) for k in range(len(numbers.headings))]
    kinds = ["" if word else ' class="n"' for word in is_word]
    head = ""
    if any(numbers.headings):
        cells = "".join(f"<th{kind}>{html.escape(name)}</th>" for name, kind in zip(numbers.headings, kinds, strict=True))
        head = f"<thead><tr>{cells}</tr></thead>"
    rows = "".join(
        "<tr>"
        + "".join(f"<td{kind}>{html.escape(written(cell))}</td>" for cell, kind in zip(row, kinds, strict=True))
        + "</tr>"
        for row in numbers.rows
    )
    return f'<div class="scroll"><table>{head}<tbody>{rows}</tbody></table></div>'


def code_block(source: Source) -> str:
    """Return the line that does it as HTML, and the lines around it to be unfolded."""
    code, marked = source.code.split("\n"), source.line - source.first
    lines = [f'<span class="l">{n:>4}</span> {html.escape(line)}' for n, line in enumerate(code, start=source.first)]
    lines[marked] = f"<mark>{lines[marked]}</mark>"
    return "\n".join(
        (
            f'<p class="where">The line that does it, in <code>{html.escape(source.file)}:{source.line}</code></p>',
            f'<pre class="one">{html.escape(code[marked].strip())}</pre>',
            "<details><summary>with the lines around it</summary><pre>" + "\n".join(lines) + "</pre></details>",
        )
    )


def section(one: Experiment, found: Result) -> str:
    """Return an experiment as HTML."""
    slips = "" if not one.slips else f" · slip {', '.join(map(str, one.slips))}"
    items = ", ".join(map(str, one.items))
    parts = [
        f'<section id="{one.name}"><h3><a href="#{one.name}">{html.escape(one.title)}</a></h3>',
        f'<p class="slide">{one.lecture}, “{html.escape(one.slide)}”, {one.told_lines} · item {items}{slips}</p>',
        f'<p class="idea">{html.escape(one.idea)}</p>',
        f'<div class="panels">{"".join(map(figure, found.panels))}</div>',
        number_table(found.numbers),
        code_block(one.find_source()),
        f'<p class="run"><code>scanspan lecture run {one.name}</code></p></section>',
    ]
    return "\n".join(parts)


def write_page(experiments: Sequence[Experiment], step: Callable[[Experiment, int], None] = lambda one, number: None) -> str:
    """Run experiments and return the page as HTML.

    Parameters
    ----------
    experiments : in the order of the lectures.
    step : told each experiment and its number before it is run.
    """
    contents, body, lecture = list[str](), list[str](), ""
    for number, one in enumerate(experiments):
        step(one, number)
        found = one.run()
        if one.lecture != lecture:
            lecture = one.lecture
            title = html.escape(LECTURES[lecture])
            contents.append(f"{'</ol>' if contents else ''}<h3>{lecture} <span>{title}</span></h3><ol>")
            body.append(f'<h2 id="{lecture}">{lecture} <span>{title}</span></h2>')
        contents.append(f'<li><a href="#{one.name}">{html.escape(one.title)}</a></li>')
        body.append(section(one, found))
    contents.append("</ol>" if contents else "")
    page = resources.files("scanspan.lectures").joinpath("report.html").read_text("utf-8")
    style = resources.files("scanspan.lectures").joinpath("report.css").read_text("utf-8")
    return page.replace("{style}", style).replace("{contents}", "\n".join(contents)).replace("{body}", "\n".join(body))
