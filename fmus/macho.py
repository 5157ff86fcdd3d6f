"""The fat header that makes one universal macOS library out of two."""

import struct

from ..base.errors import BuildError

_FAT_MAGIC = 0xCAFEBABE
_MACH_O_64 = 0xFEEDFACF
_ALIGNMENT = 14  # 2**14: the page size of arm64


def universal_library(slices: list[bytes]) -> bytes:
    """Return a universal library of 64-bit Mach-O slices, each at a page boundary.

    The header (big-endian) holds a count and, for each slice, CPU type, subtype, offset, size
    and alignment, which are read from the slices themselves. A slice's bytes stay as they are, so
    its code signature (zig signs arm64 ad hoc; macOS loads no other) holds. Nothing follows the
    last slice: macOS takes a tail for tampering. Raise BuildError for a slice that is no 64-bit
    Mach-O file.
    """
    page = 1 << _ALIGNMENT
    header = struct.pack(">II", _FAT_MAGIC, len(slices))
    library = bytearray(page)
    for data in slices:
        if len(data) < 12 or struct.unpack_from("<I", data)[0] != _MACH_O_64:
            raise BuildError("the compiler's output is not a 64-bit Mach-O library")
        cpu, subtype = struct.unpack_from("<II", data, 4)
        library += bytes(-len(library) % page)
        header += struct.pack(">5I", cpu, subtype, len(library), len(data), _ALIGNMENT)
        library += data
    library[: len(header)] = header
    return bytes(library)
