"""The comparison with DAQP gives both contenders the problem of preset mambo."""

import re
from pathlib import Path

import numpy as np

from benchmarks.peers.quadratic_times import (
    OURS,
    SETTINGS,
    Array,
    build,
    one_pass,
    share_limited,
    write_problem,
)
from mambo_codegen.methods.quadratic.arithmetic import QuadraticArithmetic
from mambo_codegen.methods.quadratic.attitude import AttitudeModel
from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.methods.quadratic.optimizer import QuadraticOptimizer
from tests.support.tools import require

DESIGN = Quadratic(SETTINGS)


def tables(folder: Path) -> dict[str, Array]:
    """Return the arrays of problem.h by name."""
    text = (folder / "problem.h").read_text()
    found = re.findall(r"c_float (?:const )?(\w+)\[\d+\] = \{([^}]*)\}", text)
    return {name: np.array([float(number) for number in numbers.split(",")]) for name, numbers in found}


def states(n: int) -> Array:
    """Return states (n, 2, 8), half of which reach the limit."""
    scale = (
        np.array([1.0, 0.02, 1e-4, 1e-6, 1e-4, 1e-5, 1e-4, 1e-4]) * 10.0 ** -(np.arange(n) % 2)[:, None, None]
    )
    return np.ascontiguousarray(np.random.default_rng(0).uniform(-1, 1, (n, 2, 8)) * scale, np.float32)


def test_without_limits_the_solution_is_that_of_the_rows(tmp_path: Path) -> None:
    """H moves = -gradient gives the free moves of each axis, as shares of its limit."""
    write_problem(tmp_path)
    problem = tables(tmp_path)
    hessian, gradient = problem["hessian"].reshape(4, 4), problem["from_state"].reshape(4, 8)
    moves = -np.linalg.solve(hessian, gradient).reshape(2, 2, 8) * problem["limits"][:, None, None]
    np.testing.assert_allclose(moves, DESIGN.law.rows, rtol=1e-9, atol=1e-12)


def test_our_contender_has_the_bits_of_the_reference(tmp_path: Path) -> None:
    """At the limit and within."""
    require("gcc", "gcc")
    OURS.write(tmp_path)
    drawn = states(400)
    assert 0.1 < share_limited(drawn) < 0.9
    moves, _ = one_pass(build(OURS, tmp_path, "-O2", tmp_path / "ours.so"), drawn)
    products = QuadraticArithmetic(DESIGN)
    optimizer = QuadraticOptimizer(DESIGN, products, AttitudeModel(DESIGN, products).command_limit)
    assert np.array_equal(moves, optimizer.minimize(drawn))
