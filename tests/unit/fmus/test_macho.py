"""A universal library taken to pieces again: header, slices, exports, and the code signature.

macOS on arm64 loads no code without a signature. zig signs while it links ("ad hoc": with hashes
and no name); the constants are those of Apple's mach-o/loader.h and cs_blobs.h.
"""

import hashlib
import struct
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from railcosim.base.compilers import TARGETS, zig_compiler
from railcosim.base.errors import BuildError
from railcosim.fmus import export
from railcosim.fmus.macho import universal_library
from railcosim.models import second_order_train

X86_64, ARM64 = 0x01000007, 0x0100000C
SEGMENT, SIGNATURE, DYLD_INFO, BUILD_VERSION = 0x19, 0x1D, 0x80000022, 0x32
EMBEDDED_SIGNATURE, CODE_DIRECTORY = 0xFADE0CC0, 0xFADE0C02
AD_HOC, SHA256 = 0x2, 2


class Slice(NamedTuple):
    cpu: int
    offset: int
    size: int
    align: int
    data: bytes


class CodeDirectory(NamedTuple):
    """The head of a CodeDirectory, big-endian, up to the executable segment (version 0x20400)."""

    magic: int
    length: int
    version: int
    flags: int
    hashes_at: int
    name_at: int
    special_hashes: int
    hashes: int
    limit: int
    hash_size: int
    hash_type: int
    platform: int
    page_shift: int
    spare2: int
    scatter_at: int
    team_at: int
    spare3: int
    limit_64: int
    segment_base: int
    segment_limit: int
    segment_flags: int


HEAD = struct.Struct(">9I4B4I4Q")


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("mac") / "t.fmu"
    return export(second_order_train(), path, platforms=["darwin64"])


@pytest.fixture(scope="module")
def library(fmu: Path) -> bytes:
    with zipfile.ZipFile(fmu) as archive:
        return archive.read("binaries/darwin64/second_order_train.dylib")


def slices_of(library: bytes) -> list[Slice]:
    magic, count = struct.unpack_from(">II", library)
    assert magic == 0xCAFEBABE
    slices = []
    for i in range(count):
        cpu, _, offset, size, align = struct.unpack_from(">5I", library, 8 + 20 * i)
        slices.append(Slice(cpu, offset, size, align, library[offset : offset + size]))
    return slices


def commands(data: bytes, wanted: int) -> Iterator[bytes]:
    """Yield the load commands of a kind, which follow the 32 bytes of the header."""
    (count,) = struct.unpack_from("<I", data, 16)
    at = 32
    for _ in range(count):
        kind, size = struct.unpack_from("<II", data, at)
        if kind == wanted:
            yield data[at : at + size]
        at += size


def segment(data: bytes, wanted: bytes) -> tuple[int, int]:
    """Return a segment's place in the file and its size there."""
    for command in commands(data, SEGMENT):
        name, _, _, offset, size = struct.unpack_from("<16s4Q", command, 8)
        if name.rstrip(b"\0") == wanted:
            return offset, size
    raise AssertionError(f"no segment {wanted}")


def code_directory(data: bytes) -> tuple[CodeDirectory, bytes]:
    """Return the head and all bytes of a slice's one CodeDirectory."""
    (command,) = commands(data, SIGNATURE)
    offset, size = struct.unpack_from("<II", command, 8)
    assert offset + size == len(data)
    magic, length, count = struct.unpack_from(">III", data, offset)
    assert (magic, count) == (EMBEDDED_SIGNATURE, 1)
    assert length <= size
    slot, at = struct.unpack_from(">II", data, offset + 12)
    assert slot == 0
    head = CodeDirectory(*HEAD.unpack_from(data, offset + at))
    return head, data[offset + at : offset + at + head.length]


