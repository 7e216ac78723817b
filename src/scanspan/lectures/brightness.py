"""Three numbers that a slide takes for one; S2, lines 51-61.

The slide writes intensity as .333 R + .333 G + .333 B and calls it I, V and B of HSI, HSV and HSB. The plain mean is I of HSI
alone: V of HSV, which is B of HSB, is the largest channel. And three times .333 is .999, so white comes out a little grey.
"""

from __future__ import annotations

from typing import NamedTuple

from scanspan.color import intensity, luma_601, rgb_to_hsv


class Averages(NamedTuple):
    """What is called the average of white and of pure colours, on a scale of 255."""

    white_as_printed: float  # .333 R + .333 G + .333 B
    white: float  # their mean
    intensities: tuple[float, float, float]  # of red, green and blue
    values: tuple[float, float, float]  # V of HSV of these
    lumas: tuple[float, float, float]  # Y of YIQ of these: what the eye weighs


def demonstrate_averages() -> Averages:
    """Take the averages of white, red, green and blue.

    >>> demonstrate_averages().white_as_printed, demonstrate_averages().values
    (254.745, (255.0, 255.0, 255.0))
    """
    primaries = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    of_red, of_green, of_blue = (255.0 * float(value) for value in intensity(primaries))
    red_value, green_value, blue_value = (255.0 * float(value) for value in rgb_to_hsv(primaries)[:, 2])
    red_luma, green_luma, blue_luma = (255.0 * float(value) for value in luma_601(primaries))
    return Averages(
        white_as_printed=round(255 * 0.333 + 255 * 0.333 + 255 * 0.333, 9),
        white=255.0 * float(intensity((1.0, 1.0, 1.0))),
        intensities=(of_red, of_green, of_blue),
        values=(red_value, green_value, blue_value),
        lumas=(red_luma, green_luma, blue_luma),
    )
