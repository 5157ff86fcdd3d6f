"""The fat header that makes one universal macOS library out of two."""

import struct

from ..base.errors import BuildError

_FAT_MAGIC = 0xCAFEBABE
_MACH_O_64 = 0xFEEDFACF
_ALIGNMENT = 14  # 2**14: the page size of arm64


def universal_library(slices: list[bytes]) -> bytes:
    """Return a universal library of 64-bit Mach-O slices, each at a page boundary.

    The header (big-endian) holds a count and, for each slice, CPU type, subtype, offset, size
    and alignment, which are read from the slices themselves. Raise BuildError for a slice that
    is no 64-bit Mach-O file.
    """
    page = 1 << _ALIGNMENT
    header = struct.pack(">II", _FAT_MAGIC, len(slices))
    body = b""
    offset = page
    for data in slices:
        magic, cpu, subtype = struct.unpack_from("<III", data)
        if magic != _MACH_O_64:
            raise BuildError("the compiler's output is not a 64-bit Mach-O library")
        header += struct.pack(">5I", cpu, subtype, offset, len(data), _ALIGNMENT)
        padding = -len(data) % page
        body += data + b"\0" * padding
        offset += len(data) + padding
    return header.ljust(page, b"\0") + body
