"""Products of signals with functions of the bases' angles that couple them: each harmonic carries lines to others.

Signals fall into groups that couple among themselves alone. The functions of a group are a matrix for each of its
harmonics; one compiled pass over all lines and terms then makes all products.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from exugear.steady.harmonics.lines import LineSet
from fe_ste.tools.arrays import Complexes, Floats, Integers
from fe_ste.tools.compilation import kernel
from fe_ste.tools.inner_kernels import kept_bundle
from fe_ste.tools.octets import SIZE, all_eight, eight, put


def fourier_coefficients(samples: Floats, harmonics: int) -> Complexes:
    """Coefficients c_0 .. c_h of a real function sum_h c_h e^(i h theta) from samples over a period.

    Examples
    --------
    >>> theta = 2.0 * np.pi * np.arange(8) / 8
    >>> np.abs(fourier_coefficients(3.0 + np.cos(2.0 * theta), 3)).round(12)
    array([3. , 0. , 0.5, 0. ])
    """
    return np.asarray(np.fft.rfft(samples)[: harmonics + 1] / len(samples))


@dataclass(frozen=True, eq=False)
class Group:
    """Signals that functions of the same angles couple."""

    begin: int
    size: int
    """First signal, and number of them."""
    harmonics: Integers
    """(q, bases) multiples of the bases' angles that the functions have, of each pair k, -k both."""


class Terms(NamedTuple):
    """Terms of the products of g groups on n lines: which lines each line takes in."""

    begin: Integers
    size: Integers
    """(g,) first signal and number of signals of each group."""
    room: Integers
    """(g,) number of signals filled up to whole octets, as coefficients and products stand in memory."""
    first: Integers
    """(g, n + 1) first term of each line in the arrays that follow."""
    place: Integers
    mirrored: Integers
    """(t,) line that is taken in, and whether as its conjugate."""
    block: Integers
    """(t,) first coefficient of the harmonic that carries it."""


@dataclass(frozen=True, eq=False)
class Coupling:
    """Products of the signals of some groups with functions of the bases' angles, as maps of lines."""

    lines: LineSet
    groups: tuple[Group, ...]
    """One after the other they have all signals."""

    @cached_property
    def terms(self) -> Terms:
        """All terms, group by group and line by line."""
        first: list[Integers] = []
        parts: list[tuple[Integers, Integers, Integers]] = []
        terms = blocks = 0
        for group in self.groups:
            # The mean is its own conjugate, and is found as it stands.
            place, mirrored = self.lines.find(self.lines.index[:, None, :] - group.harmonics)
            line, at = np.nonzero(place >= 0)
            coefficients = group.size * _filled(group.size)
            first.append(terms + np.searchsorted(line, np.arange(len(self.lines.index) + 1)))
            parts.append((place[line, at], mirrored[line, at].astype(np.int64), blocks + coefficients * at))
            terms = terms + len(line)
            blocks = blocks + coefficients * len(group.harmonics)
        places, conjugates, at_blocks = (np.concatenate(own) for own in zip(*parts, strict=True))
        begin, size, room = (
            np.array(own, dtype=np.int64)
            for own in zip(*((own.begin, own.size, _filled(own.size)) for own in self.groups), strict=True)
        )
        return Terms(begin, size, room, np.array(first), places, conjugates, at_blocks)

    def memory(self) -> tuple[Floats, Floats]:
        """Make memory (lines times the room of all groups,) for products, real and imaginary parts."""
        size = len(self.lines.index) * int(self.terms.room.sum())
        return np.empty(size), np.empty(size)

    def of(self, functions: Sequence[Complexes], values: Complexes) -> Complexes:
        """Products (n, k) of signals (n, k) with functions.

        Parameters
        ----------
        functions : (q, size, size)
            By group: coefficients at its harmonics, rows what signals take in and columns what they give.
        values : (n, k)
        """
        real, imaginary = self.memory()
        take_in(kept_bundle(self.terms), *flat(functions), np.ascontiguousarray(values, complex), real, imaginary)
        whole = (real + 1j * imaginary).reshape(len(values), -1)
        ends = np.cumsum(self.terms.room)
        return np.hstack(
            [
                whole[:, end - _filled(group.size) :][:, : group.size]
                for group, end in zip(self.groups, ends, strict=True)
            ]
        )


