"""Files that are read are bounded: one without an end would fill the memory."""

from pathlib import Path

MOST_JSON = 1 << 22  # bytes of a manifest


def read_text(path: Path, most: int) -> str:
    """Return the text of a file of at most so many bytes.

    It raises OSError if it cannot be read; ValueError if it has more, or is not UTF-8 text (then a
    `UnicodeDecodeError`).
    """
    with path.open("rb") as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise ValueError(f"{path} must have at most {most} bytes")
    return content.decode("utf-8-sig")
