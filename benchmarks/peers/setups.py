"""The peers: how each generates C for the problem, as in its documentation, and how that C is built.

`python -m benchmarks.peers.setups NAME FOLDER` runs in the Python that has the peers and imports nothing of
ours. The last line on stdout is JSON: the versions of the peer's packages.
"""
# ruff: noqa: PLC0415 - a set-up imports only its own peer, since others may be missing

import importlib.metadata
import json
import shutil
import subprocess
import sys
import tarfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.peers.problem import (
    CHANGES,
    CONTROL,
    EFFORT,
    POSITIONS,
    PREDICTION,
    STATE_WEIGHTS,
    TILT_RAD,
    TRACKING,
    A,
    B,
    Matrix,
    condensed,
    move_at,
    quadratic,
)
from benchmarks.peers.programs import ROOT, Program, run_tool

PYTHON: Final = ROOT / "build/peers/bin/python"
"""The Python that has the peers, which the Makefile sets up."""


@dataclass(frozen=True, kw_only=True)
class Peer(Program):
    """A peer with one set-up: the function that writes its C, and the packages whose versions count."""

    set_up: Callable[[Path], None]
    packages: tuple[str, ...]

    def write(self, folder: Path) -> dict[str, str]:
        """Run the set-up in the peers' Python."""
        line = [str(PYTHON), "-m", "benchmarks.peers.setups", self.name, str(folder)]
        versions: dict[str, str] = json.loads(run_tool(line).splitlines()[-1])
        return versions


def daqp_squares(folder: Path) -> None:
    """Write a QP in the four moves for DAQP's C interface: https://darnstrom.github.io/daqp."""
    hessian, gradient = quadratic()
    _daqp(folder, {"hessian[16]": hessian, "from_state[16]": gradient})


def daqp_slacks(folder: Path) -> None:
    """Write the 1-norm for DAQP: four moves, and a slack with two constraints for each of the 24 terms."""
    from_state, from_moves = condensed()
    rows = np.vstack([from_moves, CHANGES])
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


def _daqp_c(folder: Path) -> None:
    """Write DAQP's C.

    It is from the source distribution, which the Makefile stores with the Python of the peers; it lacks the
    code generator.
    """
    (archive,) = Path(sys.prefix, "sdist").glob(f"daqp-{importlib.metadata.version('daqp')}.tar.gz")
    with tarfile.open(archive) as source:
        source.extractall(folder, filter="data")
    (unpacked,) = folder.glob("daqp-*")
    (unpacked / "csrc").rename(folder / "csrc")
    shutil.rmtree(unpacked)


def _daqp(folder: Path, tables: dict[str, Matrix]) -> None:
    """Write DAQP's C, and the problem as `tables` by C declarator."""
    _daqp_c(folder)
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
    _osqp(folder, quadratic()[0], np.eye(4), np.full(4, TILT_RAD), rho=1.0)


def osqp_states(folder: Path) -> None:
    """Write a QP in states and moves, like https://osqp.org/docs/examples/mpc.html.

    Of the same values, only rho = 10 solves all states. With 0.1 three of four states reach the iteration
    limit, with moves up to 0.6 rad beyond theirs.
    """
    states = 4 * (PREDICTION + 1)
    weights = np.zeros((states + 4, states + 4))
    weights[:states, :states] = np.diag(np.tile(STATE_WEIGHTS, PREDICTION + 1))
    weights[states:, states:] = EFFORT * CHANGES.T @ CHANGES
    rules = np.diag([-1.0] * states + [1.0] * 4)
    for step in range(PREDICTION):
        row, move = 4 * (step + 1), states + move_at(step)
        rules[row : row + 4, row - 4 : row] = A
        rules[row : row + 4, move : move + 2] = B
    _osqp(folder, 2 * weights, rules, np.array([0.0] * states + [TILT_RAD] * 4), rho=10.0)


