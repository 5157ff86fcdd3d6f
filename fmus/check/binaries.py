"""Checks of the binaries: do they load, and do they belong to the description?"""

from ...base.errors import FmuError
from ...cosim.fmu.file import binary_of, extracted
from .report import Report
from .subject import Subject


def check_binary(subject: Subject, interface: str, report: Report) -> bool:
    """Add the finding on the GUID; return False if the interface cannot be instantiated.

    The binary must take the description's GUID; whether it minds another one tells the rest. Of
    binaries for other machines only the text can be searched: where one holds the GUID, so must
    all.
    """
    try:
        subject.instance(interface).close()
    except FmuError as error:
        words = str(error)
        if "cannot be loaded" not in words:
            words = f"the binary refuses the description's GUID: {words}"
        report.add("GUID", [words], "")
        return False
    folder = extracted(subject.path) / "binaries"
    libraries = [p for p in folder.rglob("*") if p.suffix in (".so", ".dll", ".dylib")]
    guid = str(subject.description.guid).encode()
    holds = {p.relative_to(folder).as_posix(): guid in p.read_bytes() for p in libraries}
    identifier = subject.interfaces[interface].modelIdentifier
    own = binary_of(subject.path, subject.description, identifier).relative_to(folder).as_posix()
    if holds[own]:
        others = [f"{name} does not hold the GUID" for name, has in holds.items() if not has]
        report.add("GUID", others, "the description's is in every binary")
    elif _accepts_any(subject, interface):
        report.skip("GUID", "the binary takes any GUID, and the description's is not found in it")
    else:
        report.add("GUID", [], "the binary takes the description's and refuses another")
    return True


def _accepts_any(subject: Subject, interface: str) -> bool:
    try:
        subject.instance(interface, guid="{not-the-guid-of-this-fmu}").close()
    except FmuError:
        return False
    return True
