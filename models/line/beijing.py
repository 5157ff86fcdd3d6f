"""Beijing Line 5 and its type B train, as the precise braking study uses them.

Both are read from `data/`, in the formats anybody's own files may have. The paper gives neither;
where the numbers come from is said in the files and in docs/lines.md.
"""

from dataclasses import replace
from pathlib import Path

from .files import read_line, read_train
from .line import Line
from .train import Train

_DATA = Path(__file__).parent / "data"

SEVEN_RUNS = (
    ("Tiantongyuannan", "Lishuiqiao"),
    ("Lishuiqiao", "Beiyuanlubei"),
    ("Beiyuanlubei", "Datunludong"),
    ("Datunludong", "Huixinxijiebeikou"),
    ("Huixinxijiebeikou", "Huixinxijienankou"),
    ("Huixinxijienankou", "Hepingxiqiao"),
    ("Hepingxiqiao", "Hepinglibeijie"),
)
"""The paper's seven runs, (from, to), in the order of its Table 3.

The line has eight interstations here: the paper's second run names no halt at Lishuiqiaonan. Our
reading is one run of 2591 m through that station.
"""


def beijing_line_5() -> Line:
    """Return Beijing Line 5 from Tiantongyuannan to Hepinglibeijie, 9 stops over 12.179 km."""
    return read_line(_DATA / "beijing_line_5.json")


def metro_b() -> Train:
    """Return a six-car type B train; AW0/AW2/AW3 are 200/285/312 t and runs are made with 240 t.

    The file's format has no place for a second load beside the one of a run, so AW2 is said here.
    """
    return replace(read_train(_DATA / "metro_b.yaml"), mass_loaded=285e3)
