"""Functions of FMUs, called in any order with any values, as an importer with faults would."""

from __future__ import annotations

import ctypes as c
import zipfile
from functools import cache
from pathlib import Path
from random import Random
from tempfile import mkdtemp
from typing import Any
from xml.etree import ElementTree

import lostmotion as lm
from fuzz.verdict import Failure

SCENARIOS = ("paper-2dof-nl-small", "position-axis", "worm-lowering", "two-motors-one-ring")
NUMBERS = (0.0, 1.0, -1.0, 1e-3, 0.01, 1e-300, 1e300, float("nan"), float("inf"), -float("inf"), 0.1, -0.5, 1e9, 1e-9)
STATUS = range(6)
Log = c.CFUNCTYPE(None, c.c_void_p, c.c_char_p, c.c_int, c.c_char_p, c.c_char_p)
Allocate = c.CFUNCTYPE(c.c_void_p, c.c_size_t, c.c_size_t)
Free = c.CFUNCTYPE(None, c.c_void_p)


class Callbacks(c.Structure):
    _fields_ = (("logger", Log), ("allocate", Allocate), ("free", Free), ("finished", c.c_void_p), ("environment", c.c_void_p))


said: list[bytes] = []
log = Log(lambda environment, name, status, category, message: said.append(message or b""))
libc = c.CDLL(None)
libc.calloc.restype, libc.calloc.argtypes = c.c_void_p, (c.c_size_t, c.c_size_t)
libc.free.argtypes = (c.c_void_p,)
callbacks = Callbacks(log, Allocate(libc.calloc), Free(libc.free), None, None)


@cache
def unpacked(name: str, version: int) -> tuple[Any, Path, list[int], str]:
    """Library, directory, value references and token of the FMU of a scenario."""
    folder = Path(mkdtemp(prefix="fuzz-fmu-"))
    lm.export_fmu(lm.load(name), folder / "x.fmu", fmi=version)
    with zipfile.ZipFile(folder / "x.fmu") as packed:
        packed.extractall(folder)
    root = ElementTree.parse(folder / "modelDescription.xml").getroot()
    references = [int(v.attrib["valueReference"]) for v in root.iter() if "valueReference" in v.attrib]
    library = c.CDLL(str(next((folder / "binaries").rglob("*.so"))))
    return library, folder / "resources", references, root.attrib.get("guid") or root.attrib["instantiationToken"]


class Caller:
    """An instance and what it may be called with."""

    def __init__(self, random: Random, version: int) -> None:
        self.random, self.version = random, version
        self.library, resources, self.references, token = unpacked(random.choice(SCENARIOS), version)
        where = random.choice((resources.as_uri() if version == 2 else f"{resources}/",) * 9 + ("", "nowhere"))
        token = random.choice((token,) * 9 + ("x",))
        self.names = sorted(n for n in CALLS if hasattr(self.library, f"fmi{version}{n}"))
        self.instance = self._made(token.encode(), where.encode())
        self.state = c.c_void_p()

    def _made(self, token: bytes, where: bytes) -> c.c_void_p:
        kind = self.random.randrange(2)
        if self.version == 2:
            make = self.library.fmi2Instantiate
            make.restype = c.c_void_p
            return c.c_void_p(make(b"x", 1 - kind, token, where, c.byref(callbacks), 0, 1))
        make = getattr(self.library, ("fmi3InstantiateCoSimulation", "fmi3InstantiateModelExchange")[kind])
        make.restype = c.c_void_p
        flags = (c.c_bool(False), c.c_bool(True))
        if kind == 0:
            event, early = c.c_bool(self.random.random() < 0.5), c.c_bool(self.random.random() < 0.5)
            more = (event, early, None, c.c_size_t(0), None, log3, None)
        else:
            more = (None, log3)
        return c.c_void_p(make(b"x", token, where, *flags, *more))

    def call(self, name: str) -> int:
        """One function with any values."""
        return int(getattr(self.library, f"fmi{self.version}{name}")(self.instance, *CALLS[name](self)))

    def number(self) -> c.c_double:
        return c.c_double(self.random.choice(NUMBERS))

    def flag(self) -> Any:
        value = self.random.random() < 0.5
        return c.c_int(value) if self.version == 2 else c.c_bool(value)

    def some(self) -> tuple[Any, ...]:
        """References and values, as many of each."""
        count = self.random.randint(0, 3)
        known = [*self.references, 0, 2**31, 99999]
        names = (c.c_uint * count)(*self.random.choices(known, k=count))
        values = (c.c_double * count)(*self.random.choices(NUMBERS, k=count))
        return (names, c.c_size_t(count), values) + ((c.c_size_t(count),) if self.version == 3 else ())

    def many(self) -> tuple[Any, ...]:
        """Room for states or guards, of some wrong length: never less than what is written."""
        count = self.random.choice((0, 1, 5, 6, 16, 64, 1000))
        return (c.c_double * 1000)(), c.c_size_t(count)


