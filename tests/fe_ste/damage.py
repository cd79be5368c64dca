"""Faults that a file may have when its disk, its transport or somebody had a hand in it."""

from __future__ import annotations

import random
from collections.abc import Iterator


def damages(content: bytes, count: int, seed: int = 0) -> Iterator[bytes]:
    """Copies of a file's content with one fault each: flipped bits, holes, cuts, doubled and foreign pieces."""
    chance = random.Random(seed)
    for n in range(count):
        at = chance.randrange(len(content))
        length = min(chance.choice([1, 8, 512, 4096]), len(content) - at)
        damaged = [
            content[:at] + bytes([content[at] ^ (1 << chance.randrange(8))]) + content[at + 1 :],
            content[:at] + bytes(length) + content[at + length :],
            content[:at],
            content[:at] + content[at + length :],
            content[:at] + content[at : at + length] + content[at:],
            content[:at] + chance.randbytes(length) + content[at + length :],
            content + chance.randbytes(length),
        ][n % 7]
        if damaged != content:
            yield damaged
