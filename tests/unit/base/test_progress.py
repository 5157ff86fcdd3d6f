import io
import re
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from railcosim.base.progress import announced


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def show(monkeypatch: pytest.MonkeyPatch, stream: io.StringIO, seconds: float = 0.0) -> str:
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setenv("COLUMNS", "80")
    with announced("building it", "built it"):
        time.sleep(seconds)
    return stream.getvalue()


def test_two_plain_lines_where_no_terminal_is(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = show(monkeypatch, io.StringIO())
    assert re.fullmatch(r"building it \.\.\.\nbuilt it in \d+ s\n", shown)


def test_a_live_line_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = show(monkeypatch, Terminal(), 1.7)
    assert "00:00 building it" in shown
    assert "00:01 building it" in shown
    assert re.search(r"built it in \d+ s\n$", shown)
    assert shown.count("\n") == 1


def test_a_narrow_terminal_still_shows_the_time(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setenv("COLUMNS", "12")
    with announced("building it", "built it"):
        pass
    assert "00:00 build" in stream.getvalue()
    assert "building it" not in stream.getvalue()


def test_a_failure_is_not_called_done(monkeypatch: pytest.MonkeyPatch) -> None:
    for stream in (io.StringIO(), Terminal()):
        monkeypatch.setattr(sys, "stderr", stream)
        with pytest.raises(ValueError, match="broken"), announced("building it", "built it"):
            raise ValueError("broken")
        assert "building it" in stream.getvalue()
        assert "built it" not in stream.getvalue()


def test_no_stream_at_all(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", None)
    with announced("building it", "built it"):
        pass


@pytest.mark.parametrize("kind", [io.StringIO, Terminal])
def test_threads_do_not_garble_each_others_lines(
    monkeypatch: pytest.MonkeyPatch, kind: type[io.StringIO]
) -> None:
    stream = kind()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setenv("COLUMNS", "80")

    def work(number: int) -> None:
        with announced(f"building {number}", f"built {number}"):
            time.sleep(0.6 + 0.3 * number)

    with ThreadPoolExecutor(3) as pool:
        list(pool.map(work, range(3)))
    for number in range(3):
        assert len(re.findall(rf"built {number} in \d+ s\n", stream.getvalue())) == 1
