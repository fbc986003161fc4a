"""What a peer's C needs to become a program: which files, how they are built, and the few lines that call it.

Every program is `run(error, last, moves)`. In: x, vx, y, vy of the drone against its target, and the roll and
pitch last commanded. Out: roll and pitch of the first and of the second move. Buffers that a caller has to
hold stand in these lines, and count.
"""

from dataclasses import dataclass, replace
from typing import Final, Literal

Cost = Literal["1-norm", "quadratic", "quadratic, other problem"]

SIGNATURE: Final = "void run(const float error[4], const float last[2], float moves[4])"
HEAD: Final = f"{SIGNATURE};\n\n{SIGNATURE}\n"


@dataclass(frozen=True)
class Program:
    """How the C of one set-up is built, as the peer's own build files do it.

    `name` is that of a set-up, or of a preset of ours. `sources` are globs in its folder, `includes` folders
    in it; `products` are what generating leaves there beside text.
    """

    name: str
    title: str
    cost: Cost
    scalar: Literal["float32", "float64", "fixed"]
    sources: tuple[str, ...]
    includes: tuple[str, ...]
    glue: str
    defines: tuple[str, ...] = ()
    language: Literal["c", "c++"] = "c"
    dialect: str = "-std=c99"
    products: tuple[str, ...] = ()


_DAQP: Final = (
    '#include "api.h"\n#include "utils.h"\n#include "problem.h"\n\n'
    "static c_float linear[4], plan[4], multipliers[4];\n"
    "static c_float upper[4] = {%(tilt)s, %(tilt)s, %(tilt)s, %(tilt)s};\n"
    "static c_float lower[4] = {-%(tilt)s, -%(tilt)s, -%(tilt)s, -%(tilt)s};\n"
    "static int sense[4];\n"
    "static DAQPProblem problem = {4, 4, 4, hessian, linear, NULL, upper, lower, sense};\n"
    "static DAQPResult result = {plan, multipliers};\n"
    "static DAQPWorkspace workspace;\n"
    "static int is_set_up;\n\n"
    + HEAD.replace("%", "%%")
    + """{
    int i;

    if (!is_set_up) {
        setup_daqp(&problem, &workspace, NULL);
        is_set_up = 1;
    }
    for (i = 0; i < 4; i++) {
        const c_float *row = &from_state[4 * i];

        linear[i] = row[0] * error[0] + row[1] * error[1] + row[2] * error[2] + row[3] * error[3];
    }
    linear[0] -= %(effort)s * last[0];
    linear[1] -= %(effort)s * last[1];
    daqp_update_ldp(DAQP_UPDATE_v, &workspace, &problem);
    daqp_solve(&result, &workspace);
    for (i = 0; i < 4; i++) {
        moves[i] = (float)plan[i];
    }
}
"""
)

_DAQP_SLACKS: Final = (
    '#include "api.h"\n#include "utils.h"\n#include "problem.h"\n\n'
    "static c_float plan[28], multipliers[76];\n"
    "static int sense[76];\n"
    "static DAQPProblem problem = {28, 76, 28, hessian, linear, constraints, upper, lower, sense};\n"
    "static DAQPResult result = {plan, multipliers};\n"
    "static DAQPWorkspace workspace;\n"
    "static int is_set_up;\n\n"
    + HEAD
    + """{
    int i;

    for (i = 0; i < 24; i++) {
        const c_float *row = &from_input[6 * i];

        upper[28 + i] = row[0] * error[0] + row[1] * error[1] + row[2] * error[2] + row[3] * error[3] +
                        row[4] * last[0] + row[5] * last[1];
        upper[52 + i] = -upper[28 + i];
    }
    if (!is_set_up) {
        setup_daqp(&problem, &workspace, NULL);
        is_set_up = 1;
    } else {
        daqp_update_ldp(DAQP_UPDATE_d, &workspace, &problem);
    }
    daqp_solve(&result, &workspace);
    for (i = 0; i < 4; i++) {
        moves[i] = (float)plan[i];
    }
}
"""
)

