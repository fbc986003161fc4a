/* SPDX-License-Identifier: MIT-0
 *
 * Self-test: 24 consecutive control steps with the results of the reference, and 100000 control steps with
 * pseudo-random inputs, of whose results there is a digest.
 * MISRA C:2012: departs from rules 2.3, 8.9, 11.5 and 19.2, for the reasons in deviations.txt.
 */
#include "nmpc_self_test.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x0D5751AAUL)
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
    unsigned long digest; /* of all results of the step */
} nmpc_self_test_step_t;

static const nmpc_self_test_step_t self_test_steps[NMPC_SELF_TEST_STEPS] = {
    { { { 1.1755e-40f, 0.0f }, { 0.0f, 0.0f },
        0.0f, 0.0f, 0.0f },
      { { 0.0f, 0.0f }, { 0.0f, 0.0f } },
      9.81f, 0x7DD23B15UL }, /* NMPC_OK */
    { { { -1.474f, 0.769f }, { 0.307f, 0.005f },
        -0.306f, 0.126f, -2.823f },
      { { -1.528f, 0.944f }, { -0.019f, 0.061f } },
      11.476f, 0x185DB85FUL }, /* NMPC_OK */
    { { { -0.158f, -1.315f }, { -0.241f, 0.408f },
        -0.015f, -0.282f, 3.007f },
      { { 0.138f, -1.39f }, { 0.016f, 0.047f } },
      9.141f, 0x523D6729UL }, /* NMPC_OK */
    { { { 1.757f, 0.001f }, { 0.135f, -0.137f },
        0.277f, 0.009f, -5.163f },
      { { 1.803f, 0.276f }, { -0.024f, 0.086f } },
      10.807f, 0x707958ACUL }, /* NMPC_OK */
    { { { -0.327f, 1.915f }, { -0.436f, 0.243f },
        -0.132f, 0.301f, 0.666f },
      { { -0.531f, 1.941f }, { -0.011f, 0.05f } },
      8.473f, 0xF9CC1473UL }, /* NMPC_OK */
    { { { 0.988f, -0.169f }, { -0.081f, -0.322f },
        0.16f, -0.108f, 6.496f },
      { { 1.135f, -0.393f }, { -0.073f, 0.068f } },
      10.138f, 0x867ABC73UL }, /* NMPC_OK */
    { { { 2000.0f, 1.146f }, { 0.327f, 0.037f },
        -0.249f, 0.184f, -1.674f },
      { { -1.2f, 1.272f }, { -0.081f, 0.011f } },
      11.804f, 0x2D77A70BUL }, /* NMPC_BAD_STATE */
    { { { 0.219f, -0.938f }, { -0.211f, 0.45f },
        0.043f, -0.225f, 4.155f },
      { { 0.466f, -1.062f }, { -0.036f, 0.007f } },
      9.469f, 0x1BCE337EUL }, /* NMPC_OK */
    { { { -1.865f, 0.378f }, { 0.175f, -0.084f },
        0.334f, 0.067f, -4.015f },
      { { -1.868f, 0.604f }, { -0.066f, 0.057f } },
      11.135f, 0x38C934B9UL }, /* NMPC_OK */
    { { { 0.05f, -1.707f }, { -0.384f, 0.308f },
        -0.075f, -0.342f, 1.815f },
      { { -0.203f, -1.731f }, { -0.042f, 0.032f } },
      8.801f, 0x13F775E2UL }, /* NMPC_OK */
    { { { 1.366f, 0.209f }, { -0.019f, -0.248f },
        0.217f, -0.05f, -6.355f },
      { { 1.463f, -0.065f }, { -0.093f, 0.06f } },
      10.466f, 0xCEAE043AUL }, /* NMPC_OK */
    { { { -0.719f, 1.524f }, { 0.399f, 0.121f },
        -0.192f, 0.241f, -0.526f },
      { { -0.872f, 1.601f }, { -0.091f, 0.013f } },
      8.132f, 0x7F8BC90CUL }, /* NMPC_OK */
    { { { 0.596f, -0.561f }, { -0.128f, -0.455f },
        0.1f, -0.167f, 5.304f },
      { { 0.794f, -0.734f }, { -0.035f, 0.02f } },
      9.798f, 0x921948C2UL }, /* NMPC_OK */
    { { { -1.488f, 0.755f }, { 0.269f, 0.021f },
        -0.309f, 0.124f, -2.866f },
      { { -1.54f, 0.932f }, { -0.054f, -200.0f } },
      11.463f, 0x47BE3A0FUL }, /* NMPC_BAD_TARGET */
    { { { -0.173f, -1.33f }, { -0.28f, 0.423f },
        -0.017f, -0.284f, 2.963f },
      { { 0.125f, -1.403f }, { -0.02f, 0.065f } },
      9.129f, 0x8B1DA78FUL }, /* NMPC_OK */
    { { { 1.743f, -0.014f }, { 0.095f, -0.122f },
        0.274f, 0.007f, -5.207f },
      { { 1.791f, 0.263f }, { -0.061f, 0.104f } },
      10.794f, 0xB4243EE7UL }, /* NMPC_OK */
    { { { -0.341f, 1.902f }, { -0.476f, 0.258f },
        -0.134f, 0.299f, 0.623f },
      { { -0.543f, 1.929f }, { -0.048f, 0.068f } },
      8.46f, 0xDAFCB760UL }, /* NMPC_OK */
    { { { 0.974f, -0.184f }, { -0.121f, -0.308f },
        0.157f, -0.11f, 6.453f },
      { { 1.122f, -0.406f }, { -0.11f, 0.085f } },
      10.126f, 0x3FBBCD03UL }, /* NMPC_OK */
    { { { -1.111f, 1.132f }, { 0.286f, 0.05f },
        -0.251f, 0.181f, -1.718f },
      { { -1.212f, 1.26f }, { -0.119f, 0.027f } },
      11.791f, 0xC2C9295DUL }, /* NMPC_OK */
    { { { 0.205f, -0.952f }, { -0.252f, 0.463f },
        0.04f, -0.227f, 4.112f },
      { { 0.454f, -1.074f }, { -0.074f, 0.023f } },
      9.457f, 0x7DAE83E6UL }, /* NMPC_OK */
    { { { -1.88f, 0.363f }, { 0.134f, -0.072f },
        0.332f, 0.064f, -4.058f },
      { { -1.881f, 0.591f }, { -0.104f, 0.072f } },
      0.0f, 0xC7AA30CFUL }, /* NMPC_BAD_THRUST */
    { { { 0.036f, -1.721f }, { -0.427f, 0.318f },
        -0.077f, -0.344f, 1.771f },
      { { -0.215f, -1.743f }, { -0.081f, 0.046f } },
      8.788f, 0xEDE0486CUL }, /* NMPC_OK */
    { { { 1.351f, 0.195f }, { -0.062f, -0.237f },
        0.215f, -0.053f, -6.399f },
      { { 1.45f, -0.077f }, { -0.133f, 0.074f } },
      10.454f, 0x71187E7DUL }, /* NMPC_OK */
    { { { -0.733f, 1.51f }, { 0.356f, 0.132f },
        -0.194f, 0.239f, -0.569f },
      { { -0.884f, 1.588f }, { -0.131f, 0.027f } },
      8.12f, 0xFEFDA566UL } /* NMPC_OK */
};

