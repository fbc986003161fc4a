"""How the C of each peer becomes a program: source files, build flags, and the glue code that calls it.

Every program is `run(error, last, moves)`. Inputs: position and velocity error x, vx, y, vy (m, m/s), and the
last commanded roll and pitch (rad). Output: roll and pitch of both moves (rad). Buffers that the caller must
provide are in the glue code and count.
"""

from dataclasses import dataclass, replace
from typing import Final, Literal

Cost = Literal["1-norm", "quadratic", "quadratic, other problem"]

SIGNATURE: Final = "void run(const float error[4], const float last[2], float moves[4])"
HEAD: Final = f"{SIGNATURE};\n\n{SIGNATURE}\n"


@dataclass(frozen=True)
class Program:
    """How the C of one set-up is built, following the peer's own build files.

    `name` is that of a set-up, or of one of our presets. `sources` are globs and `includes` folders in the
    generated folder; `products` are binaries that generating leaves there.
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


def _glue(declarations: str, body: str, move: str) -> str:
    """Return the C of `run`: `body` solves, `move` is the expression of move i."""
    return f"""{declarations}
{HEAD}{{
    int i;

{body}    for (i = 0; i < 4; i++) {{
        moves[i] = (float){move};
    }}
}}
"""


_DAQP: Final = _glue(
    """#include "api.h"
#include "utils.h"
#include "problem.h"

static c_float linear[4], plan[4], multipliers[4];
static c_float upper[4] = {TILT, TILT, TILT, TILT};
static c_float lower[4] = {-TILT, -TILT, -TILT, -TILT};
static int sense[4];
static DAQPProblem problem = {4, 4, 4, hessian, linear, NULL, upper, lower, sense};
static DAQPResult result = {plan, multipliers};
static DAQPWorkspace workspace;
static int is_set_up;
""",
    """    if (!is_set_up) {
        setup_daqp(&problem, &workspace, NULL);
        is_set_up = 1;
    }
    for (i = 0; i < 4; i++) {
        const c_float *row = &from_state[4 * i];

        linear[i] = row[0] * error[0] + row[1] * error[1] + row[2] * error[2] + row[3] * error[3];
    }
    linear[0] -= EFFORT * last[0];
    linear[1] -= EFFORT * last[1];
    daqp_update_ldp(DAQP_UPDATE_v, &workspace, &problem);
    daqp_solve(&result, &workspace);
""",
    "plan[i]",
)
_DAQP_SLACKS: Final = _glue(
    """#include "api.h"
#include "utils.h"
#include "problem.h"

