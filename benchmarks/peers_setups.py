"""Generate the C of each peer for the problem of the comparison, set up as in the peer's documentation.

`python -m benchmarks.peers_setups NAME FOLDER` runs in the Python that has the peer and imports nothing of
ours. The last line on stdout is JSON: the versions of the peer's packages.

The problem: eq 8 at psi = 0 with a thrust of 9.81 m/s2 and eq 11 subtracted, so that the state is the error
x, vx, y, vy of the drone against its target, and a move is roll, pitch:

    x'' = -9.81 pitch    y'' = 9.81 roll    |roll|, |pitch| <= 0.35

over 10 steps of 0.055 s, with two moves, the second of them held (Np 10, Nc 2), and the weights of Table I on
the position error and on the change of the moves.
"""
# ruff: noqa: PLC0415 - a set-up imports only its own peer, since others may be missing

import importlib.metadata
import json
import shutil
import subprocess
import sys
import tarfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

Matrix = npt.NDArray[np.float64]

PREDICTION: Final = 10
CONTROL: Final = 2
STEP_S: Final = 0.055
GRAVITY_M_S2: Final = 9.81
TILT_RAD: Final = 0.35
TRACKING: Final = 2250.0
EFFORT: Final = 1.0

_HALF: Final = STEP_S * STEP_S / 2
A: Final = np.kron(np.eye(2), np.array([[1.0, STEP_S], [0.0, 1.0]]))
"""(4, 4) from the state to the next state."""
B: Final = GRAVITY_M_S2 * np.array([[0.0, -_HALF], [0.0, -STEP_S], [_HALF, 0.0], [STEP_S, 0.0]])
"""(4, 2) from roll and pitch to the next state."""
POSITIONS: Final = (0, 2)
"""Indices of the positions in the state."""


def condensed() -> tuple[Matrix, Matrix]:
    """Return the predicted positions, (20, 4) from the state and (20, 4) from the moves."""
    free, forced = np.eye(4), np.zeros((4, 4))
    from_state, from_moves = [], []
    for step in range(PREDICTION):
        move = min(step, CONTROL - 1)
        free, forced = A @ free, A @ forced
        forced[:, 2 * move : 2 * move + 2] += B
        from_state.append(free[POSITIONS, :])
        from_moves.append(forced[POSITIONS, :])
    return np.vstack(from_state), np.vstack(from_moves)


def changes() -> Matrix:
    """Return the matrix (4, 4) from the moves to their changes; the first two lack the last command."""
    return np.eye(4) - np.eye(4, k=-2)


def literals() -> tuple[str, str, str]:
    """Return C literals: tilt limit, twice the effort weight, and the gradient matrix (4, 4) of the state."""
    from_state, from_moves = condensed()
    gradient = 2 * TRACKING * from_moves.T @ from_state
    rows = ("{" + ", ".join(f"{float(np.float32(v))!r}f" for v in row) + "}" for row in gradient)
    return f"{TILT_RAD}f", f"{2 * EFFORT}f", ", ".join(rows)


def hessian() -> Matrix:
    """Return the Hessian (4, 4) of the quadratic cost."""
    _, moves = condensed()
    found: Matrix = 2 * (TRACKING * moves.T @ moves + EFFORT * changes().T @ changes())
    return found


def daqp_squares(folder: Path) -> None:
    """Write a QP in the four moves for DAQP's C interface: https://darnstrom.github.io/daqp."""
    from_state, from_moves = condensed()
    _daqp(folder, {"hessian[16]": hessian(), "from_state[16]": 2 * TRACKING * from_moves.T @ from_state})


def daqp_slacks(folder: Path) -> None:
    """Write the 1-norm for DAQP: four moves, and a slack with two constraints for each of the 24 terms."""
    from_state, from_moves = condensed()
    rows = np.vstack([from_moves, changes()])
    terms = len(rows)
    from_input = np.zeros((terms, 6))
    from_input[:-4, :4] = -from_state
    from_input[-4:-2, 4:] = np.eye(2)
    weights = np.concatenate([np.zeros(4), np.full(terms - 4, TRACKING), np.full(4, EFFORT)])
    constraints = np.vstack([np.hstack([sign * rows, -np.eye(terms)]) for sign in (1, -1)])
    _daqp(
        folder,
        {
            "hessian[784]": np.zeros((28, 28)),
            "linear[28]": weights,
            "constraints[1344]": constraints,
            "from_input[144]": from_input,
            "upper[76]": np.concatenate([np.full(4, TILT_RAD), np.full(72, 1e30)]),
            "lower[76]": np.concatenate([np.full(4, -TILT_RAD), np.zeros(24), np.full(48, -1e30)]),
        },
    )


