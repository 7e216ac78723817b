"""The questions that the slides ask, each with an answer in a few words and the item that shows it."""

from __future__ import annotations

from typing import NamedTuple


class Question(NamedTuple):
    """One question, the items of the lectures that answer it, and the answer."""

    question: str
    numbers: tuple[str, ...]
    answer: str


# fmt: off
QUESTIONS: tuple[Question, ...] = (
    Question("Why do three edges take more numbers than three points?", ("7",), "each line has a free factor: 9 - 3 = 6"),
    Question("What is convex, and what is it good for?", ("8",), "segments stay inside; so a row has one span"),
    Question("What happens for upright lines?", ("21", "22"), "the slope form divides by 0; the multiplied form does not"),
    Question("Which side is in?", ("23",), "it depends on the order of the corners and on the direction of y"),
    Question("Why may C be chosen?", ("24",), "the factor is free, and this choice needs no division"),
    Question("What does a positive C mean?", ("39",), "the origin is on the edge's inner side"),
    Question("Exercise 2: flags, sort table, box?", ("41",), "signs of A and B as a code for which corner is leftmost"),
    Question("What of pixels exactly on an edge?", ("44", "45", "46"), "one of the two neighbours owns them, by a rule"),
    Question("Is the matrix of the plane equations familiar?", ("57",), "yes: an edge's value over 2A is a weight"),
    Question("How are lines drawn faster?", ("65", "66"), "reuse the last step, and double everything to stay whole"),
    Question("What is wrong with flood fill?", ("69", "70"), "4 N + 1 calls, deep recursion, flags, and it needs a seed"),
    Question("What is inside on a row?", ("72",), "what has an odd number of crossings to its left"),
    Question("How long does the edge table take?", ("83",), "edges and rows, if they are counted into buckets"),
    Question("What do the two sorts save?", ("86",), "by y: one look per row; by x: a merge instead of a sort"),
    Question("How are crossings noticed?", ("86",), "neighbours are out of order after a step; each swap is one crossing"),
    Question("How is the matching edge found?", ("87",), "the next one of that polygon in the list"),
    Question("What coherence is used?", ("92", "98"), "an edge goes on in the next row, a span at the next pixel"),
    Question("Is there a picture without storing a row?", ("90", "93"), "yes, by a list of active spans"),
    Question("Which bucket, which start values, which end, which pixels?", ("95",), "one rule: half open, at centres"),
    Question("How about polygons that are concave or cross themselves?", ("97",), "several spans a row, by a fill rule"),
    Question("Which scenes have no coherence?", ("98",), "those of parts smaller than pixels: grass, hair, clouds of points"),
    Question("Which (X, Y, W) has no image?", ("101",), "(0, 0, 0), which is no point"),
    Question("What is the limit as W goes to 0?", ("102",), "an ideal point, from both sides the same"),
    Question("Which point is on two lines?", ("104", "106"), "their cross product"),
    Question("What if points or lines coincide, or lines are parallel?", ("105", "106", "107"),
             "nothing, or an ideal point"),
    Question("What is it like in space?", ("108",), "points and planes are dual, lines have six numbers"),
    Question("Where does the eye go?", ("111",), "to the ideal point (0, 0, 1, 0)"),
    Question("What lies on the image of the plane through it?", ("113",), "the points at infinity"),
    Question("Where do the projection plane and infinity go?", ("114", "115"), "to z' = -1 and (f + n) / (f - n)"),
    Question("How is depth interpolated?", ("116",), "as z / w, which is linear on the screen"),
    Question("Which check is darker, and why are shadows soft?", ("117",), "neither; because lamps have a size"),
)
# fmt: on
