"""What a Windows library exports, read from its own table (Microsoft's "PE Format")."""

import struct
import zipfile
from pathlib import Path

from railcosim.fmus import export
from railcosim.models import second_order_train

X86_64, PE32_PLUS = 0x8664, 0x20B


def exported_names(data: bytes) -> list[str]:
    """Follow the DOS header to the PE header, its data directory 0, and the table of names."""

    def read(form: str, at: int) -> tuple[int, ...]:
        return struct.unpack_from("<" + form, data, at)

    (pe,) = read("I", 0x3C)
    assert data[pe : pe + 4] == b"PE\0\0"
    (machine, count), (optional_size,), (magic,) = (
        read("HH", pe + 4), read("H", pe + 20), read("H", pe + 24),
    )  # fmt: skip
    assert (machine, magic) == (X86_64, PE32_PLUS)
    sections = [read("4I", pe + 24 + optional_size + 40 * i + 8) for i in range(count)]

    def place(address: int) -> int:
        """Return where in the file a virtual address lies."""
        (found,) = [raw + address - start for size, start, _, raw in sections
                    if start <= address < start + size]  # fmt: skip
        return found

    (table,) = read("I", pe + 24 + 112)
    (number,), (names,) = read("I", place(table) + 24), read("I", place(table) + 32)
    starts = [place(address) for address in read(f"{number}I", place(names))]
    return [data[at : data.index(0, at)].decode() for at in starts]


def test_it_exports_fmi_functions_only(tmp_path: Path) -> None:
    fmu = export(second_order_train(), tmp_path / "t.fmu", platforms=["win64"])
    with zipfile.ZipFile(fmu) as archive:
        names = exported_names(archive.read("binaries/win64/second_order_train.dll"))
    assert "fmi2DoStep" in names
    assert [name for name in names if not name.startswith("fmi2")] == []
