"""Files are damaged at random: a bit flipped, a piece cut out or doubled."""

import random
from collections.abc import Iterator

_LONGEST = 40  # bytes of a piece


def damaged(content: bytes, seed: str, n: int) -> Iterator[bytes]:
    """Give the content, damaged in one of the three ways, so many times."""
    rng = random.Random(seed)
    for _ in range(n):
        start = rng.randrange(len(content))
        end = min(len(content), start + rng.randrange(1, _LONGEST))
        piece = content[start:end]
        flipped = bytes([piece[0] ^ 1 << rng.randrange(8)]) + piece[1:]
        yield content[:start] + rng.choice((flipped, b"", piece * 2)) + content[end:]