/* The numbers of a controller, in the order of its members, all of which come before its single bytes. */
static const nmpc_real_t *stored_numbers(const nmpc_t *self)
{
    return (const nmpc_real_t *)(const void *)self;
}

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
    const nmpc_real_t *const stored = stored_numbers(self);
    unsigned long folded = digest;
    int k;

    folded = fold(folded, (unsigned long)status);
    folded = fold(folded, (unsigned long)self->missed);
    folded = fold(folded, (unsigned long)nmpc_is_saturated(self));
    for (k = 0; k < NMPC_STORED_NUMBERS; k++) {
        folded = fold_real(folded, stored[k]);
    }
    folded = fold_real(folded, command->roll_rad);
    folded = fold_real(folded, command->pitch_rad);
    return folded;
}

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

        if ((first_difference == 0) && (fold_results(0UL, scratch, status, &command) != expected->digest)) {
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
#define NMPC_SELF_TEST_CHANGE_M_S 7.674471e-09f

/* Consecutive control steps with the same input, but for the target's velocity, so that moves reach their limits and searches converge. */
#define NMPC_SELF_TEST_HELD 4

/* Scales of the errors of position and velocity, from large to small; each input draws one of the four. */
static const nmpc_real_t self_test_error_m[4] = { 2.3841858e-06f, 5.9604645e-08f, 5.9604646e-09f, 5.9604643e-10f };
static const nmpc_real_t self_test_error_m_s[4] = { 1.1920929e-06f, 2.9802322e-08f, 2.9802323e-09f, 2.9802322e-10f };

/* sizeof(nmpc_real_t) */
#define NMPC_SELF_TEST_REAL_BYTES 4

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

/* Draw the next input, out of range in 5 of 64 cases. Returns the thrust acceleration, in m/s^2. `change_m_s` is what
 * the target's velocity changes by in each of the steps with that input. */
static nmpc_real_t next_input(unsigned long *stream, nmpc_state_t *state, nmpc_target_t *target,
                              nmpc_real_t change_m_s[2])
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
    for (axis = 0; axis < 2; axis++) {
        change_m_s[axis] = draw(stream, NMPC_SELF_TEST_CHANGE_M_S);
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
        change_m_s[1] = (nmpc_real_t)0;
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
        nmpc_real_t change_m_s[2];
        const nmpc_real_t thrust_m_s2 = next_input(&stream, &state, &target, change_m_s);

        for (repeat = 0; repeat < NMPC_SELF_TEST_HELD; repeat++) {
            nmpc_command_t command;
            const nmpc_status_t status = nmpc_step(scratch, &state, &target, thrust_m_s2, &command);

            results = fold_results(results, scratch, status, &command);
            target.velocity_m_s[0] = target.velocity_m_s[0] + change_m_s[0];
            target.velocity_m_s[1] = target.velocity_m_s[1] + change_m_s[1];
        }
    }
    nmpc_init(scratch);
    return fold(digest, results);
}