def _daqp(folder: Path, tables: dict[str, Matrix]) -> None:
    """Write DAQP's C, and the problem as `tables` by C declarator.

    The C is from the source distribution, which the Makefile stores with the Python of the peers; it lacks
    the code generator.
    """
    (archive,) = Path(sys.prefix, "sdist").glob(f"daqp-{importlib.metadata.version('daqp')}.tar.gz")
    with tarfile.open(archive) as source:
        source.extractall(folder, filter="data")
    (unpacked,) = folder.glob("daqp-*")
    (unpacked / "csrc").rename(folder / "csrc")
    shutil.rmtree(unpacked)
    (folder / "problem.h").write_text(
        "".join(
            f"static c_float {name} = {{{', '.join(repr(float(v)) for v in table.ravel())}}};\n"
            for name, table in tables.items()
        )
    )


def osqp_condensed(folder: Path) -> None:
    """Write a QP in the four moves, condensed by hand: https://osqp.org/docs/codegen/python.html.

    Code generated for vectors cannot adapt rho. Of 0.1 (default), 1, 10, 100 and 1000, rho = 1 takes the
    fewest iterations.
    """
    import osqp
    from scipy import sparse

    solver = osqp.OSQP()
    solver.setup(
        sparse.triu(hessian(), format="csc"),
        np.zeros(4),
        sparse.identity(4, format="csc"),
        np.full(4, -TILT_RAD),
        np.full(4, TILT_RAD),
        verbose=False,
        rho=1.0,
    )
    solver.codegen(str(folder), parameters="vectors", use_float=True, force_rewrite=True, extension_name=None)


def osqp_states(folder: Path) -> None:
    """Write a QP in states and moves, like https://osqp.org/docs/examples/mpc.html.

    Of the same values, only rho = 10 solves all states. With 0.1 three of four states reach the iteration
    limit, with moves up to 0.6 rad beyond theirs.
    """
    import osqp
    from scipy import sparse

    states = 4 * (PREDICTION + 1)
    weight = np.array([TRACKING if i in POSITIONS else 0.0 for i in range(4)])
    blocks = [
        sparse.kron(sparse.identity(PREDICTION + 1), sparse.diags(weight)),
        sparse.csc_matrix(EFFORT * changes().T @ changes()),
    ]
    weights = 2 * sparse.block_diag(blocks)
    moved = np.zeros((states, 4))
    for step in range(PREDICTION):
        move = 2 * min(step, CONTROL - 1)
        moved[4 * (step + 1) : 4 * (step + 2), move : move + 2] = B
    stepped = sparse.kron(sparse.identity(PREDICTION + 1), -np.eye(4)) + sparse.kron(
        sparse.eye(PREDICTION + 1, k=-1), A
    )
    bounds = sparse.hstack([sparse.csc_matrix((4, states)), sparse.identity(4)])
    constraints = sparse.vstack([sparse.hstack([stepped, sparse.csc_matrix(moved)]), bounds], format="csc")
    solver = osqp.OSQP()
    solver.setup(
        sparse.triu(weights, format="csc"),
        np.zeros(states + 4),
        constraints,
        np.concatenate([np.zeros(states), np.full(4, -TILT_RAD)]),
        np.concatenate([np.zeros(states), np.full(4, TILT_RAD)]),
        verbose=False,
        rho=10.0,
    )
    solver.codegen(str(folder), parameters="vectors", use_float=True, force_rewrite=True, extension_name=None)


def _cvxpygen(folder: Path, solver: str, measure: str) -> None:
    """Write the problem for `solver`, like the MPC example of https://github.com/cvxgrp/cvxpygen."""
    import cvxpy
    from cvxpygen import cpg

    size = getattr(cvxpy, measure)
    moves = cvxpy.Variable((2, CONTROL), name="moves")
    states = cvxpy.Variable((4, PREDICTION + 1), name="states")
    state = cvxpy.Parameter(4, name="state")
    last = cvxpy.Parameter(2, name="last")
    held = [moves[:, min(step, CONTROL - 1)] for step in range(PREDICTION)]
    cost = (
        TRACKING * size(states[list(POSITIONS), 1:])
        + EFFORT * size(moves[:, 0] - last)
        + EFFORT * size(moves[:, 1] - moves[:, 0])
    )
    rules = [states[:, 0] == state, cvxpy.abs(moves) <= TILT_RAD]
    rules += [states[:, k + 1] == A @ states[:, k] + B @ held[k] for k in range(PREDICTION)]
    state.value, last.value = np.zeros(4), np.zeros(2)
    problem = cvxpy.Problem(cvxpy.Minimize(cost), rules)
    cpg.generate_code(problem, code_dir=str(folder), solver=solver, wrapper=False)