def exported_names(data: bytes) -> list[str]:
    """Walk the export trie: at each node the symbol's length, then the edges to the children."""
    (command,) = commands(data, DYLD_INFO)
    offset, size = struct.unpack_from("<II", command, 40)
    trie = data[offset : offset + size]

    def number(at: int) -> tuple[int, int]:
        value = shift = 0
        while True:
            value |= (trie[at] & 0x7F) << shift
            at, shift = at + 1, shift + 7
            if trie[at - 1] < 0x80:
                return value, at

    def walk(at: int, prefix: str) -> Iterator[str]:
        symbol, at = number(at)
        if symbol:
            yield prefix
        at += symbol
        edges, at = trie[at], at + 1
        for _ in range(edges):
            end = trie.index(0, at)
            label = trie[at:end].decode()
            child, at = number(end + 1)
            yield from walk(child, prefix + label)

    return list(walk(0, ""))


def test_the_header_describes_the_slices(library: bytes) -> None:
    slices = slices_of(library)
    assert [s.cpu for s in slices] == [X86_64, ARM64]
    end = 8 + 20 * len(slices)
    for s in slices:
        assert s.offset % (1 << s.align) == 0
        assert library[end : s.offset] == bytes(s.offset - end)  # nothing hides between
        magic, cpu, _, kind = struct.unpack_from("<4I", s.data)
        assert (magic, cpu, kind) == (0xFEEDFACF, s.cpu, 6)  # 64-bit, dynamic library
        assert sum(segment(s.data, b"__LINKEDIT")) == s.size  # as codesign's strict check demands
        end = s.offset + s.size
    assert end == len(library)


def test_the_slices_are_what_the_compiler_wrote(fmu: Path, library: bytes, tmp_path: Path) -> None:
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(tmp_path)
    for target, s in zip(TARGETS["darwin64"], slices_of(library), strict=True):
        path = tmp_path / target / "second_order_train.dylib"
        path.parent.mkdir()
        zig_compiler(target).shared_library(tmp_path / "sources" / "fmu.c", path)
        assert path.read_bytes() == s.data


def test_the_arm_slice_is_signed_page_by_page(library: bytes) -> None:
    data = slices_of(library)[1].data
    head, directory = code_directory(data)
    assert head.magic == CODE_DIRECTORY
    assert head.version >= 0x20400
    assert head.flags & AD_HOC
    assert (head.hash_type, head.hash_size) == (SHA256, 32)
    assert (head.special_hashes, head.scatter_at, head.team_at) == (0, 0, 0)
    (command,) = commands(data, SIGNATURE)
    assert head.limit == struct.unpack_from("<I", command, 8)[0]  # all that precedes the signature
    assert (head.segment_base, head.segment_limit) == segment(data, b"__TEXT")
    page = 1 << head.page_shift
    assert page in {0x1000, 0x4000}
    assert head.hashes == -(-head.limit // page)
    for i in range(head.hashes):
        at = head.hashes_at + 32 * i
        content = data[i * page : min((i + 1) * page, head.limit)]
        assert hashlib.sha256(content).digest() == directory[at : at + 32], f"page {i}"


def test_a_changed_page_would_be_noticed(library: bytes) -> None:
    data = bytearray(slices_of(library)[1].data)
    data[0x400] ^= 1
    head, directory = code_directory(bytes(data))
    first = hashlib.sha256(data[: 1 << head.page_shift]).digest()
    assert first != directory[head.hashes_at : head.hashes_at + 32]


def test_it_loads_on_macos_11(library: bytes) -> None:
    for s in slices_of(library):
        (command,) = commands(s.data, BUILD_VERSION)
        platform, minimum = struct.unpack_from("<II", command, 8)
        assert (platform, minimum >> 16) == (1, 11)


def test_it_exports_fmi_functions_only(library: bytes) -> None:
    """But for two names that zig's linker adds to every library and that no flag takes away."""
    for s in slices_of(library):
        names = set(exported_names(s.data)) - {"__mh_dylib_header", "___dso_handle"}
        assert "_fmi2DoStep" in names
        assert {n for n in names if not n.startswith("_fmi2")} == set()


def test_refuses_what_is_no_mach_o() -> None:
    for data in (b"\x7fELF" + bytes(60), b""):
        with pytest.raises(BuildError, match="not a 64-bit Mach-O"):
            universal_library([data])