def _filled(size: int) -> int:
    """Whole octets."""
    return -(-size // SIZE) * SIZE


def flat(functions: Sequence[Complexes]) -> tuple[Floats, Floats]:
    """Real and imaginary parts of functions (..., rows, columns) as kernels read them.

    One column after the other, rows filled up to whole octets.
    """
    parts = []
    for function in functions:
        columns = np.zeros((*function.shape[:-2], function.shape[-1], _filled(function.shape[-2])), dtype=complex)
        columns[..., : function.shape[-2]] = np.swapaxes(function, -1, -2)
        parts.append(columns.ravel())
    whole = np.concatenate(parts)
    return np.ascontiguousarray(whole.real), np.ascontiguousarray(whole.imag)


@kernel
def take_in(
    terms: Terms, real: Floats, imaginary: Floats, values: Complexes, out_real: Floats, out_imaginary: Floats
) -> None:
    """Fill products (n times all rooms,) of signals (n, k) and functions as `flat` has them."""
    room = 0
    for group in range(terms.room.size):
        room += terms.room[group]
    to = 0
    for group in range(terms.room.size):
        begin = terms.begin[group]
        size = terms.size[group]
        rows = terms.room[group]
        for octet in range(0, rows, SIZE):
            for line in range(values.shape[0]):
                x = all_eight(0.0)
                y = all_eight(0.0)
                for term in range(terms.first[group, line], terms.first[group, line + 1]):
                    place = terms.place[term]
                    at = terms.block[term] + octet
                    sign = -1.0 if terms.mirrored[term] else 1.0
                    for column in range(begin, begin + size):
                        a = values[place, column].real
                        b = sign * values[place, column].imag
                        c = eight(real, at)
                        s = eight(imaginary, at)
                        x = x + c * a - s * b
                        y = y + c * b + s * a
                        at += rows
                put(out_real, line * room + to + octet, x)
                put(out_imaginary, line * room + to + octet, y)
        to += rows


@kernel
def add_answered(
    terms: Terms,
    real: Floats,
    imaginary: Floats,
    answers_real: Floats,
    answers_imaginary: Floats,
    values: Complexes,
    taken_real: Floats,
    taken_imaginary: Floats,
    memory: Floats,
    out: Complexes,
) -> None:
    """Fill signals (n, k) plus what lines answer by themselves to the products of these.

    `answers` are those of each line (n, k, k) as `flat` has them, `taken` and `memory` (16,) room.
    """
    take_in(terms, real, imaginary, values, taken_real, taken_imaginary)
    lines, size = values.shape
    at = product = 0
    for line in range(lines):
        from_line = product
        from_answers = at
        for octet in range(0, size, SIZE):
            x = all_eight(0.0)
            y = all_eight(0.0)
            product = from_line
            at = from_answers + octet
            for group in range(terms.room.size):
                for column in range(product, product + terms.size[group]):
                    a = taken_real[column]
                    b = taken_imaginary[column]
                    c = eight(answers_real, at)
                    s = eight(answers_imaginary, at)
                    x = x + c * a - s * b
                    y = y + c * b + s * a
                    at += SIZE * ((size + SIZE - 1) // SIZE)
                product += terms.room[group]
            put(memory, 0, x)
            put(memory, SIZE, y)
            for row in range(octet, min(octet + SIZE, size)):
                out[line, row] = values[line, row] + complex(memory[row - octet], memory[SIZE + row - octet])
            at -= octet