_OSQP_CONDENSED: Final = (
    '#include "osqp.h"\n#include "workspace.h"\n\n'
    "static const OSQPFloat from_state[4][4] = {%(gradient)s};\n\n"
    + HEAD.replace("%", "%%")
    + """{
    OSQPFloat q[4];
    int i;

    for (i = 0; i < 4; i++) {
        q[i] = from_state[i][0] * error[0] + from_state[i][1] * error[1] + from_state[i][2] * error[2] +
               from_state[i][3] * error[3];
    }
    q[0] -= %(effort)s * last[0];
    q[1] -= %(effort)s * last[1];
    osqp_update_data_vec(&solver, q, OSQP_NULL, OSQP_NULL);
    osqp_solve(&solver);
    for (i = 0; i < 4; i++) {
        moves[i] = (float)solver.solution->x[i];
    }
}
"""
)

_OSQP_STATES: Final = (
    '#include "osqp.h"\n#include "workspace.h"\n\n'
    "static OSQPFloat q[48], lower[48], upper[48];\n\n"
    + HEAD
    + """{
    int i;

    for (i = 44; i < 48; i++) {
        lower[i] = -%(tilt)s;
        upper[i] = %(tilt)s;
    }
    for (i = 0; i < 4; i++) {
        lower[i] = upper[i] = -error[i];
    }
    q[44] = -%(effort)s * last[0];
    q[45] = -%(effort)s * last[1];
    osqp_update_data_vec(&solver, q, lower, upper);
    osqp_solve(&solver);
    for (i = 0; i < 4; i++) {
        moves[i] = (float)solver.solution->x[44 + i];
    }
}
"""
)

_CVXPYGEN: Final = (
    '#include "cpg_workspace.h"\n#include "cpg_solve.h"\n\n'
    + HEAD
    + """{
    int i;

    for (i = 0; i < 4; i++) {
        cpg_update_state(i, error[i]);
    }
    cpg_update_last(0, last[0]);
    cpg_update_last(1, last[1]);
    cpg_solve();
    for (i = 0; i < 4; i++) {
        moves[i] = (float)CPG_Result.prim->moves[i];
    }
}
"""
)

_CLOCK: Final = """#include <time.h>

int clock_gettime(clockid_t clock, struct timespec *now)
{
    (void)clock;
    now->tv_sec = 0;
    now->tv_nsec = 0;
    return 0;
}

"""
"""ECOS takes the time for its log, from a clock that newlib leaves to the board."""

_CASADI: Final = (
    '#include "mpc.h"\n\n'
    "static const casadi_real *arg[mpc_SZ_ARG];\nstatic casadi_real *res[mpc_SZ_RES];\n"
    "static casadi_int iw[mpc_SZ_IW];\nstatic casadi_real w[mpc_SZ_W], found[4];\n\n"
    + HEAD
    + """{
    casadi_real parameters[6];
    int i, memory;

    for (i = 0; i < 4; i++) {
        parameters[i] = error[i];
    }
    parameters[4] = last[0];
    parameters[5] = last[1];
    arg[0] = parameters;
    res[0] = found;
    memory = mpc_checkout();
    mpc(arg, res, iw, w, memory);
    mpc_release(memory);
    for (i = 0; i < 4; i++) {
        moves[i] = (float)found[i];
    }
}
"""
)

_TINYMPC: Final = (
    '#include "tinympc/tiny_api.hpp"\n#include "tinympc/tiny_data.hpp"\n\nextern "C" '
    + HEAD.replace(f"\n\n{SIGNATURE}", f'\n\nextern "C" {SIGNATURE}')
    + """{
    tinyVector x0(4);

    (void)last;
    x0 << error[0], error[1], error[2], error[3];
    tiny_set_x0(&tiny_solver, x0);
    tiny_solve(&tiny_solver);
    for (int i = 0; i < 4; i++) {
        moves[i] = (float)tiny_solver.solution->u(i % 2, i / 2);
    }
}
"""
)


