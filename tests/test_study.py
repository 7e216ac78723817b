"""The commands to study with: explain, and algorithms."""

from __future__ import annotations

import contextlib
import re
import signal
import sys
from pathlib import Path

import pytest

import scanspan as ss
from scanspan.cli import main


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Give a function that runs the command beside a small model: exit code, standard output, standard error."""
    (tmp_path / "model.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    monkeypatch.chdir(tmp_path)

    def call(*words):
        code = main(words)
        written = capsys.readouterr()
        return code, written.out, written.err

    return call


def test_explain_prints_what_decided(run):
    code, out, _ = run("explain", "model.obj", "--pixel", "60,45", "--size", "120x90")
    assert code == 0
    assert re.match(r"pixel \(60, 45\) shows primitive \d+; \d+ triangles came near", out)
    assert "visible" in out
    for pixel, message in (("60", "--pixel = '60': expected X,Y, two whole numbers"), ("120,0", "x = 120: must be a whole")):
        code, out, err = run("explain", "model.obj", "--pixel", pixel, "--size", "120x90")
        assert code == 2
        assert message in err
        assert out == ""


def test_algorithms_says_that_all_are_identical(run):
    code, out, _ = run("algorithms", "model.obj", "--size", "64x48", "--repeats", "1")
    assert code == 0
    assert out.splitlines()[-1] == "all identical"
    for name in (*ss.ALGORITHMS, *ss.ORDERS):
        assert name in out


def test_algorithms_notices_a_difference(run, monkeypatch):
    from scanspan.raster import algorithms

    monkeypatch.setitem(algorithms.KERNELS, "edge-walk", {"rows": dict.fromkeys(algorithms.KINDS, lambda *arguments: None)})
    code, out, _ = run("algorithms", "model.obj", "--size", "64x48", "--repeats", "1")
    assert code == 1
    assert "DIFFERENT" in out


def test_an_interrupt_that_a_library_swallows_still_ends_the_command(run, monkeypatch):
    from scanspan.assets import load as module

    real = module.load

    def load(*arguments, **options):
        with contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        return real(*arguments, **options)

    monkeypatch.setattr(module, "load", load)
    code, out, err = run("render", "model.obj", "-o", "picture.png", "--size", "64")
    assert (code, out, err) == (130, "", "scanspan: interrupted\n")
    assert not Path("picture.png").exists()


def test_a_command_without_standard_output_still_does_its_work(run, monkeypatch):
    monkeypatch.setattr("sys.stdout", None)
    assert main(["render", "model.obj", "-o", "picture.png", "--size", "64"]) == 0
    assert Path("picture.png").exists()


def test_an_empty_picture_is_said(run):
    code, out, err = run("render", "model.obj", "-o", "picture.png", "--size", "64", "--camera-position", "5,5,5",
                         "--camera-focal-point", "9,9,9")  # fmt: skip
    assert code == 0
    assert out == "picture.png\n"
    assert "nothing of the model is in the picture" in err


def test_finer_corners_can_be_asked_for(run):
    assert run("render", "model.obj", "-o", "a.png", "--size", "64", "--subpixel-bits", "16")[0] == 0
    code, _, err = run("render", "model.obj", "-o", "a.png", "--size", "64", "--subpixel-bits", "3")
    assert code == 2
    assert "--subpixel-bits = 3: must be a whole number from 4 to 16" in err


def test_a_file_is_described_whatever_its_name_is(run, tmp_path):
    path = tmp_path / "model.bin"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 nan 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n")
    assert run("info", str(path))[0] == 2
    code, _, complaint = run("info", str(path), "--file-type", "obj")
    assert (code, "not finite" in complaint) == (2, True)
    code, out, _ = run("info", str(path), "--file-type", "obj", "--nonfinite", "drop", "--json")
    assert code == 0
    assert '"triangles": 1' in out


def test_an_interrupt_while_the_command_is_imported_ends_as_later_ones_do(monkeypatch, capsys):
    from scanspan import __main__ as entry

    class Interrupted:
        def __getattr__(self, name):
            raise KeyboardInterrupt

    monkeypatch.setitem(sys.modules, "scanspan.cli", Interrupted())
    assert entry.main() == 130
    assert capsys.readouterr().err == "scanspan: interrupted\n"