def _osqp(folder: Path, hessian: Matrix, rules: Matrix, limits: Matrix, rho: float) -> None:
    """Write the QP with -limits <= rules x <= limits."""
    import osqp
    from scipy import sparse

    weights, linear = sparse.triu(hessian, format="csc"), np.zeros(len(hessian))
    solver = osqp.OSQP()
    solver.setup(weights, linear, sparse.csc_matrix(rules), -limits, limits, verbose=False, rho=rho)
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
    cost = (
        TRACKING * size(states[list(POSITIONS), 1:])
        + EFFORT * size(moves[:, 0] - last)
        + EFFORT * size(moves[:, 1] - moves[:, 0])
    )
    rules = [states[:, 0] == state, cvxpy.abs(moves) <= TILT_RAD]
    rules += [states[:, k + 1] == A @ states[:, k] + B @ moves[:, move_at(k) // 2] for k in range(PREDICTION)]
    state.value, last.value = np.zeros(4), np.zeros(2)
    problem = cvxpy.Problem(cvxpy.Minimize(cost), rules)
    cpg.generate_code(problem, code_dir=str(folder), solver=solver, wrapper=False)


def _casadi(folder: Path, solver: str, real: str) -> None:
    """Write the QP for qrqp, or for sqpmethod with qrqp: https://web.casadi.org/docs/#generating-c-code."""
    import casadi

    parameters = casadi.MX.sym("parameters", 6)
    moves = casadi.MX.sym("moves", 2 * CONTROL)
    state: Any = parameters[:4]
    last = parameters[4:]
    cost: Any = EFFORT * (casadi.sumsqr(moves[:2] - last) + casadi.sumsqr(moves[2:] - moves[:2]))
    for step in range(PREDICTION):
        state = A @ state + B @ moves[move_at(step) : move_at(step) + 2]
        cost += TRACKING * casadi.sumsqr(state[list(POSITIONS)])
    problem = {"x": moves, "p": parameters, "f": cost}
    if solver == "qrqp":
        solve = casadi.qpsol("solve", "qrqp", problem, _SILENT)
    else:
        options: dict[str, Any] = dict.fromkeys(
            ("print_header", "print_iteration", "print_status", "print_time", "error_on_fail"), False
        )
        options |= {"qpsol": "qrqp", "qpsol_options": _SILENT}
        solve = casadi.nlpsol("solve", "sqpmethod", problem, options)
    found = solve(x0=casadi.DM.zeros(4), p=parameters, lbx=-TILT_RAD, ubx=TILT_RAD)["x"]
    _casadi_c(folder, casadi.Function("mpc", [parameters], [found], ["parameters"], ["moves"]), real)


def _casadi_c(folder: Path, step_function: Any, real: str) -> None:
    import casadi

    generator = casadi.CodeGenerator("mpc.c", {"casadi_real": real, "casadi_int": "int", "with_header": True})
    generator.add(step_function)
    folder.mkdir(parents=True, exist_ok=True)
    generator.generate(f"{folder}/")


def control_step_osqp(folder: Path, rho: float) -> None:
    """Write the control step's problem for OSQP, with tolerances of 1e-4 of the limit."""
    import osqp
    from scipy import sparse

    weights, moves = sparse.csc_matrix(np.triu(_hessian(folder))), sparse.eye(4, format="csc")
    tolerances = {"eps_abs": 1e-4, "eps_rel": 1e-4}
    solver = osqp.OSQP()
    solver.setup(weights, np.zeros(4), moves, -np.ones(4), np.ones(4), verbose=False, rho=rho, **tolerances)
    solver.codegen(str(folder), parameters="vectors", use_float=True, force_rewrite=True, extension_name=None)


def control_step_cvxpygen(folder: Path, solver: str) -> None:
    """Write the control step's problem by CVXPYgen for `solver`."""
    import cvxpy
    from cvxpygen import cpg

    moves, linear = cvxpy.Variable(4, name="moves"), cvxpy.Parameter(4, name="q")
    root = np.linalg.cholesky(_hessian(folder)).T
    cost = 0.5 * cvxpy.sum_squares(root @ moves) + linear @ moves
    linear.value = np.zeros(4)
    problem = cvxpy.Problem(cvxpy.Minimize(cost), [moves <= 1, moves >= -1])
    cpg.generate_code(problem, code_dir=str(folder), solver=solver, wrapper=False)
    (folder / _SOLVER / "runtest.c").unlink(missing_ok=True)


def control_step_casadi(folder: Path) -> None:
    """Write the control step's problem for CasADi's qrqp."""
    import casadi

    linear, moves = casadi.MX.sym("linear", 4), casadi.MX.sym("moves", 4)
    cost = 0.5 * casadi.bilin(casadi.DM(_hessian(folder)), moves, moves) + casadi.dot(linear, moves)
    solve = casadi.qpsol("solve", "qrqp", {"x": moves, "p": linear, "f": cost}, _SILENT)
    found = solve(x0=casadi.DM.zeros(4), p=linear, lbx=-1, ubx=1)["x"]
    _casadi_c(folder, casadi.Function("mpc", [linear], [found], ["linear"], ["moves"]), "double")


def _hessian(folder: Path) -> Matrix:
    return np.array(json.loads((folder.parent / "hessian.json").read_text("utf-8")))


def tinympc(folder: Path) -> None:
    """Write TinyMPC's LQR-like problem: https://tinympc.org/docs, code generation.

    It supports neither move blocking nor weights on changes: ten moves, each with its own weight.
    """
    import tinympc

    solver = tinympc.TinyMPC()
    solver.setup(A, B, np.diag(STATE_WEIGHTS), EFFORT * np.eye(2), PREDICTION + 1)
    limits = np.full(2, TILT_RAD)
    solver.set_bound_constraints(u_min=-limits, u_max=limits, x_min=None, x_max=None)
    try:
        solver.codegen(str(folder))
    except subprocess.CalledProcessError:
        # It has written the C++; building its Python module fails without a network (it clones pybind11).
        if not (folder / "src" / "tiny_data.cpp").exists():
            raise
    shutil.rmtree(folder / "build", ignore_errors=True)
    for library in folder.glob("*.so"):
        library.unlink()


_SILENT: Final = {"print_header": False, "print_iter": False, "print_info": False, "error_on_fail": False}
"""Options of qrqp."""
_LIMIT: Final = f"TILT={TILT_RAD}f"
_EFFORT: Final = f"EFFORT={2 * EFFORT}f"
"""The gradient of the effort per change of a move."""
_GRADIENT: Final = "GRADIENT=" + ",".join(
    "{" + ",".join(f"{float(np.float32(value))!r}f" for value in row) + "}" for row in quadratic()[1]
)
_DAQP: Final = Peer(
    name="daqp",
    title="DAQP, four moves, condensed by hand",
    cost="quadratic",
    scalar="float32",
    sources=("csrc/src/*.c",),
    includes=("csrc/include", "."),
    glue="glue/daqp.c",
    defines=(_LIMIT, _EFFORT, "DAQP_SINGLE_PRECISION"),
    set_up=daqp_squares,
    packages=("daqp",),
)
_OSQP: Final = Peer(
    name="osqp-condensed",
    title="OSQP, four moves, condensed by hand",
    cost="quadratic",
    scalar="float32",
    sources=("src/*.c", "workspace.c"),
    includes=("inc/public", "inc/private", "."),
    glue="glue/osqp_condensed.c",
    defines=(_EFFORT, _GRADIENT),
    set_up=osqp_condensed,
    packages=("osqp",),
)
_QRQP: Final = Peer(
    name="casadi-qrqp",
    title="CasADi, qrqp",
    cost="quadratic",
    scalar="float32",
    sources=("mpc.c",),
    includes=(".",),
    glue="glue/casadi.c",
    set_up=partial(_casadi, solver="qrqp", real="float"),
    packages=("casadi",),
)
_SQP: Final = replace(
    _QRQP,
    name="casadi-sqp",
    title="CasADi, sqpmethod on qrqp",
    set_up=partial(_casadi, solver="sqpmethod", real="float"),
)
_GENERATED: Final = ("c/src/cpg_workspace.c", "c/src/cpg_solve.c")
_SOLVER: Final = "c/solver_code"
_CVXPYGEN: Final = Peer(
    name="cvxpygen-osqp",
    title="CVXPYgen, OSQP",
    cost="1-norm",
    scalar="float64",
    sources=(*_GENERATED, f"{_SOLVER}/src/*.c", f"{_SOLVER}/workspace.c"),
    includes=("c/include", _SOLVER, f"{_SOLVER}/inc/public", f"{_SOLVER}/inc/private"),
    glue="glue/cvxpygen.c",
    set_up=partial(_cvxpygen, solver="OSQP", measure="norm1"),
    packages=("cvxpygen", "cvxpy", "osqp"),
)
_ECOS: Final = replace(
    _CVXPYGEN,
    name="cvxpygen-ecos",
    title="CVXPYgen, ECOS",
    sources=(
        *_GENERATED,
        f"{_SOLVER}/external/amd/src/*.c",
        f"{_SOLVER}/external/ldl/src/ldl.c",
        f"{_SOLVER}/src/[cekpstw]*.c",
    ),
    includes=(
        "c/include",
        f"{_SOLVER}/include",
        f"{_SOLVER}/external/SuiteSparse_config",
        f"{_SOLVER}/external/amd/include",
        f"{_SOLVER}/external/ldl/include",
    ),
    defines=("NEEDS_CLOCK", "_POSIX_TIMERS", "_POSIX_MONOTONIC_CLOCK"),
    dialect="-std=gnu99",
    set_up=partial(_cvxpygen, solver="ECOS", measure="norm1"),
    packages=("cvxpygen", "cvxpy", "ecos"),
)
_TINYMPC: Final = Peer(
    name="tinympc",
    title="TinyMPC",
    cost="quadratic, other problem",
    scalar="float64",
    sources=("src/tiny_data.cpp", "tinympc/admm.cpp", "tinympc/tiny_api.cpp", "tinympc/rho_benchmark.cpp"),
    includes=(".", "include", "include/Eigen", "tinympc"),
    glue="glue/tinympc.cpp",
    language="c++",
    dialect="-std=c++17",
    set_up=tinympc,
    packages=("tinympc",),
)


def _double(peer: Peer, set_up: Callable[[Path], None], defines: tuple[str, ...] = ()) -> Peer:
    name, title = f"{peer.name}{DOUBLE}", f"{peer.title}, double"
    return replace(peer, name=name, title=title, scalar="float64", set_up=set_up, defines=defines)


DOUBLE: Final = "-float64"
"""Suffix of peers that are also timed in double, their default: in float CasADi often fails."""
PEERS: Final = (
    _DAQP,
    _double(_DAQP, daqp_squares, (_LIMIT, _EFFORT)),
    replace(
        _DAQP,
        name="daqp-slacks",
        title="DAQP, moves and slacks",
        cost="1-norm",
        scalar="float64",
        glue="glue/daqp_slacks.c",
        defines=(),
        set_up=daqp_slacks,
    ),
    _OSQP,
    replace(
        _OSQP,
        name="osqp-states",
        title="OSQP, states and moves",
        glue="glue/osqp_states.c",
        defines=(_LIMIT, _EFFORT),
        set_up=osqp_states,
    ),
    _QRQP,
    _double(_QRQP, partial(_casadi, solver="qrqp", real="double")),
    _SQP,
    _double(_SQP, partial(_casadi, solver="sqpmethod", real="double")),
    _CVXPYGEN,
    replace(
        _CVXPYGEN,
        name="cvxpygen-squares",
        title="CVXPYgen, OSQP, squares",
        cost="quadratic",
        set_up=partial(_cvxpygen, solver="OSQP", measure="sum_squares"),
    ),
    _ECOS,
    _TINYMPC,
)

_STEP_DAQP: Final = replace(
    _DAQP,
    name="control-step-daqp",
    includes=(*_DAQP.includes, ".."),
    title="DAQP, float",
    glue="glue/quadratic_daqp.c",
    defines=("DAQP_SINGLE_PRECISION",),
    set_up=_daqp_c,
)
_STEP_OSQP: Final = replace(
    _OSQP,
    name="control-step-osqp",
    includes=(*_OSQP.includes, ".."),
    title="OSQP, float",
    glue="glue/quadratic_osqp.c",
    defines=(),
    set_up=partial(control_step_osqp, rho=1.0),
)
_STEP_CVXPYGEN: Final = replace(
    _CVXPYGEN,
    name="control-step-cvxpygen-osqp",
    includes=(*_CVXPYGEN.includes, ".."),
    title="CVXPYgen, OSQP, double",
    cost="quadratic",
    glue="glue/quadratic_cvxpygen.c",
    set_up=partial(control_step_cvxpygen, solver="OSQP"),
)
CONTROL_STEP: Final = (
    _STEP_DAQP,
    replace(_STEP_DAQP, name="control-step-daqp-double", title="DAQP, double", scalar="float64", defines=()),
    _STEP_OSQP,
    replace(
        _QRQP,
        name="control-step-casadi",
        includes=(*_QRQP.includes, ".."),
        title="CasADi, qrqp, double",
        scalar="float64",
        glue="glue/quadratic_casadi.c",
        set_up=control_step_casadi,
    ),
    _STEP_CVXPYGEN,
    replace(
        _STEP_CVXPYGEN,
        name="control-step-cvxpygen-qoco",
        title="CVXPYgen, QOCO, double",
        sources=(*_GENERATED, f"{_SOLVER}/*.c"),
        includes=("c/include", _SOLVER, ".."),
        defines=("SET_UP",),
        dialect="-std=gnu99",
        set_up=partial(control_step_cvxpygen, solver="QOCOGEN"),
        packages=("cvxpygen", "cvxpy", "qocogen"),
    ),
)
"""Peers on the problem of a control step of preset mambo, which stands in the folder above their C."""


def main() -> None:
    """Write the C of the peer NAME into FOLDER."""
    name, folder = sys.argv[1:]
    (peer,) = (peer for peer in (*PEERS, *CONTROL_STEP) if peer.name == name)
    peer.set_up(Path(folder))
    print()
    print(json.dumps({package: importlib.metadata.version(package) for package in peer.packages}))


if __name__ == "__main__":
    main()
