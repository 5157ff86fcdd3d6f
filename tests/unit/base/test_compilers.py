import concurrent.futures
import multiprocessing
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from railcosim.base import compilers
from railcosim.base.cache import VARIABLE
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


PROBE = "int probe(int x) { return x + 1; }\n"


def fake_zig(folder: Path, target: str = "none") -> compilers.Compiler:
    """A compiler with a runtime, which writes its output only for sources with a probe."""
    program = folder / "zig.py"
    program.write_text(
        "import pathlib, sys\n"
        "source = next(a for a in sys.argv if a.endswith('.c'))\n"
        "if 'probe' not in pathlib.Path(source).read_text(): sys.exit('no probe')\n"
        "pathlib.Path(sys.argv[sys.argv.index('-o') + 1]).write_text('library')\n"
    )
    runtime = compilers.Runtime(target, "1.0", folder)
    return compilers.Compiler((sys.executable, str(program)), "fake zig", runtime=runtime)


def test_the_first_runtime_of_a_target_is_announced_once(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "probe.c").write_text(PROBE)

    def said(compiler: compilers.Compiler, kind: str) -> str:
        compiler.shared_library(tmp_path / "probe.c", tmp_path / f"probe{kind}")
        out, err = capfd.readouterr()
        assert out == ""
        return err

    compiler = fake_zig(tmp_path)
    first = said(compiler, ".dll").splitlines()
    assert first[0] == "building zig's runtime for none, once; takes some seconds ..."
    assert first[1].startswith("built zig's runtime for none in ")
    assert said(compiler, ".dll") == ""
    assert said(fake_zig(tmp_path), ".dll") == ""  # another process finds the mark
    assert "for none" in said(compiler, ".dylib")  # with other flags
    assert "for other" in said(fake_zig(tmp_path, "other"), ".dll")


def test_a_runtime_that_failed_is_announced_again(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "wrong.c"
    source.write_text("nothing")
    compiler = fake_zig(tmp_path)
    for _ in range(2):
        with pytest.raises(BuildError, match="no probe"):
            compiler.shared_library(source, tmp_path / "wrong.dll")
        err = capfd.readouterr().err
        assert "building" in err
        assert "built" not in err
    assert compiler.runtime is not None
    assert not compiler.runtime.is_built(".dll")


def _cold_build(folder: str) -> bytes:
    """Compile with zig into a cache that may hold nothing yet."""
    os.environ[VARIABLE] = folder
    with tempfile.TemporaryDirectory() as place:
        source, library = Path(place, "probe.c"), Path(place, "probe.so")
        source.write_text(PROBE)
        compiler = compilers.zig_compiler("x86_64-linux-gnu.2.17")
        compiler.shared_library(source, library)
        assert compiler.runtime is not None
        assert compiler.runtime.is_built(".so")
        return library.read_bytes()


def test_processes_that_build_a_runtime_at_once(tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=context) as pool:
        one, two = pool.map(_cold_build, [str(tmp_path)] * 2)
    assert one == two
    assert one[:4] == b"\x7fELF"


def test_a_relative_cache_is_found_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """zig runs in the library's folder; its cache must not move there."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv(VARIABLE, "cache")
    for _, folder in compilers.zig_compiler("x86_64-linux-gnu.2.17").environment:
        assert Path(folder) == tmp_path / "cache" / "zig"
