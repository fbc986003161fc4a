/* SPDX-License-Identifier: MIT-0
 *
 * Self-test: 24 consecutive control steps with the results of the reference, and 100000 control steps with
 * pseudo-random inputs, of whose results there is a digest.
 * MISRA C:2012: departs from rules 2.3, 8.9 and 19.2, for the reasons in deviations.txt.
 */
#include "nmpc_self_test.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x4C6F9794UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

#if defined(__SIZEOF_INT__) && (__SIZEOF_INT__ < 4)
typedef unsigned long nmpc_word_t;
#else
typedef unsigned int nmpc_word_t;
#endif
typedef char nmpc_assert_word_has_the_size_of_a_scalar[(sizeof(nmpc_word_t) == sizeof(nmpc_real_t)) ? 1 : -1];

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
    { { { 1.1755e-40f, 0.0f }, { 0.0f, 0.0f },
        0.0f, 0.0f, 0.0f },
      { { 0.0f, 0.0f }, { 0.0f, 0.0f } },
      9.81f, NMPC_OK,
      { 0.0f, 0.0064000003f },
      2.6448598e-36f, { 0.0f, -5407.763f } },
    { { { -1.474f, 0.769f }, { 0.034f, 0.888f },
        -0.306f, 0.126f, -2.823f },
      { { -1.528f, 0.944f }, { -0.292f, 0.944f } },
      11.476f, NMPC_OK,
      { -0.074416004f, -0.06801601f },
      6077.652f, { 7988.336f, 4025.2544f } },
    { { { -0.158f, -1.315f }, { 0.284f, 0.138f },
        -0.015f, -0.282f, 3.007f },
      { { 0.138f, -1.39f }, { 0.541f, -0.223f } },
      9.141f, NMPC_OK,
      { 0.0f, 0.0063999966f },
      14358.616f, { -4316.2407f, -5668.5674f } },
    { { { 1.757f, 0.001f }, { -0.467f, 0.387f },
        0.277f, 0.009f, -5.163f },
      { { 1.803f, 0.276f }, { -0.626f, 0.61f } },
      10.807f, NMPC_OK,
      { 0.0364f, -0.06801601f },
      6900.664f, { 2769.1787f, 7956.225f } },
    { { { -0.327f, 1.915f }, { -0.218f, -0.364f },
        -0.132f, 0.301f, 0.666f },
      { { -0.531f, 1.941f }, { 0.207f, -0.557f } },
      8.473f, NMPC_OK,
      { -0.038016003f, 0.0063999966f },
      2719.9827f, { 3655.8645f, -2753.6294f } },
    { { { 0.988f, -0.169f }, { -0.969f, -0.114f },
        0.16f, -0.108f, 6.496f },
      { { 1.135f, -0.393f }, { -0.961f, 0.276f } },
      10.138f, NMPC_OK,
      { -0.067136005f, -0.06801601f },
      4272.9307f, { 2707.871f, 5130.9917f } },
    { { { 2000.0f, 1.146f }, { 0.28f, -0.866f },
        -0.249f, 0.184f, -1.674f },
      { { -1.2f, 1.272f }, { -0.128f, -0.892f } },
      11.804f, NMPC_BAD_STATE,
      { -0.067136005f, -0.06801601f },
      4272.9307f, { 2707.871f, 5130.9917f } },
    { { { 0.219f, -0.938f }, { 0.53f, 0.384f },
        0.043f, -0.225f, 4.155f },
      { { 0.466f, -1.062f }, { 0.705f, -0.059f } },
      9.469f, NMPC_OK,
      { 0.0072799996f, -0.142432f },
      13291.772f, { -7189.8364f, 1667.5947f } },
    { { { -1.865f, 0.378f }, { -0.221f, 0.633f },
        0.334f, 0.067f, -4.015f },
      { { -1.868f, 0.604f }, { -0.462f, 0.774f } },
      11.135f, NMPC_OK,
      { -0.029120002f, -0.21684802f },
      3717.8215f, { -214.63795f, 2419.1838f } },
    { { { 0.05f, -1.707f }, { 0.029f, -0.117f },
        -0.075f, -0.342f, 1.815f },
      { { -0.203f, -1.731f }, { 0.371f, -0.393f } },
      8.801f, NMPC_OK,
      { 0.045296002f, -0.142432f },
      8305.008f, { -2489.1562f, -4378.1597f } },
    { { { 1.366f, 0.209f }, { -0.722f, 0.132f },
        0.217f, -0.05f, -6.355f },
      { { 1.463f, -0.065f }, { -0.796f, 0.44f } },
      10.466f, NMPC_OK,
      { -0.029120002f, -0.068016f },
      4856.1816f, { 5960.497f, -2462.2854f } },
    { { { -0.719f, 1.524f }, { 0.526f, -0.62f },
        -0.192f, 0.241f, -0.526f },
      { { -0.872f, 1.601f }, { 0.036f, -0.728f } },
      8.132f, NMPC_OK,
      { 0.0072799986f, 0.006400004f },
      8856.108f, { 2329.2341f, -3830.781f } },
    { { { 0.596f, -0.561f }, { 0.776f, -0.37f },
        0.1f, -0.167f, 5.304f },
      { { 0.794f, -0.734f }, { 0.869f, 0.105f } },
      9.798f, NMPC_OK,
      { 0.081696f, -0.068016f },
      5524.8423f, { -5325.6064f, 1754.9218f } },
    { { { -1.488f, 0.755f }, { 0.025f, 0.879f },
        -0.309f, 0.124f, -2.866f },
      { { -1.54f, 0.932f }, { -0.298f, -200.0f } },
      11.463f, NMPC_BAD_TARGET,
      { 0.081696f, -0.068016f },
      5524.8423f, { -5325.6064f, 1754.9218f } },
    { { { -0.173f, -1.33f }, { 0.275f, 0.129f },
        -0.017f, -0.284f, 2.963f },
      { { 0.125f, -1.403f }, { 0.535f, -0.229f } },
      9.129f, NMPC_OK,
      { 0.15611202f, 0.006400004f },
      11908.508f, { -4057.3477f, -5845.2925f } },
    { { { 1.743f, -0.014f }, { -0.476f, 0.378f },
        0.274f, 0.007f, -5.207f },
      { { 1.791f, 0.263f }, { -0.632f, 0.604f } },
      10.794f, NMPC_OK,
      { 0.08169601f, -0.068016f },
      7402.9873f, { 2411.5913f, 8060.574f } },
    { { { -0.341f, 1.902f }, { -0.228f, -0.373f },
        -0.134f, 0.299f, 0.623f },
      { { -0.543f, 1.929f }, { 0.2f, -0.563f } },
      8.46f, NMPC_OK,
      { 0.007280007f, 0.006400004f },
      3485.7964f, { 4472.59f, -1605.1719f } },
    { { { 0.974f, -0.184f }, { -0.978f, -0.124f },
        0.157f, -0.11f, 6.453f },
      { { 1.122f, -0.406f }, { -0.967f, 0.269f } },
      10.126f, NMPC_OK,
      { -0.067136f, -0.068016f },
      4281.3135f, { 2481.8164f, 5236.53f } },
    { { { -1.111f, 1.132f }, { 0.271f, -0.875f },
        -0.251f, 0.181f, -1.718f },
      { { -1.212f, 1.26f }, { -0.134f, -0.898f } },
      11.791f, NMPC_OK,
      { -0.141552f, 0.006400004f },
      5329.868f, { 7381.836f, -5475.1533f } },
    { { { 0.205f, -0.952f }, { 0.521f, 0.375f },
        0.04f, -0.227f, 4.112f },
      { { 0.454f, -1.074f }, { 0.699f, -0.065f } },
      9.457f, NMPC_OK,
      { -0.067136f, -0.068016f },
      15905.782f, { -7245.7217f, 1355.2192f } },
    { { { -1.88f, 0.363f }, { -0.23f, 0.624f },
        0.332f, 0.064f, -4.058f },
      { { -1.881f, 0.591f }, { -0.468f, 0.768f } },
      0.0f, NMPC_BAD_THRUST,
      { -0.067136f, -0.068016f },
      15905.782f, { -7245.7217f, 1355.2192f } },
    { { { 0.036f, -1.721f }, { 0.019f, -0.127f },
        -0.077f, -0.344f, 1.771f },
      { { -0.215f, -1.743f }, { 0.365f, -0.399f } },
      8.788f, NMPC_OK,
      { 0.007280007f, 0.006400004f },
      6006.3105f, { -5710.0215f, -3783.2256f } },
    { { { 1.351f, 0.195f }, { -0.732f, 0.122f },
        0.215f, -0.053f, -6.399f },
      { { 1.45f, -0.077f }, { -0.803f, 0.433f } },
      10.454f, NMPC_OK,
      { -0.067136f, -0.068016f },
      3902.62f, { 1615.0842f, 70.97523f } },
    { { { -0.733f, 1.51f }, { 0.517f, -0.629f },
        -0.194f, 0.239f, -0.569f },
      { { -0.884f, 1.588f }, { 0.03f, -0.734f } },
      8.12f, NMPC_OK,
      { 0.007280007f, 0.006400004f },
      8873.338f, { -1358.1842f, -6181.593f } }
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
#define NMPC_SELF_TEST_TARGET_M 2.3841858e-07f
#define NMPC_SELF_TEST_TARGET_M_S 1.1920929e-07f
#define NMPC_SELF_TEST_ATTITUDE_RAD 5.9604645e-08f
#define NMPC_SELF_TEST_YAW_RAD 1.1920929e-05f
#define NMPC_SELF_TEST_THRUST_M_S2 3.5762787e-07f
#define NMPC_SELF_TEST_HOVER_M_S2 9.81f

