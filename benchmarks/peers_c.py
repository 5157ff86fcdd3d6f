"""A loop in C on the same binary: the limit that no master can go below."""

import ctypes
import tempfile
from pathlib import Path
from time import process_time

from fmpy import read_model_description
from peers_fmpy import instance
from peers_job import Job, done, job

from railcosim.base.compilers import native_compiler

CODE = """
#include <stddef.h>
typedef int (*SetReal)(void *, const unsigned *, size_t, const double *);
typedef int (*DoStep)(void *, double, double, int);
typedef int (*GetReal)(void *, const unsigned *, size_t, double *);

__attribute__((visibility("default")))
int play(void *component, SetReal set, DoStep step, GetReal get, unsigned input,
         const double *inputs, const unsigned *outputs, size_t size, double *values,
         double h, long steps) {
    long k;
    int failed = 0;
    for (k = 0; k < steps; k++) {
        failed |= set(component, &input, 1, inputs + k);
        failed |= step(component, (double)k * h, h, 1);
        failed |= get(component, outputs, size, values);
    }
    return failed;
}
"""


def play(work: Job, library: ctypes.CDLL) -> None:
    path = work.fmus[work.options["fmu"]]
    slave, references = instance(path)
    variables = read_model_description(path).modelVariables
    wanted = work.options.get("outputs") or [v.name for v in variables if v.causality == "output"]
    size = len(wanted)
    outputs = (ctypes.c_uint * size)(*(references[name] for name in wanted))
    values = (ctypes.c_double * size)()
    given = work.inputs or [work.reference] * work.steps
    inputs = (ctypes.c_double * len(given))(*given)
    component = ctypes.c_void_p(slave.component)  # pyright: ignore[reportArgumentType]
    functions = [
        ctypes.cast(getattr(slave.dll, name), ctypes.c_void_p)
        for name in ("fmi2SetReal", "fmi2DoStep", "fmi2GetReal")
    ]
    head = (component, *functions, ctypes.c_uint(references["u"]), inputs, outputs)
    tail = (ctypes.c_size_t(size), values, ctypes.c_double(work.step), ctypes.c_long(len(given)))
    began = process_time()
    failed = library.play(*head, *tail)
    spent = process_time() - began
    if failed:
        raise SystemExit("a call of the FMU failed")
    done(spent, list(values))


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        source, built = Path(name, "play.c"), Path(name, "play.so")
        source.write_text(CODE)
        native_compiler("auto").shared_library(source, built)
        play(job(), ctypes.CDLL(str(built)))
