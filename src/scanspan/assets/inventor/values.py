"""Values of fields: how each type stands in a text and in a binary file.

One value is a number, a truth, a string, a node, or an array; many numbers are one array, one row a value. A rotation is kept
as the quaternion x y z w that binary files have; texts give an axis and an angle. A matrix is kept as it stands, for rows.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scanspan.assets.inventor.binary import BinaryScanner
from scanspan.assets.inventor.nodes import NUMBERS, TEXTS, WHOLE_NUMBERS, WIDTHS, FieldType
from scanspan.assets.inventor.tokens import ReadError, Scanner
from scanspan.homogeneous import FloatArray

CODES = {"Int32": ">i4", "Long": ">i4", "UInt32": ">u4", "ULong": ">u4", "Short": ">i4", "UShort": ">u4"}
DOUBLES = {"Double": ">f8", "Time": ">f8", "Vec3d": ">f8"}
MAX_WORDS = 64  # of a bit mask


def quaternion(axis_angle: FloatArray) -> FloatArray:
    """Return the quaternions x y z w of rotations (..., 4) about x y z by an angle in radians; no axis turns nothing."""
    axis, half = axis_angle[..., :3], axis_angle[..., 3:] * 0.5
    largest = np.abs(axis).max(axis=-1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        unit = np.where(largest > 0, axis / largest, 0.0)
        unit = unit / np.sqrt((unit * unit).sum(axis=-1, keepdims=True))
        turned = np.concatenate([unit * np.sin(half), np.cos(half)], axis=-1)
    still = ~np.isfinite(turned).all(axis=-1) | (largest[..., 0] == 0)
    turned[still] = (0.0, 0.0, 0.0, 1.0)
    return np.asarray(turned)


def _shape(values: FloatArray, field: FieldType) -> Any:
    """Return numbers in the shape of their type."""
    if field.kind in WIDTHS:
        values = values.reshape(-1, WIDTHS[field.kind])
        values = values.reshape(-1, 4, 4) if field.kind == "Matrix" else values
    elif field.kind in WHOLE_NUMBERS:
        values = np.clip(np.nan_to_num(values, nan=0.0), -(2.0**31), 2.0**32 - 1).astype(np.int64)
    if field.is_many:
        return values
    value = values[0]
    return value if field.kind in WIDTHS else int(value) if field.kind in WHOLE_NUMBERS else float(value)


# Texts


def text_value(scanner: Scanner, field: FieldType) -> Any:
    """Return the value of a field that is no node, from a text."""
    kind = field.kind
    width = WIDTHS.get(kind, 1)
    if kind in WIDTHS or kind in NUMBERS:
        if field.is_many and scanner.take("["):
            values = scanner.number_list(width)
        else:
            values = scanner.numbers(width)
        return _shape(quaternion(values.reshape(-1, 4)).reshape(-1) if kind == "Rotation" else values, field)
    if kind in ("Image", "Image3"):
        return _text_image(scanner, 2 if kind == "Image" else 3)
    if kind == "Trigger":
        return None
    if not field.is_many or not scanner.take("["):
        value = _text_single(scanner, field)
        return [value] if field.is_many else value
    listed = []
    while not scanner.take("]"):
        if scanner.peek() in ("", "}"):
            raise scanner.fail("']' after a list")
        listed.append(_text_single(scanner, field))
    return listed


def _text_single(scanner: Scanner, field: FieldType) -> Any:
    """Return one text, truth or set of words."""
    if field.kind in ("String", "Name"):
        return scanner.text_value()
    if field.kind == "Bool":
        word = scanner.peek_word().upper()
        if word not in ("TRUE", "FALSE", "0", "1"):
            raise scanner.fail("TRUE or FALSE")
        scanner.word("TRUE or FALSE")
        return word in ("TRUE", "1")
    if field.kind == "BitMask":
        return _text_words(scanner)
    place = scanner.skip_space()
    return _choose(scanner.word("a word"), field, place)


def _choose(word: str, field: FieldType, place: int) -> str:
    """Return a word of an enumeration."""
    if field.words and word not in field.words:
        raise ReadError(f"expected one of {', '.join(field.words)}, got {word[:40]!r}", place)
    return word


def _text_words(scanner: Scanner) -> tuple[str, ...]:
    """Return the words of a bit mask, one or several in parentheses with bars between them."""
    if not scanner.take("("):
        return (scanner.word("a word"),)
    words: list[str] = []
    while not scanner.take(")"):
        if words and not scanner.take("|"):
            raise scanner.fail("'|' or ')'")
        if len(words) == MAX_WORDS:
            raise scanner.fail(f"at most {MAX_WORDS} words")
        words.append(scanner.word("a word"))
    return tuple(words)


def _text_image(scanner: Scanner, axes: int) -> NDArray[np.uint8]:
    """Return a picture, rows from the bottom, (h, w, channels) or (d, h, w, channels)."""
    place = scanner.place
    sides = scanner.numbers(axes + 1)
    shape = _image_shape(sides, place, (len(scanner.text) - scanner.place) // 2 + 1)
    channels = shape[-1]
    values = scanner.numbers(math.prod(shape[:-1]))
    if values.size and not ((values >= 0) & (values < 2.0**32)).all():
        raise ReadError("expected pixels from 0 to 0xffffffff", place)
    words = values.astype(np.uint32).astype(">u4").view(np.uint8).reshape(-1, 4)
    return np.ascontiguousarray(words[:, 4 - channels :]).reshape(shape)


def _image_shape(sides: FloatArray, place: int, most: int) -> tuple[int, ...]:
    """Return the shape of a picture that has the sides x, y, z and then the number of channels."""
    shown = " ".join(f"{side:g}" for side in sides)
    if (
        not all(side >= 0 and side == int(side) for side in sides.tolist() if math.isfinite(side))
        or not np.isfinite(sides).all()
    ):
        raise ReadError(f"expected the sides of a picture and its channels, got {shown}", place)
    whole = [int(side) for side in sides.tolist()]
    shape = (*reversed(whole[:-1]), whole[-1])
    if 0 in shape:
        return (*(0 for _ in shape[:-1]), max(1, min(shape[-1], 4)))
    if whole[-1] > 4 or math.prod(whole[:-1]) > most:
        raise ReadError(f"expected a picture of 1 to 4 channels that fits the file, got {shown}", place)
    return shape


# Binary files


def binary_value(scanner: BinaryScanner, field: FieldType) -> Any:
    """Return the value of a field that is no node, from a binary file."""
    kind = field.kind
    if kind in WIDTHS or kind in NUMBERS:
        code = DOUBLES.get(kind) or CODES.get(kind) or ">f4"
        width = WIDTHS.get(kind, 1)
        size = width * np.dtype(code).itemsize
        count = scanner.count(size, "a number of values") if field.is_many else 1
        with np.errstate(invalid="ignore"):
            return _shape(scanner.array(count * width, code).astype(np.float64), field)
    if kind in ("Image", "Image3"):
        place = scanner.place
        sides = scanner.array(3 if kind == "Image" else 4, ">i4").astype(np.float64)
        shape = _image_shape(sides, place, scanner.left)
        if scanner.has_wide_pixels:
            words = scanner.array(math.prod(shape[:-1]), ">u4").view(np.uint8).reshape(-1, 4)
            return np.ascontiguousarray(words[:, 4 - shape[-1] :]).reshape(shape)
        pixels = scanner.take(math.prod(shape), "the pixels of a picture")
        return np.frombuffer(pixels, np.uint8).reshape(shape)
    if kind == "Trigger":
        return None
    if not field.is_many:
        return _binary_single(scanner, field)
    return [_binary_single(scanner, field) for _ in range(scanner.count(4, "a number of values"))]


def _binary_single(scanner: BinaryScanner, field: FieldType) -> Any:
    """Return one text, truth or set of words."""
    if field.kind == "Bool":
        return scanner.integer() != 0
    if field.kind == "BitMask":
        words: list[str] = []
        while word := scanner.word("a word of a bit mask"):
            words.append(word)
            if len(words) > MAX_WORDS:
                raise ReadError(f"expected at most {MAX_WORDS} words of a bit mask", scanner.place)
        return tuple(words)
    assert field.kind in TEXTS
    place = scanner.place
    return scanner.text_value() if field.kind in ("String", "Name") else _choose(scanner.word("a word"), field, place)
