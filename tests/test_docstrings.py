"""The examples in docstrings of public names run and print what they show."""

from __future__ import annotations

import doctest
import importlib

import numpy as np
import pytest

import gough

PUBLIC = [getattr(gough, name) for name in gough.__all__[1:]]
MODULES = sorted({getattr(one, "__module__", one.__name__) for one in PUBLIC})  # cluster is one


@pytest.mark.parametrize("name", MODULES)
def test_examples_print_what_they_show(name: str) -> None:
    known = {"gough": gough, "np": np}
    failed, _ = doctest.testmod(importlib.import_module(name), extraglobs=known)
    assert not failed


def test_there_are_examples() -> None:
    finder = doctest.DocTestFinder()
    found = [test for name in MODULES for test in finder.find(importlib.import_module(name))]
    assert sum(bool(test.examples) for test in found) >= 5
