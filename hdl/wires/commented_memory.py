"""A memory whose words are explained in the exported text."""

from collections.abc import Sequence
from typing import Any

from amaranth.lib.memory import Memory


class CommentedMemory(Memory):
    """A memory with a comment for each of its first words, such as the instruction that it is."""

    def __init__(self, comments: Sequence[str], **options: Any) -> None:
        super().__init__(**options)
        self.comments = tuple(comments)
