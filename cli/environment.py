"""The command needs folders for caches, and a message for a full disk."""

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager

# What the system says of a disk that takes no more.
DISK = frozenset((errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO))


@contextmanager
def writable_caches() -> Iterator[None]:
    """Check that the tools find a cache that can be written: where the user's cannot, a folder that ends with this.

    Yosys, Matplotlib and compilers have caches of their own there.
    """
    cache = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    try:
        os.makedirs(cache, exist_ok=True)
        writable = os.access(cache, os.W_OK | os.X_OK)
    except OSError:
        writable = False
    if writable:
        yield
        return
    import tempfile

    names = ("HOME", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "MPLCONFIGDIR")
    before = {name: os.environ.get(name) for name in names}
    with tempfile.TemporaryDirectory(prefix="tachometry-", ignore_cleanup_errors=True) as folder:
        os.environ.update(dict.fromkeys(names, folder))
        try:
            yield
        finally:
            for name, value in before.items():
                os.environ.pop(name) if value is None else os.environ.update({name: value})
