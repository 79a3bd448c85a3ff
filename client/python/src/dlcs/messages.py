# SPDX-License-Identifier: Apache-2.0
"""The messages and services of the contract, made from its descriptors at run time.

No generated code: any protobuf from 3.20 on serves. The descriptors live in a pool of their own, so that other packages
may have other versions of the same messages.
"""

import pathlib
from typing import Any, Dict

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

_PACKAGE = "dlcs.v1"


def _contract() -> bytes:
    """The serialized FileDescriptorSet: beside this file in a wheel, in proto/ in the source tree."""
    here = pathlib.Path(__file__).resolve().parent
    shipped = here / "contract.binpb"
    if shipped.exists():
        return shipped.read_bytes()
    return (here.parents[3] / "proto" / "released.binpb").read_bytes()


def _load() -> descriptor_pool.DescriptorPool:
    files = descriptor_pb2.FileDescriptorSet()
    files.ParseFromString(_contract())
    pool = descriptor_pool.DescriptorPool()
    waiting = {file.name: file for file in files.file}

    def add(name: str) -> None:
        file = waiting.pop(name, None)
        if file is None:
            return
        for needed in file.dependency:
            add(needed)
        pool.AddSerializedFile(file.SerializeToString())

    for name in list(waiting):
        add(name)
    return pool


_POOL = _load()
_CLASSES: Dict[str, Any] = {}
_FACTORY = None if hasattr(message_factory, "GetMessageClass") else message_factory.MessageFactory(_POOL)


def class_of(descriptor: Any) -> Any:
    """The message class of a descriptor of the pool."""
    if descriptor.full_name not in _CLASSES:
        make = message_factory.GetMessageClass if _FACTORY is None else _FACTORY.GetPrototype
        _CLASSES[descriptor.full_name] = make(descriptor)
    return _CLASSES[descriptor.full_name]


def message(full_name: str) -> Any:
    """The class of a message such as "google.rpc.Status"."""
    return class_of(_POOL.FindMessageTypeByName(full_name))


def service(name: str) -> Any:
    """The descriptor of a service such as "SolverService"."""
    return _POOL.FindServiceByName(f"{_PACKAGE}.{name}")


def enum_value(enum: str, name: str) -> int:
    """The number of an enumerator such as ("Method", "METHOD_EVENT_DRIVEN")."""
    return _POOL.FindEnumTypeByName(f"{_PACKAGE}.{enum}").values_by_name[name].number


def enum_name(enum: str, number: int) -> str:
    """The enumerator of a number; the number as text if this version does not know it."""
    value = _POOL.FindEnumTypeByName(f"{_PACKAGE}.{enum}").values_by_number.get(number)
    return value.name if value else str(number)


def __getattr__(name: str) -> Any:
    """messages.SolveRequest and so on: the messages of dlcs.v1."""
    try:
        return message(f"{_PACKAGE}.{name}")
    except KeyError as error:
        raise AttributeError(f"the contract has no message {name}") from error
