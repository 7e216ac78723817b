"""The words of a text file: white space, words, numbers and quoted strings, read where the grammar asks for them.

The file stays one string and a place in it; nothing is cut into a list of tokens beforehand. A bracketed list of numbers, which
is where nearly all of a scene lies, is matched as a whole and converted at once: some 0.1 microseconds a number. Commas count
as white space, which reads every file that has them in the right places and some that do not.

Source: Wernecke, The Inventor Mentor, chapter 11, "File Format".
"""

from __future__ import annotations

import re

import numpy as np

from scanspan.errors import InputError
from scanspan.homogeneous import FloatArray

SPACE = re.compile(r"(?:[\s,]++|#[^\n]*+)*+")
WORD = re.compile(r"[^\s,#\"'{}\[\]()|=~\\]++")
NUMBER = re.compile(r"[+-]?(?:0[xX][0-9a-fA-F]++|(?:\d++\.?\d*+|\.\d++)(?:[eE][+-]?\d++)?)(?![\w.])", re.ASCII)
STRING = re.compile(r'"((?:[^"\\]++|\\.)*+)"', re.DOTALL)
LIST = re.compile(r'(?:[^\]#"{}]++|#[^\n]*+)*+')
COMMENT = re.compile(r"#[^\n]*+")
SKIPPED = re.compile(r'(?:[^"#{}\[\]]++|#[^\n]*+)++')

MAX_WORD = 4096  # characters of a word; what is longer is no name


class ReadError(InputError):
    """A place in a file where something else was expected; `place` counts characters or bytes from its start."""

    def __init__(self, problem: str, place: int) -> None:
        self.place = place
        super().__init__(problem)


class Scanner:
    """A place in a text, and what can be read there.

    Parameters
    ----------
    text : the whole file, one character for each byte.
    place : where to begin.
    """

    def __init__(self, text: str, place: int = 0) -> None:
        self.text = text
        self.place = place

    def quote(self) -> str:
        """Return what stands at the next word, for messages."""
        found = self.text[self.place : self.place + 24].split("\n", 1)[0].strip()
        return repr(found) if found else "the end of the file" if self.place >= len(self.text) else "the end of the line"

    def fail(self, expected: str) -> ReadError:
        """Return the error that something else was expected here."""
        self.skip_space()
        return ReadError(f"expected {expected}, got {self.quote()}", self.place)

    def skip_space(self) -> int:
        """Go over white space, commas and comments, and return the place."""
        found = SPACE.match(self.text, self.place)
        self.place = found.end() if found else self.place
        return self.place

    def peek(self) -> str:
        """Return the next character that is no white space, "" at the end; it is not taken."""
        self.skip_space()
        return self.text[self.place : self.place + 1]

    def take(self, mark: str) -> bool:
        """Take a mark if it stands next."""
        if self.peek() != mark:
            return False
        self.place += 1
        return True

    def expect(self, mark: str) -> None:
        """Take a mark that has to stand next."""
        if not self.take(mark):
            raise self.fail(repr(mark))

    def word(self, expected: str) -> str:
        """Return the next word."""
        found = self.peek_word()
        if not found:
            raise self.fail(expected)
        self.place += len(found)
        return found

    def peek_word(self) -> str:
        """Return the next word without taking it, "" where none stands."""
        self.skip_space()
        found = WORD.match(self.text, self.place, self.place + MAX_WORD)
        return found[0] if found else ""

    def text_value(self) -> str:
        """Return a quoted string, or a word without quotes."""
        if self.peek() != '"':
            return self.word("a string")
        found = STRING.match(self.text, self.place)
        if not found:
            raise ReadError('expected a string that ends with ", got the end of the file', self.place)
        self.place = found.end()
        return found[1].replace('\\"', '"').replace("\\\\", "\\") if "\\" in found[1] else found[1]

    def number(self) -> float:
        """Return one number."""
        self.skip_space()
        found = NUMBER.match(self.text, self.place)
        if not found:
            raise self.fail("a number")
        self.place = found.end()
        return to_number(found[0])

    def numbers(self, count: int) -> FloatArray:
        """Return so many numbers."""
        return np.array([self.number() for _ in range(count)], dtype=np.float64)

    def number_list(self, width: int) -> FloatArray:
        """Return the numbers in brackets, whose opening one is taken; they must come in rows of a width."""
        start = self.place
        found = LIST.match(self.text, start)
        end = found.end() if found else start
        if self.text[end : end + 1] != "]":
            self.place = end
            raise self.fail("']' after a list of numbers")
        # Go on behind the list whatever is in it: what were read again could be read again and again.
        self.place = end + 1
        listed = self.text[start:end]
        if "#" in listed:
            listed = COMMENT.sub(" ", listed)
        words = listed.replace(",", " ").split()
        try:
            values = np.array(list(map(float, words)), dtype=np.float64)
        except ValueError:
            values = self._mixed_numbers(words, start)
        if len(values) % width:
            raise ReadError(f"expected numbers in rows of {width}, got {len(values)} of them", start)
        return values

    def _mixed_numbers(self, words: list[str], start: int) -> FloatArray:
        """Return numbers among which some are hexadecimal; raise for the first that is none."""
        values = []
        for word in words:
            if not NUMBER.fullmatch(word):
                place = max(self.text.find(word, start), start)
                raise ReadError(f"expected a number or ']', got {word[:24]!r}", place)
            values.append(to_number(word))
        return np.array(values, dtype=np.float64)

    def skip_block(self) -> None:
        """Go over what stands up to the closing brace that belongs to one already taken; to the end where there is none."""
        depth = 1
        while self.place < len(self.text):
            mark = self.text[self.place]
            if mark == '"':
                found = STRING.match(self.text, self.place)
                self.place = found.end() if found else len(self.text)
            elif mark in "{}[]":
                self.place += 1
                depth += {"{": 1, "}": -1}.get(mark, 0)
                if depth == 0:
                    return
            else:
                found = SKIPPED.match(self.text, self.place)
                self.place = found.end() if found else self.place + 1

    def skip_value(self) -> None:
        """Go over one thing: a string, a list, a block, a word or a mark."""
        mark = self.peek()
        if mark == '"':
            found = STRING.match(self.text, self.place)
            self.place = found.end() if found else len(self.text)
        elif mark == "[":
            self.place += 1
            depth = 1
            while depth and self.peek() not in ("", "}"):
                here = self.peek()
                depth += {"[": 1, "]": -1}.get(here, 0)
                if here in "[]":
                    self.place += 1
                else:
                    self.skip_value()
        elif mark == "{":
            self.place += 1
            self.skip_block()
        else:
            self.place += len(self.peek_word()) or 1


def to_number(word: str) -> float:
    """Return a number written in decimals or as 0xff.

    >>> to_number("0xff"), to_number("-1.5e2")
    (255.0, -150.0)
    """
    if "x" in word or "X" in word:
        return float(int(word, 16)) if len(word) < 20 else float("inf")
    return float(word)
