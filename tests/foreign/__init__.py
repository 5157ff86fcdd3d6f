"""FMUs that were not made by railcosim: small C sources, honest ones and ones that lie."""

import shutil
import zipfile
from importlib import resources
from pathlib import Path

from railcosim.base.compilers import SUFFIXES, host_platform, native_compiler

GUID = "{7d3f3b1c-3a0d-4a58-9f0b-6d1c5b0f8a11}"
HEADERS = ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h")
STATE = ("canGetAndSetFMUstate", "canSerializeFMUstate")
ALL = (
    *STATE,
    "canHandleVariableCommunicationStepSize",
    "canInterpolateInputs",
    "providesDirectionalDerivative",
)


def foreign_fmu(
    model: str,
    folder: Path,
    *,
    declares: tuple[str, ...] = (),
    order: int = 0,
    lie: str = "",
    bounds: str = "",
) -> Path:
    """Compile a model of this folder to an FMU that declares capabilities, with a lie or none.

    `order` is that of the output derivatives; `bounds` are attributes of the output.
    """
    here = Path(__file__).parent
    work = folder / "work"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    for name in (f"{model}.c", "common.h"):
        shutil.copy(here / name, work)
    for name in HEADERS:
        work.joinpath(name).write_bytes(
            resources.files("fmpy").joinpath("c-code", name).read_bytes()
        )
    lines = [f'#define GUID "{GUID}"', f'#include "{model}.c"']
    if lie:
        lines.insert(0, f"#define LIE_{lie.upper()} 1")
    source = work / "fmu.c"
    source.write_text("\n".join(lines) + "\n")
    suffix = SUFFIXES[host_platform()]
    library = work / f"{model}{suffix}"
    native_compiler().shared_library(source, library)
    capabilities = " ".join(f'{name}="true"' for name in declares)
    if order:
        capabilities += f' maxOutputDerivativeOrder="{order}"'
    xml = (here / f"{model}.xml").read_text()
    xml = xml.replace('"GUID"', f'"{GUID}"').replace("CAPABILITIES", capabilities)
    xml = xml.replace("BOUNDS", bounds)
    path = folder / f"{model}.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", xml)
        archive.write(library, f"binaries/{host_platform()}/{model}{suffix}")
    return path
