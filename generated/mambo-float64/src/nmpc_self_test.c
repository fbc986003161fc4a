/* SPDX-License-Identifier: MIT-0
 *
 * Self-test: 24 consecutive control steps with the results of the reference, and 100000 control steps with
 * pseudo-random inputs, of whose results there is a digest.
 * MISRA C:2012: departs from rule 8.9, for the reason in deviations.txt.
 */
#include "nmpc_self_test.h"

#include "nmpc_math.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x8D00AE40UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

#define NMPC_SELF_TEST_STEPS 24

typedef struct {
    nmpc_state_t state;
    nmpc_target_t target;
    nmpc_real_t thrust_acceleration_m_s2;
    nmpc_status_t status;
    nmpc_command_t command;
    nmpc_sum_t cost;
    nmpc_sum_t gradient[NMPC_ANGLES];
} nmpc_self_test_step_t;

static const nmpc_self_test_step_t self_test_steps[NMPC_SELF_TEST_STEPS] = {
    { { { 2.2250738585072e-310, 0.0 }, { 0.0, 0.0 },
        0.0, 0.0, 0.0 },
      { { 0.0, 0.0 }, { 0.0, 0.0 } },
      9.81, NMPC_OK,
      { 0.0, 0.0064 }, 5.0064161816412075e-306,
      { 0.0, -2001.4209688117357 } },
    { { { -1.474, 0.7689999999999999 }, { 0.03400000000000003, 0.8879999999999999 },
        -0.306, 0.126, -2.823 },
      { { -1.528, 0.944 }, { -0.292, 0.944 } },
      11.476, NMPC_OK,
      { -0.07441600000000001, -0.06801600000000001 }, 5060.976205405741,
      { 163.87147106043156, 2355.1801956807703 } },
    { { { -0.15799999999999997, -1.315 }, { 0.28400000000000003, 0.13799999999999998 },
        -0.015, -0.282, 3.007 },
      { { 0.138, -1.39 }, { 0.541, -0.223 } },
      9.141, NMPC_OK,
      { -2.0816681711721685e-17, 0.006399999999999996 }, 14258.516061530156,
      { -1165.5277551012823, -2097.3153945459744 } },
    { { { 1.757, 0.0010000000000000009 }, { -0.46699999999999997, 0.387 },
        0.277, 0.009, -5.163 },
      { { 1.803, 0.276 }, { -0.626, 0.61 } },
      10.807, NMPC_OK,
      { -0.07441600000000002, -0.06801600000000001 }, 8544.380334448955,
      { 745.3267948640507, 2943.98086263424 } },
    { { { -0.32700000000000007, 1.915 }, { -0.218, -0.36400000000000005 },
        -0.132, 0.301, 0.666 },
      { { -0.531, 1.941 }, { 0.207, -0.557 } },
      8.473, NMPC_OK,
      { -3.469446951953614e-17, -0.142432 }, 2063.3276851777655,
      { -333.4550318174541, 824.323410069065 } },
    { { { 0.988, -0.169 }, { -0.969, -0.11399999999999999 },
        0.16, -0.108, 6.496 },
      { { 1.135, -0.393 }, { -0.961, 0.276 } },
      10.138, NMPC_OK,
      { -0.07441600000000004, -0.17883200000000002 }, 6224.456247362813,
      { 1506.8237951083784, -136.1884332504888 } },
    { { { 2000.0, 1.146 }, { 0.27999999999999997, -0.866 },
        -0.249, 0.184, -1.674 },
      { { -1.2, 1.272 }, { -0.128, -0.892 } },
      11.804, NMPC_BAD_STATE,
      { -0.07441600000000004, -0.17883200000000002 }, 6224.456247362813,
      { 1506.8237951083784, -136.1884332504888 } },
    { { { 0.21900000000000003, -0.9380000000000001 }, { 0.53, 0.384 },
        0.043, -0.225, 4.155 },
      { { 0.466, -1.062 }, { 0.705, -0.059 } },
      9.469000000000001, NMPC_OK,
      { -4.85722573273506e-17, -0.25324800000000003 }, 10830.62760934489,
      { -1941.3139946972665, 616.5488507083527 } },
    { { { -1.8650000000000002, 0.378 }, { -0.22100000000000003, 0.633 },
        0.334, 0.067, -4.015 },
      { { -1.868, 0.604 }, { -0.462, 0.774 } },
      11.135, NMPC_OK,
      { -0.07441600000000005, -0.32766400000000007 }, 8772.736962698296,
      { 2240.4232412090396, 406.0149464965402 } },
    { { { 0.04999999999999999, -1.707 }, { 0.02899999999999997, -0.11699999999999999 },
        -0.075, -0.342, 1.815 },
      { { -0.203, -1.731 }, { 0.371, -0.393 } },
      8.801, NMPC_OK,
      { -6.245004513516506e-17, -0.25324800000000003 }, 8794.202141200221,
      { -971.3616855567026, -1505.7754352153845 } },
    { { { 1.366, 0.20900000000000002 }, { -0.7220000000000001, 0.132 },
        0.217, -0.05, -6.355 },
      { { 1.463, -0.065 }, { -0.796, 0.44 } },
      10.466000000000001, NMPC_OK,
      { -0.07441600000000007, -0.17883200000000002 }, 7611.463629094801,
      { 1629.0546951350168, -1249.0548602691265 } },
    { { { -0.719, 1.524 }, { 0.526, -0.62 },
        -0.192, 0.241, -0.526 },
      { { -0.872, 1.601 }, { 0.036, -0.728 } },
      8.132000000000001, NMPC_OK,
      { -7.632783294297951e-17, -0.10441600000000001 }, 7439.882271706239,
      { -438.9982871083801, -2266.7943578179775 } },
    { { { 0.5960000000000001, -0.5609999999999999 }, { 0.776, -0.37 },
        0.1, -0.167, 5.304 },
      { { 0.794, -0.734 }, { 0.869, 0.105 } },
      9.798, NMPC_OK,
      { 0.07441599999999993, -0.178832 }, 4770.483906928942,
      { -1774.2942012671688, 19.57802512736981 } },
    { { { -1.488, 0.7550000000000001 }, { 0.025000000000000022, 0.879 },
        -0.309, 0.124, -2.866 },
      { { -1.54, 0.932 }, { -0.298, -200.0 } },
      11.463000000000001, NMPC_BAD_TARGET,
      { 0.07441599999999993, -0.178832 }, 4770.483906928942,
      { -1774.2942012671688, 19.57802512736981 } },
    { { { -0.173, -1.33 }, { 0.275, 0.12899999999999998 },
        -0.017, -0.284, 2.963 },
      { { 0.125, -1.403 }, { 0.535, -0.229 } },
      9.129000000000001, NMPC_OK,
      { 0.1488319999999999, -0.10441599999999998 }, 13968.333126301113,
      { -1095.6341225182396, -2163.721633317316 } },
    { { { 1.7429999999999999, -0.014000000000000012 }, { -0.476, 0.378 },
        0.274, 0.007, -5.207 },
      { { 1.791, 0.263 }, { -0.632, 0.604 } },
      10.794, NMPC_OK,
      { 0.07441599999999989, -0.17883199999999996 }, 8672.294776842495,
      { 649.3280388412815, 2981.6009882190992 } },
    { { { -0.341, 1.9020000000000001 }, { -0.22799999999999998, -0.37299999999999994 },
        -0.134, 0.299, 0.623 },
      { { -0.543, 1.929 }, { 0.2, -0.563 } },
      8.46, NMPC_OK,
      { 0.04529599999999989, -0.253248 }, 2052.5497628077114,
      { 55.7171428040185, 401.88381759169914 } },
    { { { 0.9740000000000001, -0.18400000000000002 }, { -0.978, -0.124 },
        0.157, -0.11, 6.453 },
      { { 1.122, -0.406 }, { -0.967, 0.269 } },
      10.126000000000001, NMPC_OK,
      { -0.02912000000000011, -0.28676799999999997 }, 6054.022861605841,
      { 1614.4780377284253, 753.473891718189 } },
    { { { -1.111, 1.1320000000000001 }, { 0.271, -0.875 },
        -0.251, 0.181, -1.718 },
      { { -1.212, 1.26 }, { -0.134, -0.898 } },
      11.791, NMPC_OK,
      { -0.10353600000000011, -0.21235199999999993 }, 4473.443068425666,
      { 1991.1479079125704, -2026.7324095486865 } },
    { { { 0.20500000000000002, -0.9520000000000001 }, { 0.5209999999999999, 0.375 },
        0.04, -0.227, 4.112 },
      { { 0.454, -1.074 }, { 0.699, -0.065 } },
      9.457, NMPC_OK,
      { -0.02912000000000012, -0.2867679999999999 }, 11525.725507399773,
      { -1956.4013303919694, 499.9387715539411 } },
    { { { -1.8800000000000001, 0.363 }, { -0.23000000000000004, 0.624 },
        0.332, 0.064, -4.058 },
      { { -1.881, 0.591 }, { -0.468, 0.768 } },
      0.0, NMPC_BAD_THRUST,
      { -0.02912000000000012, -0.2867679999999999 }, 11525.725507399773,
      { -1956.4013303919694, 499.9387715539411 } },
    { { { 0.036000000000000004, -1.721 }, { 0.019000000000000017, -0.127 },
        -0.077, -0.344, 1.771 },
      { { -0.215, -1.743 }, { 0.365, -0.399 } },
      8.788, NMPC_OK,
      { 0.04529599999999988, -0.21235199999999987 }, 8034.573788288709,
      { -1541.80746233566, -1400.5476877558267 } },
    { { { 1.351, 0.195 }, { -0.7320000000000001, 0.122 },
        0.215, -0.053, -6.399 },
      { { 1.45, -0.077 }, { -0.803, 0.433 } },
      10.454, NMPC_OK,
      { -0.029120000000000125, -0.13793599999999986 }, 7017.592169645291,
      { 1584.2657946198017, -136.83732734090052 } },
    { { { -0.733, 1.51 }, { 0.517, -0.629 },
        -0.194, 0.239, -0.569 },
      { { -0.884, 1.588 }, { 0.03, -0.734 } },
      8.120000000000001, NMPC_OK,
      { 0.04529599999999988, -0.06351999999999985 }, 6233.212023841299,
      { -366.93970898374386, -2288.186875066962 } }
};

