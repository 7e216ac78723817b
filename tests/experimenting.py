"""Experiments run once in a process, for all tests that look at what they found."""

from __future__ import annotations

from functools import cache

from scanspan.lectures.experiments import EXPERIMENTS, Experiment, Result, find_experiment


@cache
def found(name: str) -> Result:
    """Return what an experiment found."""
    return find_experiment(name).run()


def number(name: str, row: object, column: str | int = 1) -> object:
    """Return one number of an experiment's table."""
    return found(name).numbers.value(row, column)


def cached_experiments() -> list[Experiment]:
    """Return all experiments, each of which gives what it has found before."""
    return [one._replace(function=lambda name=one.name: found(name)) for one in EXPERIMENTS]