def programs(tilt: str, effort: str, gradient: str) -> tuple[Program, ...]:
    """Return the program of every set-up.

    The arguments are literals of C: the tilt limit, twice the effort weight, and the rows of the gradient of
    the quadratic cost of four level moves, from the state.
    """
    numbers = {"tilt": tilt, "effort": effort, "gradient": gradient}
    ecos = "c/solver_code"
    cvxpygen_osqp = Program(
        "cvxpygen-osqp",
        "CVXPYgen, OSQP",
        "1-norm",
        "float64",
        sources=(
            "c/src/cpg_workspace.c",
            "c/src/cpg_solve.c",
            "c/solver_code/src/*.c",
            "c/solver_code/workspace.c",
        ),
        includes=(
            "c/include",
            "c/solver_code",
            "c/solver_code/inc/public",
            "c/solver_code/inc/private",
        ),
        glue=_CVXPYGEN,
    )
    return (
        Program(
            "daqp",
            "DAQP, four moves, condensed by hand",
            "quadratic",
            "float32",
            sources=("csrc/src/*.c",),
            includes=("csrc/include", "."),
            glue=_DAQP % numbers,
            defines=("DAQP_SINGLE_PRECISION",),
        ),
        Program(
            "daqp-slacks",
            "DAQP, moves and slacks",
            "1-norm",
            "float64",
            sources=("csrc/src/*.c",),
            includes=("csrc/include", "."),
            glue=_DAQP_SLACKS,
        ),
        Program(
            "osqp-condensed",
            "OSQP, four moves, condensed by hand",
            "quadratic",
            "float32",
            sources=("src/*.c", "workspace.c"),
            includes=("inc/public", "inc/private", "."),
            glue=_OSQP_CONDENSED % numbers,
        ),
        Program(
            "osqp-states",
            "OSQP, states and moves",
            "quadratic",
            "float32",
            sources=("src/*.c", "workspace.c"),
            includes=("inc/public", "inc/private", "."),
            glue=_OSQP_STATES % numbers,
        ),
        Program(
            "casadi-qrqp",
            "CasADi, qrqp",
            "quadratic",
            "float32",
            sources=("mpc.c",),
            includes=(".",),
            glue=_CASADI,
        ),
        Program(
            "casadi-sqp",
            "CasADi, sqpmethod on qrqp",
            "quadratic",
            "float32",
            sources=("mpc.c",),
            includes=(".",),
            glue=_CASADI,
        ),
        cvxpygen_osqp,
        replace(cvxpygen_osqp, name="cvxpygen-squares", title="CVXPYgen, OSQP, squares", cost="quadratic"),
        Program(
            "cvxpygen-ecos",
            "CVXPYgen, ECOS",
            "1-norm",
            "float64",
            sources=(
                "c/src/cpg_workspace.c",
                "c/src/cpg_solve.c",
                f"{ecos}/external/amd/src/*.c",
                f"{ecos}/external/ldl/src/ldl.c",
                f"{ecos}/src/[cekpstw]*.c",
            ),
            includes=(
                "c/include",
                f"{ecos}/include",
                f"{ecos}/external/SuiteSparse_config",
                f"{ecos}/external/amd/include",
                f"{ecos}/external/ldl/include",
            ),
            glue=_CLOCK + _CVXPYGEN,
            defines=("_POSIX_TIMERS", "_POSIX_MONOTONIC_CLOCK"),
            dialect="-std=gnu99",
        ),
        Program(
            "tinympc",
            "TinyMPC",
            "quadratic, other problem",
            "float64",
            sources=(
                "src/tiny_data.cpp",
                "tinympc/admm.cpp",
                "tinympc/tiny_api.cpp",
                "tinympc/rho_benchmark.cpp",
            ),
            includes=(".", "include", "include/Eigen", "tinympc"),
            glue=_TINYMPC,
            language="c++",
            dialect="-std=c++17",
            products=("build", "*.so"),
        ),
    )


def host_programs(tilt: str, effort: str, gradient: str) -> tuple[Program, ...]:
    """Return the same, and DAQP and CasADi also in double, their default: in float CasADi often gives up."""
    found = []
    for program in programs(tilt, effort, gradient):
        found.append(program)
        if program.name in ("daqp", "casadi-qrqp", "casadi-sqp"):
            name, title = f"{program.name}-float64", f"{program.title}, double"
            found.append(replace(program, name=name, title=title, scalar="float64", defines=()))
    return tuple(found)