int nmpc_self_test(nmpc_t *scratch)
{
    int first_difference = 0;
    int i;

    nmpc_init(scratch);
    for (i = 0; i < NMPC_SELF_TEST_STEPS; i++) {
        const nmpc_self_test_step_t *expected = &self_test_steps[i];
        nmpc_command_t command;
        const nmpc_status_t status = nmpc_step(scratch, &expected->state, &expected->target,
                                               expected->thrust_acceleration_m_s2, &command);

        if ((first_difference == 0)
            && !((status == expected->status) && (command.roll_rad == expected->command.roll_rad)
                 && (command.pitch_rad == expected->command.pitch_rad)
                 && (nmpc_last_cost(scratch) == expected->cost)
                 && (scratch->gradient[0] == expected->gradient[0])
                 && (scratch->gradient[1] == expected->gradient[1]))) {
            first_difference = i + 1;
        }
    }
    nmpc_init(scratch);
    return first_difference;
}

/* Scale of each pseudo-random input: its value per unit of a draw, a signed integer of 24 bits. */
#define NMPC_SELF_TEST_TARGET_M 2.384185791015625e-07
#define NMPC_SELF_TEST_TARGET_M_S 1.1920928955078125e-07
#define NMPC_SELF_TEST_ATTITUDE_RAD 5.960464477539063e-08
#define NMPC_SELF_TEST_YAW_RAD 1.1920928955078125e-05
#define NMPC_SELF_TEST_THRUST_M_S2 3.5762786865234375e-07
#define NMPC_SELF_TEST_HOVER_M_S2 9.81

