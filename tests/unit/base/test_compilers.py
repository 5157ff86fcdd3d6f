import os
import subprocess
import sys
from pathlib import Path

import pytest

from railcosim.base import compilers
from railcosim.base.errors import BuildError


def test_reports_what_the_compiler_says(tmp_path: Path) -> None:
    source = tmp_path / "broken.c"
    source.write_text("int f( { return 0; }")
    with pytest.raises(BuildError, match=r"broken\.c"):
        compilers.native_compiler().shared_library(source, tmp_path / "broken.so")


def test_refuses_an_unknown_kind() -> None:
    with pytest.raises(BuildError, match="no compiler 'tcc'"):
        compilers.native_compiler("tcc")


def test_falls_back_to_zig_where_no_compiler_is(tmp_path: Path) -> None:
    """In a process whose PATH holds nothing, the compiler is zig's."""
    code = "from railcosim.base.compilers import native_compiler; print(native_compiler().identity)"
    environment = {k: v for k, v in os.environ.items() if k != "CC"} | {"PATH": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith("zig ")


def test_a_compiler_that_does_not_work_is_passed_over(tmp_path: Path) -> None:
    if os.name == "nt":
        pytest.skip("needs a shell script as a compiler")
    false = tmp_path / "cc"
    false.write_text("#!/bin/sh\nexit 1\n")
    false.chmod(0o755)
    code = "from railcosim.base.compilers import system_compiler; print(system_compiler())"
    environment = {k: v for k, v in os.environ.items() if k != "CC"} | {"PATH": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "None"
