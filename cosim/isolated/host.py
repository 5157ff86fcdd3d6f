"""The process of an isolated FMU: `python -m railcosim.cosim.isolated.host PAGE PARENT`.

Requests come on standard input, replies go to standard output. Both are moved away before anything
else happens: what the FMU prints goes to standard error, and reading finds an end.
"""

import os
import shutil
import signal
import sys
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from threading import Thread
from time import sleep
from typing import Any

from . import messages as m
from .page import Page
from .server import ClosedError, Pipes, Server

_LAST = 2.0  # s that the FMU has for ending after the parent's death


def _started(pipes: Pipes, page: Page, wanted: dict[str, Any]) -> Server:
    """Return the server of a new instance, of an FMU that the parent has unpacked."""
    from .hosted import HostedInstance

    path = Path(wanted["path"])
    return Server(
        pipes,
        page,
        HostedInstance(page, wanted["name"], path, wanted["inputs"], wanted["outputs"]),
    )


def _import_fmpy() -> None:
    """Import FMPy, without the threads that its NumPy would start: a third of the time."""
    threads = "OPENBLAS_NUM_THREADS"
    is_set = threads in os.environ
    os.environ.setdefault(threads, "1")
    try:
        import_module("fmpy.fmi2")
    finally:
        if not is_set:  # what the FMU brings with it may use them
            del os.environ[threads]


def _adopt(path: Path, folder: str) -> None:
    """Use the parent's folder with the FMU's files; it also removes it."""
    from ..fmu.file import adopt, read_description

    adopt(path, folder)
    read_description(path)


def _private_pipes() -> Pipes:
    requests, replies = os.dup(0), os.dup(1)
    nowhere = os.open(os.devnull, os.O_RDWR)
    os.dup2(nowhere, 0)
    try:
        os.dup2(2, 1)
    except OSError:
        os.dup2(nowhere, 1)
    os.close(nowhere)
    if sys.platform == "win32":
        import msvcrt

        for file in (requests, replies):
            msvcrt.setmode(file, os.O_BINARY)
        # No window that waits for someone to press a button.
        msvcrt.SetErrorMode(msvcrt.SEM_FAILCRITICALERRORS | msvcrt.SEM_NOGPFAULTERRORBOX)
    else:
        signal.signal(signal.SIGTTOU, signal.SIG_IGN)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides
    return Pipes(requests, replies)


def _outlive(parent: int, requests: int, folders: list[str]) -> None:
    """Wait for the parent's death, then end this process, whatever the FMU is doing."""
    _wait_for_death(parent, requests)
    # The main thread has seen it too, and is freeing the FMU unless that is in a long step.
    sleep(_LAST)
    _sweep(parent, folders)
    os._exit(1)


def _sweep(parent: int, folders: list[str]) -> None:
    """Remove the FMU's files for a parent that was killed and could not.

    The folder may be that of the parent's parent, which lives on; its name tells.
    """
    for folder in folders:
        if Path(folder).name.startswith(f"railcosim-{parent}-") and _is_dead(parent):
            shutil.rmtree(folder, ignore_errors=True)


def _wait_for_death(parent: int, requests: int) -> None:
    if sys.platform == "win32":
        import _winapi

        synchronize = 0x00100000
        handle = _winapi.OpenProcess(synchronize, False, parent)
        _winapi.WaitForSingleObject(handle, _winapi.INFINITE)
        return
    import select

    poller = select.poll()
    poller.register(requests, 0)  # tells the end only
    while not poller.poll(1000) and os.getppid() == parent:
        pass


def _is_dead(parent: int) -> bool:
    if sys.platform == "win32":
        return False  # nobody can remove a library that is loaded
    for _ in range(100):  # its pipes are closed a moment before
        if os.getppid() != parent:
            return True
        sleep(0.01)
    return False


def main(where: str, parent: int) -> None:
    """Serve one FMU."""
    pipes = _private_pipes()
    folders: list[str] = []
    Thread(target=_outlive, args=(parent, pipes.requests, folders), daemon=True).start()
    page = Page.attach(where)
    server = None
    try:
        request = pipes.receive()
        wanted, _ = m.unpack_json(memoryview(request)[m.REQUEST.size :])
        folders.append(wanted["folder"])
        try:
            _import_fmpy()
            _adopt(Path(wanted["path"]), wanted["folder"])
            pipes.answer(m.DONE, None)
            pipes.receive()
            server = _started(pipes, page, wanted)
        except Exception as error:
            pipes.fail(error)
        else:
            server.introduce()
            server.serve()
    except (ClosedError, OSError):
        if server is not None:
            with suppress(Exception):
                server.instance.close()
        _sweep(parent, folders)


def _leave() -> None:
    """End without running what the FMU left to be run at the end, but with what it printed."""
    import ctypes

    with suppress(Exception):
        ctypes.CDLL(None).fflush(None)
    with suppress(Exception):
        sys.stderr.flush()
    os._exit(0)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
    _leave()