/* Consecutive control steps with the same input, so that moves reach their limits and searches converge. */
#define NMPC_SELF_TEST_HELD 4

/* Scales of the errors of position and velocity, from large to small; each input draws one of the four. */
static const nmpc_real_t self_test_error_m[4] = { 2.384185791015625e-06, 5.960464477539063e-08, 5.960464477539063e-09, 5.960464477539063e-10 };
static const nmpc_real_t self_test_error_m_s[4] = { 1.1920928955078125e-06, 2.9802322387695312e-08, 2.9802322387695314e-09, 2.9802322387695313e-10 };

/* sizeof(nmpc_real_t) */
#define NMPC_SELF_TEST_REAL_BYTES 8

/* The lower 32 bits of `value`; unsigned long may be longer. */
static unsigned long lower_word(unsigned long value)
{
    return value & 0xFFFFFFFFUL;
}

/* Combine a digest with a word of 32 bits. For a given digest different words give different results. */
static unsigned long fold(unsigned long digest, unsigned long word)
{
    const unsigned long mixed = lower_word((digest ^ word) * 2654435761UL);

    return mixed ^ (mixed >> 15);
}

static unsigned long fold_real(unsigned long digest, nmpc_real_t value)
{
    const nmpc_bits_t bits = nmpc_bits(value);

    return fold(fold(digest, (unsigned long)(bits >> 32)), lower_word((unsigned long)bits));
}

static unsigned long fold_results(unsigned long digest, const nmpc_t *self, nmpc_status_t status,
                                  const nmpc_command_t *command)
{
    unsigned long folded = digest;
    int k;

    folded = fold(folded, (unsigned long)status);
    folded = fold(folded, (unsigned long)nmpc_last_iterations(self));
    folded = fold(folded, (unsigned long)nmpc_has_converged(self));
    folded = fold_real(folded, command->roll_rad);
    folded = fold_real(folded, command->pitch_rad);
    folded = fold_real(folded, nmpc_last_cost(self));
    for (k = 0; k < NMPC_MOVES; k++) {
        folded = fold_real(folded, self->gradient[k]);
    }
    for (k = 0; k < NMPC_MOVES; k++) {
        folded = fold_real(folded, self->plan_rad[k]);
    }
    return folded;
}