/* Consecutive control steps with the same input, so that moves reach their limits and searches converge. */
#define NMPC_SELF_TEST_HELD 4

/* Scales of the errors of position and velocity, from large to small; each input draws one of the four. */
static const nmpc_real_t self_test_error_m[4] = { 2.3841858e-06f, 5.9604645e-08f, 5.9604646e-09f, 5.9604643e-10f };
static const nmpc_real_t self_test_error_m_s[4] = { 1.1920929e-06f, 2.9802322e-08f, 2.9802323e-09f, 2.9802322e-10f };

/* sizeof(nmpc_real_t) */
#define NMPC_SELF_TEST_REAL_BYTES 4

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
    union {
        nmpc_real_t real;
        nmpc_word_t bits;
    } view;

    view.real = value;
    return fold(digest, (unsigned long)view.bits);
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
    if (thrust_m_s2 < NMPC_THRUST_ACCELERATION_MIN_M_S2) {
        thrust_m_s2 = NMPC_THRUST_ACCELERATION_MIN_M_S2;
    } else if (thrust_m_s2 > NMPC_THRUST_ACCELERATION_MAX_M_S2) {
        thrust_m_s2 = NMPC_THRUST_ACCELERATION_MAX_M_S2;
    } else {
        /* The thrust is within its range. */
    }

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
