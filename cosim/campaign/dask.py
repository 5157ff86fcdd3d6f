"""A Dask cluster, by submit() and as_completed() alone."""

from concurrent.futures import CancelledError
from typing import Any, Self

from .chunk import Chunk, Done, compute
from .errors import CampaignError
from .executors import Answer, Lanes


class Dask(Lanes):
    """Chunks computed by the workers of a client's cluster.

    Not by the client's executor of concurrent.futures, whose cancel() and running() do not say
    what is the case. A chunk is no pure function of its arguments for Dask: two that look the same
    are computed twice.
    """

    def __init__(self, client: Any, *, owned: bool = False) -> None:
        from distributed import as_completed

        self._client, self._owned = client, owned
        self._chunks: dict[Any, Chunk] = {}
        self._completed = as_completed()
        self.width = max(1, sum(client.nthreads().values()))

    @classmethod
    def connected(cls, address: str) -> Self:
        """Return the lanes of a scheduler; raise CampaignError if there is none at the address."""
        try:
            from distributed import Client
        except ImportError:
            raise CampaignError(
                "a Dask cluster needs the extra: pip install 'railcosim[cluster]'"
            ) from None
        try:
            return cls(Client(address, timeout=10), owned=True)
        except (OSError, ValueError, TypeError) as error:
            raise CampaignError(f"no Dask scheduler at {address}: {error}") from error

    def submit(self, chunk: Chunk) -> None:
        """Have a chunk computed."""
        future = self._client.submit(compute, chunk, pure=False)
        self._chunks[future] = chunk
        self._completed.add(future)

    def answers(self) -> list[Answer]:
        """Wait until at least one chunk has come back."""
        future = next(self._completed)
        return [(self._chunks.pop(future), self._outcome(future))]

    def _outcome(self, future: Any) -> Done | None:
        from distributed import KilledWorker

        try:
            return future.result()
        except (KilledWorker, CancelledError):
            return None
        except Exception as error:
            words = f"{type(error).__name__}: {error}"
            raise CampaignError(f"a chunk of runs did not come back: {words}") from error

    def renew(self) -> None:
        """Raise CampaignError if the scheduler is gone; lost workers are its own business."""
        if self._client.status != "running":
            raise CampaignError(
                "the Dask scheduler does not answer any more; start again when it does: the runs "
                "that are done are kept"
            )

    def close(self, *, abandon: bool = False) -> None:
        """Let go of what is on its way, which the scheduler then drops."""
        self._chunks.clear()
        self._completed.clear()
        if self._owned:
            self._client.close()
