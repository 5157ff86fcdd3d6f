"""The twins of stepper.c's structures: same fields, same order."""

from ctypes import (
    Structure,
    c_double,
    c_int,
    c_longlong,
    c_size_t,
    c_ssize_t,
    c_uint,
    c_void_p,
    cast,
    py_object,
)
from typing import Any

# Python's C API as stepper.c calls it, in the order of its `Python`; then the types that it knows.
FUNCTIONS = (
    "PyObject_Vectorcall",
    "Py_IncRef",
    "Py_DecRef",
    "PyFloat_AsDouble",
    "PyFloat_FromDouble",
    "PyLong_FromLongLong",
    "PyTuple_New",
    "PyTuple_SetItem",
    "PyTuple_GetItem",
    "PyTuple_Size",
    "PyList_New",
    "PyList_SetItem",
    "PyList_GetItem",
    "PySequence_SetItem",
    "PyNumber_Add",
    "PyNumber_Subtract",
    "PyNumber_Multiply",
    "PyNumber_TrueDivide",
    "PyObject_RichCompare",
    "PyObject_IsTrue",
    "PyErr_Occurred",
    "PyErr_Clear",
    "PyErr_SetString",
    "PyErr_CheckSignals",
    "PyEval_SaveThread",
    "PyEval_RestoreThread",
)
TYPES = (float, tuple, RuntimeError)

INT, UINT, LONG, DOUBLE = c_int, c_uint, c_longlong, c_double
SIZE, INDEX = c_size_t, c_ssize_t
OBJECT = POINTER = c_void_p


def _structure(name: str, /, **fields: Any) -> Any:
    return type(name, (Structure,), {"_fields_": list(fields.items())})


Python = _structure(
    "Python",
    **dict.fromkeys(FUNCTIONS, POINTER),
    **{one.__name__: OBJECT for one in TYPES},
    type_offset=SIZE,
)
Register = _structure("Register", kind=INT, whole=LONG, number=DOUBLE, object=OBJECT)
Call = _structure(
    "Call",
    function=OBJECT,
    self=OBJECT,
    tuples=POINTER,
    results=INT,
    has_results=INT,
    unpack=OBJECT,
)
Slot = _structure("Slot", result=INT, is_whole=INT, address=POINTER)
Read = _structure("Read", count=INT, slots=POINTER)
Input = _structure(
    "Input",
    value=INT,
    ahead=INT,
    conversion=INT,
    has_slope=INT,
    address=POINTER,
    array=OBJECT,
    converter=OBJECT,
    index=INDEX,
    slope_address=POINTER,
    slope_array=OBJECT,
    slope_index=INDEX,
)
FmuCall = _structure(
    "FmuCall",
    kind=INT,
    flag=INT,
    at_end=INT,
    function=POINTER,
    component=POINTER,
    references=POINTER,
    size=SIZE,
    orders=POINTER,
    values=POINTER,
    name=OBJECT,
)
Advance = _structure(
    "Advance",
    inputs=INT,
    calls=INT,
    is_unlocked=INT,
    is_divided=INT,
    input=POINTER,
    call=POINTER,
    span=DOUBLE,
    span_object=OBJECT,
    half=OBJECT,
    fail=OBJECT,
    method=OBJECT,
    self=OBJECT,
)
Past = _structure(
    "Past",
    result=INT,
    ring=INT,
    newest=INT,
    time_register=INT,
    length=LONG,
    whole=LONG,
    ahead=LONG,
    first=LONG,
    part=DOUBLE,
    time=DOUBLE,
    part_object=OBJECT,
    initial=OBJECT,
    history=OBJECT,
)
Keep = _structure("Keep", ring=INT, source=INT, length=LONG)
Move = _structure("Move", result=INT, source=INT)
Line = _structure("Line", result=INT, start=INT, end=INT, two=OBJECT)
Announce = _structure("Announce", event=INT, state=INT, function=OBJECT, self=OBJECT)
Test = _structure("Test", event=INT, ring=INT, always=INT, length=LONG, whole=LONG, first=LONG)
Branch = _structure("Branch", count=INT, tests=POINTER)
Within = _structure(
    "Within",
    result=INT,
    ring=INT,
    length=LONG,
    shift=LONG,
    part=DOUBLE,
    part_object=OBJECT,
    initial=OBJECT,
    history=OBJECT,
)
Stop = _structure(
    "Stop",
    count=INT,
    tests=POINTER,
    last=LONG,
    a=DOUBLE,
    b=DOUBLE,
    q=DOUBLE,
    a_object=OBJECT,
    b_object=OBJECT,
    q_object=OBJECT,
    spans=POINTER,
)
Divide = _structure("Divide", count=INT, stops=POINTER, spans=POINTER)
Land = _structure("Land", divide=POINTER, number=INT)
Record = _structure("Record", count=INT, registers=POINTER, pack=OBJECT)
Operation = _structure("Operation", kind=INT, next=INT, every=LONG, what=POINTER)
Table = _structure(
    "Table",
    a=LONG,
    b=LONG,
    q=DOUBLE,
    times=INT,
    operations=INT,
    operation=POINTER,
    registers=INT,
    living=INT,
    first_living=INT,
    pause=OBJECT,
)
State = _structure(
    "State",
    table=POINTER,
    registers=POINTER,
    stack=POINTER,
    row=POINTER,
    k=LONG,
    end=LONG,
    operation=INT,
    jumps=UINT,
    span=DOUBLE,
)

# In the order in which stepper_size() counts them.
ALL = (
    Python, Register, Call, Slot, Read, Input, FmuCall, Advance, Past, Keep, Move, Line, Announce,
    Test, Branch, Within, Stop, Divide, Land, Record, Operation, Table, State,
)  # fmt: skip


def value_of(register: Any) -> Any:
    """Return what a register holds: an object, a float, a whole number; 0.0 where it is empty."""
    match register.kind:
        case 1:
            return cast(register.object, py_object).value
        case 2:
            return register.number
        case 3:
            return register.whole
    return 0.0