def _casadi(folder: Path, solver: str, real: str) -> None:
    """Write the QP for qrqp, or for sqpmethod with qrqp: https://web.casadi.org/docs/#generating-c-code."""
    import casadi

    parameters = casadi.MX.sym("parameters", 6)
    moves = casadi.MX.sym("moves", 2 * CONTROL)
    state, last = parameters[:4], parameters[4:]
    cost: Any = EFFORT * (casadi.sumsqr(moves[:2] - last) + casadi.sumsqr(moves[2:] - moves[:2]))
    for step in range(PREDICTION):
        move = 2 * min(step, CONTROL - 1)
        state = A @ state + B @ moves[move : move + 2]
        cost += TRACKING * casadi.sumsqr(state[list(POSITIONS)])
    problem = {"x": moves, "p": parameters, "f": cost}
    silent = {"print_header": False, "print_iter": False, "print_info": False, "error_on_fail": False}
    if solver == "qrqp":
        solve = casadi.qpsol("solve", "qrqp", problem, silent)
    else:
        options = {
            "qpsol": "qrqp",
            "qpsol_options": silent,
            "print_header": False,
            "print_iteration": False,
            "print_status": False,
            "print_time": False,
            "error_on_fail": False,
        }
        solve = casadi.nlpsol("solve", "sqpmethod", problem, options)
    found = solve(x0=casadi.DM.zeros(4), p=parameters, lbx=-TILT_RAD, ubx=TILT_RAD)["x"]
    step_function = casadi.Function("mpc", [parameters], [found], ["parameters"], ["moves"])
    generator = casadi.CodeGenerator("mpc.c", {"casadi_real": real, "casadi_int": "int", "with_header": True})
    generator.add(step_function)
    folder.mkdir(parents=True, exist_ok=True)
    generator.generate(f"{folder}/")


def tinympc(folder: Path) -> None:
    """Write TinyMPC's LQR-like problem: https://tinympc.org/docs, code generation.

    It supports neither move blocking nor weights on changes: ten moves, each with its own weight.
    """
    import tinympc

    weight = np.diag([TRACKING if i in POSITIONS else 0.0 for i in range(4)])
    solver = tinympc.TinyMPC()
    solver.setup(A, B, weight, EFFORT * np.eye(2), PREDICTION + 1)
    solver.set_bound_constraints(
        u_min=np.full(2, -TILT_RAD), u_max=np.full(2, TILT_RAD), x_min=None, x_max=None
    )
    try:
        solver.codegen(str(folder))
    except subprocess.CalledProcessError:
        # It has written the C++; building its Python module fails without a network (it clones pybind11).
        if not (folder / "src" / "tiny_data.cpp").exists():
            raise


_CVXPYGEN: Final = ("cvxpygen", "cvxpy", "osqp")
SETUPS: Final[dict[str, tuple[Callable[[Path], None], tuple[str, ...]]]] = {
    "daqp": (daqp_squares, ("daqp",)),
    "daqp-float64": (daqp_squares, ("daqp",)),
    "daqp-slacks": (daqp_slacks, ("daqp",)),
    "osqp-condensed": (osqp_condensed, ("osqp",)),
    "osqp-states": (osqp_states, ("osqp",)),
    "cvxpygen-osqp": (partial(_cvxpygen, solver="OSQP", measure="norm1"), _CVXPYGEN),
    "cvxpygen-ecos": (partial(_cvxpygen, solver="ECOS", measure="norm1"), ("cvxpygen", "cvxpy", "ecos")),
    "cvxpygen-squares": (partial(_cvxpygen, solver="OSQP", measure="sum_squares"), _CVXPYGEN),
    "casadi-qrqp": (partial(_casadi, solver="qrqp", real="float"), ("casadi",)),
    "casadi-qrqp-float64": (partial(_casadi, solver="qrqp", real="double"), ("casadi",)),
    "casadi-sqp": (partial(_casadi, solver="sqpmethod", real="float"), ("casadi",)),
    "casadi-sqp-float64": (partial(_casadi, solver="sqpmethod", real="double"), ("casadi",)),
    "tinympc": (tinympc, ("tinympc",)),
}
"""Set-ups by name: the function that writes the C, and the packages whose versions are reported."""


def main() -> None:
    """Write the C of the set-up NAME into FOLDER."""
    name, folder = sys.argv[1:]
    write, packages = SETUPS[name]
    write(Path(folder))
    print()
    print(json.dumps({package: importlib.metadata.version(package) for package in packages}))


if __name__ == "__main__":
    main()
