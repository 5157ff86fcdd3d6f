import pickle
import shutil
import zipfile
from pathlib import Path

import pytest

from railcosim import Constant, Diagram, Fmu
from railcosim.base.errors import FmuError, ParameterError
from railcosim.fmus import build
from tests import hybrid_plants, plants


def rewrite(source: Path, target: Path, change) -> Path:
    """Copy an FMU, passing each file's name and content through `change`."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            changed = change(name, old.read(name))
            if changed is not None:
                new.writestr(*changed)
    return target


@pytest.fixture(scope="module")
def everything() -> Path:
    return build(plants.everything())


def test_ports_and_units(everything: Path) -> None:
    block = Fmu(everything)
    assert block.inputs == {"u[1]": "N", "u[2]": "N"}
    assert block.outputs == {
        "power": "W",
        "momentum[1]": "N.s",
        "momentum[2]": "N.s",
        "v[1]": "m/s",
        "v[2]": "m/s",
    }


def test_parameters_start_values_and_constant_inputs(everything: Path) -> None:
    block = Fmu(everything, m=[3.0, 4.0], v=[2.0, 0.5], c=0.0, u=[1.5, -2.0])
    assert block.inputs == {}
    diagram = Diagram("values", step=0.1)
    diagram.add("plant", block)
    run = diagram.run(0.1)
    assert run["plant.momentum[1]"][0] == 6.0
    assert run["plant.momentum[2]"][0] == 2.0
    assert run["plant.power"][0] == 1.5 * 2.0 - 2.0 * 0.5


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"mass": 1.0}, r"nothing to set named 'mass'; there are: m\[1\], m\[2\], c, solver"),
        ({"m": 1.0}, r"'m' is a vector; give a list, or set m\[1\]"),
        ({"m[1]": "heavy"}, "is a Real, 'heavy' is not"),
        ({"m[1]": True}, "is a Real, True is not"),
        ({"m[1]": 0.0}, r"m\[1\] = 0 kg lies outside \[0\.1, inf\]"),
        ({"u[1]": 7.0}, r"lies outside \[-5, 5\]"),
        ({"c": float("nan")}, "is not finite"),
        ({"m": [1.0, 2.0, 3.0]}, "3 values given for 'm', which has 2"),
        ({"m": [1.0]}, "1 values given for 'm', which has 2"),
        ({"c": [1.0]}, "1 values given for 'c', which has no elements"),
        ({"power": 1.0}, "power is computed by the FMU and cannot be set"),
    ],
)
def test_wrong_values_are_refused(everything: Path, values: dict, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        Fmu(everything, **values)


def test_a_vector_with_its_index_inside_is_given_whole() -> None:
    path = build(hybrid_plants.fleet())
    block = Fmu.with_values(path, {"vehicle[].brake": [5.0, 4.0, 3.0, 2.0, 1.0]})
    assert block.values["vehicle[4].brake"] == 2.0
    with pytest.raises(ParameterError, match="2 values given for 'vehicle.*', which has 5"):
        Fmu.with_values(path, {"vehicle[].brake": [1.0, 2.0]})
    with pytest.raises(ParameterError, match="speed.* is computed by the FMU"):
        Fmu.with_values(path, {"der(vehicle[1].speed)": 1.0})


def test_a_wrong_period(everything: Path) -> None:
    with pytest.raises(ParameterError, match="period must be a positive"):
        Fmu(everything, period=0.0)


def test_files_that_are_no_fmu(tmp_path: Path, train_fmu: Path) -> None:
    text = tmp_path / "text.fmu"
    text.write_text("hello")
    empty = tmp_path / "empty.fmu"
    with zipfile.ZipFile(empty, "w") as archive:
        archive.writestr("a", "b")
    truncated = tmp_path / "truncated.fmu"
    truncated.write_bytes(train_fmu.read_bytes()[:-200])
    bad_xml = rewrite(
        train_fmu, tmp_path / "xml.fmu", lambda n, d: (n, d[:99] if n.endswith(".xml") else d)
    )
    version = rewrite(
        train_fmu, tmp_path / "v3.fmu", lambda n, d: (n, d.replace(b'"2.0"', b'"1.0"'))
    )
    for path, message in (
        (tmp_path / "none.fmu", "no file"),
        (text, "not an FMU, or is damaged"),
        (empty, "no modelDescription.xml"),
        (truncated, "not an FMU, or is damaged"),
        (bad_xml, "modelDescription.xml cannot be read"),
        (version, r"FMI 1\.0; needed is FMI 2\.0"),
        (tmp_path, "cannot read"),
    ):
        with pytest.raises(FmuError, match=message):
            Fmu(path)


def test_no_co_simulation_and_no_binary(tmp_path: Path, train_fmu: Path) -> None:
    exchange = rewrite(
        train_fmu,
        tmp_path / "me.fmu",
        lambda n, d: (n, d.replace(b"CoSimulation", b"ModelExchange")),
    )
    with pytest.raises(FmuError, match="no co-simulation interface"):
        Fmu(exchange)
    bare = rewrite(
        train_fmu, tmp_path / "bare.fmu", lambda n, d: None if "binaries" in n else (n, d)
    )
    with pytest.raises(FmuError, match="has no binary for"):
        Fmu(bare)


def test_a_garbage_binary_is_named(tmp_path: Path, train_fmu: Path) -> None:
    path = rewrite(
        train_fmu, tmp_path / "bad.fmu", lambda n, d: (n, b"no library" if "binaries" in n else d)
    )
    diagram = Diagram("bad", step=0.1)
    diagram.add("train", Fmu(path, u=1.0))
    here = Path.cwd()
    with pytest.raises(FmuError, match=r"block 'train': .*bad\.fmu cannot be loaded"):
        diagram.run(1.0)
    assert Path.cwd() == here


def test_another_guid_is_refused_with_the_fmus_words(tmp_path: Path, train_fmu: Path) -> None:
    def change(name: str, data: bytes) -> tuple[str, bytes]:
        if name == "modelDescription.xml":
            start = data.index(b'guid="{') + 7
            data = data[:start] + b"00000000" + data[start + 8 :]
        return name, data

    diagram = Diagram("guid", step=0.1)
    diagram.add("train", Fmu(rewrite(train_fmu, tmp_path / "guid.fmu", change), u=1.0))
    with pytest.raises(FmuError, match="GUID is not this binary's"):
        diagram.run(1.0)


def test_travels_by_pickle(train_fmu: Path) -> None:
    block = pickle.loads(pickle.dumps(Fmu(train_fmu, gain=1.5, period=0.1)))
    assert (block.values, block.period) == ({"gain": 1.5}, 0.1)


def test_a_file_that_is_replaced_is_read_again(tmp_path: Path, train_fmu: Path) -> None:
    path = tmp_path / "a.fmu"
    shutil.copy(train_fmu, path)
    assert "speed" in Fmu(path).outputs
    path.write_bytes(build(plants.integrator()).read_bytes())
    assert "x" in Fmu(path).outputs


def test_many_runs_leave_no_open_files(train_fmu: Path) -> None:
    fds = Path("/proc/self/fd")
    if not fds.exists():
        pytest.skip("needs /proc to count open files")
    diagram = Diagram("many", step=0.1)
    diagram.add("u", Constant(1.0))
    diagram.add("train", Fmu(train_fmu))
    diagram.connect("u.y", "train.u")
    diagram.run(0.2)
    before = len(list(fds.iterdir()))
    for _ in range(50):
        diagram.run(0.2)
    assert len(list(fds.iterdir())) <= before
