"""Kernels are compiled without a wrapper for Python, which may call them all the same."""

from typing import NamedTuple

import numba
import pytest

from fish_env.model.jit import kernel, py_function


class Flow(NamedTuple):
    """Of water, m/s."""

    ahead: float
    across: float


@kernel
def ratio(flow, scale):
    return Flow(flow.ahead / flow.across, scale * flow.across)


@numba.njit(error_model="numpy")
def calling(flow, scale):
    return ratio(flow, scale)


FLOW = Flow(1.0, 0.3)


def test_python_gets_what_another_kernel_gets():
    """Also after another kernel: the code that it left behind has no way in for Python."""
    inside = calling(FLOW, 2.0)
    assert ratio(FLOW, 2.0) == ratio(FLOW, scale=2.0) == inside == py_function(ratio)(FLOW, 2.0)


def test_python_gets_the_arithmetic_of_the_compiler():
    assert ratio(Flow(1.0, 0.0), 2.0).ahead == float("inf")
    with pytest.raises(ZeroDivisionError):
        py_function(ratio)(Flow(1.0, 0.0), 2.0)


def wrappers(function) -> set[str]:
    """Ways into the compiled code of a function, beside that of other compiled functions."""
    (text,) = function.inspect_llvm().values()
    return {kind for kind in ("cpython", "cfunc") if f"@_ZN7{kind}" in text or f"@{kind}." in text}


def test_a_kernel_has_no_wrappers_and_the_check_sees_them():
    calling(FLOW, 2.0)
    assert wrappers(ratio) == set()
    assert wrappers(calling) == {"cpython", "cfunc"}