log3 = c.CFUNCTYPE(None, c.c_void_p, c.c_int, c.c_char_p, c.c_char_p)(lambda e, s, g, message: said.append(message or b""))


def _step(x: Caller) -> tuple[Any, ...]:
    flags = [c.byref(c.c_bool()) for _ in range(3)]
    last = (*flags, c.byref(c.c_double())) if x.version == 3 else ()
    interval = x.random.choice([n for n in NUMBERS if n != 1e9])  # 1e9 s of a periodic command take hours
    return (x.number(), c.c_double(interval), x.flag(), *last)


def _begin(x: Caller) -> tuple[Any, ...]:
    return (x.flag(), x.number(), x.number(), x.flag(), x.number()) if x.version == 3 else ()


def _updated(x: Caller) -> tuple[Any, ...]:
    if x.version == 2:
        return ((c.c_byte * 64)(),)
    return (*(c.byref(c.c_bool()) for _ in range(5)), c.byref(c.c_double()))


CALLS: dict[str, Any] = {
    "SetupExperiment": lambda x: (x.flag(), x.number(), x.number(), x.flag(), x.number()),
    "EnterInitializationMode": _begin,
    "ExitInitializationMode": lambda x: (),
    "EnterStepMode": lambda x: (),
    "EnterContinuousTimeMode": lambda x: (),
    "EnterEventMode": lambda x: (),
    "Terminate": lambda x: (),
    "Reset": lambda x: (),
    "DoStep": _step,
    "SetReal": Caller.some,
    "GetReal": Caller.some,
    "SetFloat64": Caller.some,
    "GetFloat64": Caller.some,
    "SetTime": lambda x: (x.number(),),
    "SetContinuousStates": Caller.many,
    "GetContinuousStates": Caller.many,
    "GetDerivatives": Caller.many,
    "GetContinuousStateDerivatives": Caller.many,
    "GetEventIndicators": Caller.many,
    "GetNominalsOfContinuousStates": Caller.many,
    "NewDiscreteStates": _updated,
    "UpdateDiscreteStates": _updated,
    "CompletedIntegratorStep": lambda x: (x.flag(), c.byref(c.c_bool()), c.byref(c.c_bool())),
    "GetFMUstate": lambda x: (c.byref(x.state),),
    "SetFMUstate": lambda x: (x.state,),
    "FreeFMUstate": lambda x: (c.byref(x.state),),
    "GetFMUState": lambda x: (c.byref(x.state),),
    "SetFMUState": lambda x: (x.state,),
    "FreeFMUState": lambda x: (c.byref(x.state),),
    "CancelStep": lambda x: (),
}
STARTS = {
    2: ("SetupExperiment", "EnterInitializationMode", "ExitInitializationMode"),
    3: ("EnterInitializationMode", "ExitInitializationMode"),
}


def case(random: Random, folder: Path) -> None:
    """Every call returns a status; errors are explained in one line."""
    caller = Caller(random, random.choice((2, 3)))
    if not caller.instance:
        return
    said.clear()
    names = [*(STARTS[caller.version] if random.random() < 0.7 else ()), *random.choices(caller.names, k=40)]
    calls = folder / "calls.txt"
    with calls.open("w") as out:
        for name in names:
            out.write(f"{name}\n")
            out.flush()
            status = caller.call(name)
            if status not in STATUS:
                raise Failure(f"{name} returns {status}")
            if status == 3 and not said:
                raise Failure(f"{name} returns an error without a message")
            for message in said:
                if b"\n" in message or len(message) > 300:
                    raise Failure(f"{name}: the message is too long: {message!r}")
            said.clear()
    getattr(caller.library, f"fmi{caller.version}FreeInstance")(caller.instance)
