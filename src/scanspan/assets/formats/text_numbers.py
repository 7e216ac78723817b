"""Numbers in text, many of them: one pass over the bytes finds the numbers of every line.

A number with at most 15 digits and a power of ten up to 22 is exact as digits and as power, so one multiplication or division
rounds it as it must be; all others, and what is no number, are left to Python. So every number is the one that float() gives.

Source: W. D. Clinger, "How to read floating point numbers accurately", 1990, section 3 for the simple case.
"""

from __future__ import annotations

import numpy as np

from scanspan.jit import helper_kernel, kernel
from scanspan.records import Float64Array, Int64Array, Integer, UInt8Array

POWERS = np.array([10.0**k for k in range(23)])

MAX_DIGITS = 15

NEWLINE, HASH, SLASH, POINT, PLUS, MINUS, ZERO, NINE = 10, 35, 47, 46, 43, 45, 48, 57
BLANK, COMMA, SEMICOLON, SMALL_E, LARGE_E = 32, 44, 59, 101, 69


@helper_kernel
def is_gap(byte: int) -> bool:
    """Say whether a byte parts numbers: a blank, a comma, a semicolon, a tab, a form feed or a carriage return."""
    return byte in (BLANK, COMMA, SEMICOLON) or (9 <= byte <= 13 and byte != NEWLINE)


@kernel
def scan_rows(
    text: UInt8Array, powers: Float64Array, values: Float64Array, ends: Int64Array, slow: Int64Array
) -> tuple[Integer, Integer, Integer]:
    """Read the numbers of whole lines.

    Parameters
    ----------
    text : ends with a line feed. Blanks, commas, semicolons and tabs part numbers; # and // begin a remark.
    powers : POWERS.
    values : gets the numbers, in order; half as many as bytes have room.
    ends : gets for each line how many numbers there are up to its end.
    slow : (K, 3) gets the first byte, the byte behind and the place in `values` of what is not read here.

    Returns
    -------
    How many lines, numbers, and rows of `slow` there are.
    """
    lines, found, odd = np.int64(0), np.int64(0), np.int64(0)
    k, size = np.int64(0), np.int64(len(text))
    while k < size:
        byte = int(text[k])
        if byte == NEWLINE:
            ends[lines] = found
            lines += 1
            k += 1
            continue
        if is_gap(byte):
            k += 1
            continue
        if byte == HASH or (byte == SLASH and int(text[k + 1]) == SLASH):
            while int(text[k]) != NEWLINE:
                k += 1
            continue

        # Read a sign, and digits with a point among them.
        start = k
        is_negative = byte == MINUS
        if byte in (MINUS, PLUS):
            k += 1
        mantissa, digits, behind, seen, points = np.int64(0), np.int64(0), np.int64(0), np.int64(0), np.int64(0)
        while True:
            byte = int(text[k])
            if ZERO <= byte <= NINE:
                mantissa = mantissa * 10 + (byte - ZERO) if digits < MAX_DIGITS else mantissa
                digits += 1 if mantissa > 0 else 0
                behind += points
                seen += 1
            elif byte == POINT and points == 0:
                points += 1
            else:
                break
            k += 1

        # Read a power of ten.
        power = np.int64(0)
        if byte in (SMALL_E, LARGE_E):
            k += 1
            sign = int(text[k])
            if sign in (MINUS, PLUS):
                k += 1
            seen = np.int64(0) if not ZERO <= int(text[k]) <= NINE else seen
            while ZERO <= int(text[k]) <= NINE:
                power = power * 10 + (int(text[k]) - ZERO) if power < 1000 else power
                k += 1
            power = -power if sign == MINUS else power
        power -= behind

        # Keep the number, or leave it to Python.
        byte = int(text[k])
        is_end = byte == NEWLINE or is_gap(byte)
        if seen > 0 and is_end and digits <= MAX_DIGITS and -22 <= power <= 22:
            value = float(mantissa) * powers[power] if power >= 0 else float(mantissa) / powers[-power]
            values[found] = -value if is_negative else value
        else:
            while int(text[k]) != NEWLINE and not is_gap(int(text[k])):
                k += 1
            slow[odd, 0], slow[odd, 1], slow[odd, 2] = start, k, found
            odd += 1
        found += 1
    return lines, found, odd


def read_rows(text: bytes) -> tuple[Float64Array, Int64Array, list[tuple[int, bytes]]]:
    r"""Return the numbers of whole lines, how many there are up to the end of each line, and what is no number.

    The last is a list of (line, bytes), the first such alone.

    >>> values, ends, odd = read_rows(b"1 2.5e3,nan # a remark\n\n-3\n")
    >>> values.tolist(), ends.tolist(), odd
    ([1.0, 2500.0, nan, -3.0], [3, 3, 4], [])
    """
    content = np.frombuffer(text, np.uint8)
    values, ends = np.empty(len(text) // 2 + 1), np.empty(text.count(b"\n") + 1, np.int64)
    slow = np.empty((len(text) // 2 + 1, 3), np.int64)
    lines, found, odd = scan_rows(content, POWERS, values, ends, slow)
    for first, behind, place in slow[:odd].tolist():
        word = text[first:behind]
        try:
            values[place] = float(word)
        except ValueError:
            word = b"_"
        if b"_" in word:
            line = int(np.searchsorted(ends[:lines], place, side="right"))
            return values[:found], ends[:lines], [(line, text[first:behind])]
    return values[:found], ends[:lines], []
