"""A campaign as a script, for tests that kill it: FOLDER FMU EXECUTOR [where it kills itself].

It has no `if __name__ == "__main__":`, and its functions are its own, as in a user's script.
"""

import os
import sys
import zipfile
from io import BytesIO
from pathlib import Path

import fmpy
import pyarrow.parquet as pq

from railcosim.cosim.campaign.journal import Journal
from railcosim.cosim.fmu.file import _folders
from tests.campaigns import measure, train_campaign

folder, fmu, executor, *where = sys.argv[1:]


def die() -> None:
    """End as by kill -9: nothing is cleaned up, nothing flushed."""
    os._exit(9)


def half_a_table(table, stream, **options):
    whole = BytesIO()
    write_table(table, whole, **options)
    stream.write(whole.getvalue()[: whole.tell() // 2])
    stream.flush()
    die()


def half_a_line(journal, records):
    if len(journal.done) > 5:
        journal._stream.write(b'12345678 {"run":77,"drawn":{"train.gain":1.0')
        journal._stream.flush()
        die()
    return append(journal, records)


def half_unpacked(path, folder):
    with zipfile.ZipFile(path) as archive:
        for name in archive.namelist()[:2]:
            archive.extract(name, folder)
    die()


write_table, append = pq.write_table, Journal.append
if where == ["table"]:
    pq.write_table = half_a_table
elif where == ["journal"]:
    Journal.append = half_a_line  # pyright: ignore


def at_end(run):
    """Something of the script's own, which workers cannot import."""
    return [{**row, "mine": 2.0 * row["end"]} for row in measure(run)]


work = train_campaign(Path(fmu)).work
campaign = train_campaign(
    Path(fmu), work=type(work)(**{**vars(work), "measure": at_end}), traces=20
)
if where == ["unpacking"]:
    _folders.clear()  # it was unpacked for its description already
    fmpy.extract = half_unpacked
try:
    campaign.run(folder, executor=executor, workers=2 if executor == "processes" else None)
except KeyboardInterrupt as stop:
    print(stop)
    sys.exit(130)