static c_float plan[28], multipliers[76];
static int sense[76];
static DAQPProblem problem = {28, 76, 28, hessian, linear, constraints, upper, lower, sense};
static DAQPResult result = {plan, multipliers};
static DAQPWorkspace workspace;
static int is_set_up;
""",
    """    for (i = 0; i < 24; i++) {
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
""",
    "plan[i]",
)
_OSQP_CONDENSED: Final = _glue(
    """#include "osqp.h"
#include "workspace.h"

static const OSQPFloat from_state[4][4] = {GRADIENT};
""",
    """    OSQPFloat q[4];

    for (i = 0; i < 4; i++) {
        q[i] = from_state[i][0] * error[0] + from_state[i][1] * error[1] + from_state[i][2] * error[2] +
               from_state[i][3] * error[3];
    }
    q[0] -= EFFORT * last[0];
    q[1] -= EFFORT * last[1];
    osqp_update_data_vec(&solver, q, OSQP_NULL, OSQP_NULL);
    osqp_solve(&solver);
""",
    "solver.solution->x[i]",
)
_OSQP_STATES: Final = _glue(
    """#include "osqp.h"
#include "workspace.h"

static OSQPFloat q[48], lower[48], upper[48];
""",
    """    for (i = 44; i < 48; i++) {
        lower[i] = -TILT;
        upper[i] = TILT;
    }
    for (i = 0; i < 4; i++) {
        lower[i] = upper[i] = -error[i];
    }
    q[44] = -EFFORT * last[0];
    q[45] = -EFFORT * last[1];
    osqp_update_data_vec(&solver, q, lower, upper);
    osqp_solve(&solver);
""",
    "solver.solution->x[44 + i]",
)
_CVXPYGEN: Final = _glue(
    """#include "cpg_workspace.h"
#include "cpg_solve.h"
""",
    """    for (i = 0; i < 4; i++) {
        cpg_update_state(i, error[i]);
    }
    cpg_update_last(0, last[0]);
    cpg_update_last(1, last[1]);
    cpg_solve();
""",
    "CPG_Result.prim->moves[i]",
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
"""ECOS reads a clock for its log; newlib leaves clock_gettime to the board."""
_CASADI: Final = _glue(
    """#include "mpc.h"

static const casadi_real *arg[mpc_SZ_ARG];
static casadi_real *res[mpc_SZ_RES];
static casadi_int iw[mpc_SZ_IW];
static casadi_real w[mpc_SZ_W], found[4];
""",
    """    casadi_real parameters[6];
    int memory;

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
""",
    "found[i]",
)
_TINYMPC: Final = _glue(
    """#include "tinympc/tiny_api.hpp"
#include "tinympc/tiny_data.hpp"
""",
    """    tinyVector x0(4);

    (void)last;
    x0 << error[0], error[1], error[2], error[3];
    tiny_set_x0(&tiny_solver, x0);
    tiny_solve(&tiny_solver);
""",
    "tiny_solver.solution->u(i % 2, i / 2)",
).replace("void run", 'extern "C" void run')


def programs(tilt: str, effort: str, gradient: str) -> tuple[Program, ...]:
    """Return the program of every set-up.

    The arguments are C literals: tilt limit, twice the effort weight, and the 4 x 4 matrix from the state to
    the gradient of the quadratic cost at zero moves.
    """

    def fill(glue: str) -> str:
        return glue.replace("TILT", tilt).replace("EFFORT", effort).replace("GRADIENT", gradient)

    daqp = Program(
        "daqp",
        "DAQP, four moves, condensed by hand",
        "quadratic",
        "float32",
        sources=("csrc/src/*.c",),
        includes=("csrc/include", "."),
        glue=fill(_DAQP),
        defines=("DAQP_SINGLE_PRECISION",),
    )
    osqp = Program(
        "osqp-condensed",
        "OSQP, four moves, condensed by hand",
        "quadratic",
        "float32",
        sources=("src/*.c", "workspace.c"),
        includes=("inc/public", "inc/private", "."),
        glue=fill(_OSQP_CONDENSED),
    )
    casadi = Program(
        "casadi-qrqp",
        "CasADi, qrqp",
        "quadratic",
        "float32",
        sources=("mpc.c",),
        includes=(".",),
        glue=_CASADI,
    )
    solver = "c/solver_code"
    cvxpygen = ("c/src/cpg_workspace.c", "c/src/cpg_solve.c")
    cvxpygen_osqp = Program(
        "cvxpygen-osqp",
        "CVXPYgen, OSQP",
        "1-norm",
        "float64",
        sources=(*cvxpygen, f"{solver}/src/*.c", f"{solver}/workspace.c"),
        includes=("c/include", solver, f"{solver}/inc/public", f"{solver}/inc/private"),
        glue=_CVXPYGEN,
    )
    return (
        daqp,
        replace(
            daqp,
            name="daqp-slacks",
            title="DAQP, moves and slacks",
            cost="1-norm",
            scalar="float64",
            glue=_DAQP_SLACKS,
            defines=(),
        ),
        osqp,
        replace(osqp, name="osqp-states", title="OSQP, states and moves", glue=fill(_OSQP_STATES)),
        casadi,
        replace(casadi, name="casadi-sqp", title="CasADi, sqpmethod on qrqp"),
        cvxpygen_osqp,
        replace(cvxpygen_osqp, name="cvxpygen-squares", title="CVXPYgen, OSQP, squares", cost="quadratic"),
        Program(
            "cvxpygen-ecos",
            "CVXPYgen, ECOS",
            "1-norm",
            "float64",
            sources=(
                *cvxpygen,
                f"{solver}/external/amd/src/*.c",
                f"{solver}/external/ldl/src/ldl.c",
                f"{solver}/src/[cekpstw]*.c",
            ),
            includes=(
                "c/include",
                f"{solver}/include",
                f"{solver}/external/SuiteSparse_config",
                f"{solver}/external/amd/include",
                f"{solver}/external/ldl/include",
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
    """Return `programs`, and DAQP and CasADi also in double, their default: in float CasADi often fails."""
    found = []
    for program in programs(tilt, effort, gradient):
        found.append(program)
        if program.name in ("daqp", "casadi-qrqp", "casadi-sqp"):
            name, title = f"{program.name}-float64", f"{program.title}, double"
            found.append(replace(program, name=name, title=title, scalar="float64", defines=()))
    return tuple(found)