/* Pseudo-random 32 bits, never 0: xorshift (Marsaglia, Journal of Statistical Software 8(14), 2003). */
static unsigned long next_number(unsigned long *stream)
{
    unsigned long number = *stream;

    number ^= lower_word(number << 13);
    number ^= number >> 17;
    number ^= lower_word(number << 5);
    *stream = number;
    return number;
}

/* Draw a signed integer of 24 bits, which nmpc_real_t holds exactly, times `scale`: rounded once. */
static nmpc_real_t draw(unsigned long *stream, nmpc_real_t scale)
{
    const unsigned long bits = next_number(stream) >> 8;
    const long number = (long)bits - 8388608L;

    return (nmpc_real_t)number * scale;
}

/* NaN, with every bit set: outside of every range, so it is refused. */
static nmpc_real_t not_a_number(void)
{
    nmpc_real_t value;
    unsigned char *bytes = (unsigned char *)&value;
    int i;

    for (i = 0; i < NMPC_SELF_TEST_REAL_BYTES; i++) {
        bytes[i] = 0xFFU;
    }
    return value;
}

/* Draw the next input, out of range in 5 of 64 cases. Returns the thrust acceleration, in m/s^2. */
static nmpc_real_t next_input(unsigned long *stream, nmpc_state_t *state, nmpc_target_t *target)
{
    const unsigned long choice = next_number(stream);
    const unsigned long size = choice & 3UL;
    nmpc_real_t thrust_m_s2;
    int axis;

    for (axis = 0; axis < 2; axis++) {
        target->position_m[axis] = draw(stream, NMPC_SELF_TEST_TARGET_M);
    }
    for (axis = 0; axis < 2; axis++) {
        target->velocity_m_s[axis] = draw(stream, NMPC_SELF_TEST_TARGET_M_S);
    }
    for (axis = 0; axis < 2; axis++) {
        state->position_m[axis] = target->position_m[axis] + draw(stream, self_test_error_m[size]);
    }
    for (axis = 0; axis < 2; axis++) {
        state->velocity_m_s[axis] = target->velocity_m_s[axis] + draw(stream, self_test_error_m_s[size]);
    }
    state->roll_rad = draw(stream, NMPC_SELF_TEST_ATTITUDE_RAD);
    state->pitch_rad = draw(stream, NMPC_SELF_TEST_ATTITUDE_RAD);
    state->yaw_rad = draw(stream, NMPC_SELF_TEST_YAW_RAD);
    thrust_m_s2 = NMPC_SELF_TEST_HOVER_M_S2 + draw(stream, NMPC_SELF_TEST_THRUST_M_S2);
    thrust_m_s2 = nmpc_smaller(nmpc_larger(thrust_m_s2, NMPC_THRUST_ACCELERATION_MIN_M_S2),
                               NMPC_THRUST_ACCELERATION_MAX_M_S2);

    switch ((choice >> 8) & 63UL) {
    case 0UL:
        state->position_m[0] = not_a_number();
        break;
    case 1UL:
        state->pitch_rad = (nmpc_real_t)2 * NMPC_ATTITUDE_RANGE_RAD;
        break;
    case 2UL:
        state->yaw_rad = (nmpc_real_t)2 * NMPC_YAW_RANGE_RAD;
        break;
    case 3UL:
        target->velocity_m_s[1] = (nmpc_real_t)-2 * NMPC_VELOCITY_RANGE_M_S;
        break;
    case 4UL:
        thrust_m_s2 = (nmpc_real_t)0;
        break;
    default: /* every input in range */
        break;
    }
    return thrust_m_s2;
}

unsigned long nmpc_self_test_episode(nmpc_t *scratch, int episode, unsigned long digest)
{
    unsigned long stream = fold(0UL, (unsigned long)episode + 1UL);
    unsigned long results = 0UL;
    int step;
    int repeat;

    nmpc_init(scratch);
    for (step = 0; step < NMPC_SELF_TEST_TICKS; step += NMPC_SELF_TEST_HELD) {
        nmpc_state_t state;
        nmpc_target_t target;
        const nmpc_real_t thrust_m_s2 = next_input(&stream, &state, &target);

        for (repeat = 0; repeat < NMPC_SELF_TEST_HELD; repeat++) {
            nmpc_command_t command;
            const nmpc_status_t status = nmpc_step(scratch, &state, &target, thrust_m_s2, &command);

            results = fold_results(results, scratch, status, &command);
        }
    }
    nmpc_init(scratch);
    return fold(digest, results);
}
