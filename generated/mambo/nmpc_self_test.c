/* SPDX-License-Identifier: MIT-0
 *
 * Self-test: control steps with pseudo-random inputs, and calls of the other functions of nmpc.h between them.
 * 41 steps have a digest each; 100000 steps have one of all their results.
 * MISRA C:2012: departs from rules 2.3, 8.9, 11.5 and 19.2, for the reasons in deviations.txt.
 */
#include <stddef.h>

#include "nmpc_self_test.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x65406E0BUL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

#if defined(__SIZEOF_INT__) && (__SIZEOF_INT__ < 4)
typedef unsigned long nmpc_word_t;
#else
typedef unsigned int nmpc_word_t;
#endif
typedef char nmpc_assert_word_has_the_size_of_a_scalar[(sizeof(nmpc_word_t) == sizeof(nmpc_real_t)) ? 1 : -1];

/* A function in one copy: it has many callers, and no time to save. */
#if defined(__GNUC__)
#define NMPC_SELF_TEST_SHARED static __attribute__((noinline))
#else
#define NMPC_SELF_TEST_SHARED static
#endif

/* Digests of all results up to and including each step of nmpc_self_test(), computed by the reference. */
#define NMPC_SELF_TEST_STEPS 41
static const unsigned long self_test_digests[NMPC_SELF_TEST_STEPS] = {
0xD0623A37UL, 0xB109B135UL, 0xEA39AEAFUL, 0x3A08DCA2UL, 0x913F75B3UL, 0xF9A00C0EUL, 0x240E2CF8UL, 0x7B428E47UL,
0xCD2670E4UL, 0x8A2928B9UL, 0xA0C26584UL, 0x0C038CC6UL, 0x869AF3F9UL, 0xB12CA0CCUL, 0x813DC207UL, 0x56A86F89UL,
0x89129758UL, 0xB1C46BF3UL, 0xB32BA115UL, 0xEB23CE51UL, 0x639952BEUL, 0xA5C6CD88UL, 0xA383FED6UL, 0x89C1FC22UL,
0x9BEFC519UL, 0xFE041E31UL, 0xBAC62E07UL, 0xB45F2152UL, 0x8A273419UL, 0xAD372E07UL, 0x7319BF23UL, 0x2F343F01UL,
0x37EE8912UL, 0xA86667C4UL, 0x25A735CAUL, 0x23E4B16DUL, 0x371D10B1UL, 0xB2A6CFE2UL, 0x6B971177UL, 0x71D507F9UL,
0xD2EDCF91UL
};

/* The episode of which nmpc_self_test() runs the first steps; it has many kinds of results. */
#define NMPC_SELF_TEST_START 420

/* Consecutive control steps with the same input, but for the target's velocity, so that moves reach their limits and
 * searches converge. */
#define NMPC_SELF_TEST_HELD 4U

/* The numbers of a record, in the order of its members, all of which come before its integers. */
static nmpc_real_t *numbers_of(void *record)
{
    return (nmpc_real_t *)record;
}

/* The same of a controller. */
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

NMPC_SELF_TEST_SHARED unsigned long fold_real(unsigned long digest, nmpc_real_t value)
{
    union {
        nmpc_real_t real;
        nmpc_word_t bits;
    } view;

    view.real = value;
    return fold(digest, (unsigned long)view.bits);
}

/* The most numbers that are folded at once. */
#define NMPC_SELF_TEST_MOST_FOLDED NMPC_STORED_NUMBERS

static unsigned long fold_reals(unsigned long digest, const nmpc_real_t values[], int count)
{
    unsigned long folded = digest;
    int k;

    for (k = 0; (k < count) && (k < NMPC_SELF_TEST_MOST_FOLDED); k++) {
        folded = fold_real(folded, values[k]);
    }
    return folded;
}

NMPC_SELF_TEST_SHARED unsigned long fold_command(unsigned long digest, const nmpc_command_t *command)
{
    return fold_real(fold_real(digest, command->roll_rad), command->pitch_rad);
}

/* Fold in all that a call leaves in a controller. */
NMPC_SELF_TEST_SHARED unsigned long fold_controller(unsigned long digest, const nmpc_t *self)
{
    unsigned long folded = fold(digest, (unsigned long)nmpc_is_saturated(self));

    folded = fold(folded, (unsigned long)nmpc_limits_active(self));
    folded = fold(folded, (unsigned long)self->steps_blind);
    return fold_reals(folded, stored_numbers(self), NMPC_STORED_NUMBERS);
}

/* Scale of each pseudo-random input: its value per unit of a draw, an integer of 24 bits. */
#define NMPC_SELF_TEST_TARGET_M 2.3841858e-07f
#define NMPC_SELF_TEST_TARGET_M_S 1.1920929e-07f
#define NMPC_SELF_TEST_ATTITUDE_RAD 9.536743e-08f
#define NMPC_SELF_TEST_YAW_RAD 1.1920929e-05f
#define NMPC_SELF_TEST_HEADING_RAD 0.00012207031f
#define NMPC_SELF_TEST_TURN_RAD 4.7683716e-07f
#define NMPC_SELF_TEST_THRUST_M_S2 3.5762787e-07f
#define NMPC_SELF_TEST_HOVER_M_S2 9.81f
#define NMPC_SELF_TEST_TARGET_M_S2 7.6744703e-07f
#define NMPC_SELF_TEST_CHANGE_M_S 7.674471e-09f
#define NMPC_SELF_TEST_NOISE_M_S 4.3213366e-09f
#define NMPC_SELF_TEST_MOST_NOISE_M_S 3.2725378e-08f
#define NMPC_SELF_TEST_TINY_M 1.1755e-40f

/* Scales of the errors of position and velocity, from large to none; each input draws one. */
static const nmpc_real_t self_test_error_m[5] = {
    2.3841858e-06f, 1.1920929e-07f, 1.1920929e-08f, 5.9604643e-10f, 0.0f
};
static const nmpc_real_t self_test_error_m_s[5] = {
    1.1920929e-06f, 5.9604645e-08f, 5.9604646e-09f, 2.9802322e-10f, 0.0f
};

/* How many numbers the members of nmpc_state_t and nmpc_target_t are, but for integers. */
#define NMPC_SELF_TEST_STATE_NUMBERS 7U
#define NMPC_SELF_TEST_TARGET_NUMBERS 8U
#define NMPC_SELF_TEST_MOST_NUMBERS (NMPC_SELF_TEST_STATE_NUMBERS + NMPC_SELF_TEST_TARGET_NUMBERS)

/* In one of eight episodes the inputs from this one on, counted from 0, have no good state: in turn until the model has
 * come to rest, near a target at rest, and until it brakes. */
#define NMPC_SELF_TEST_FIRST_LOST 1
#define NMPC_SELF_TEST_UNTIL_REST 23
#define NMPC_SELF_TEST_UNTIL_BRAKING 15

/* sizeof(nmpc_real_t) */
#define NMPC_SELF_TEST_REAL_BYTES 4

/* A run of the self-test: its random numbers, and the inputs of the next step. */
typedef struct {
    unsigned long stream;
    nmpc_state_t state;
    nmpc_target_t target;
    nmpc_real_t thrust_m_s2;
    nmpc_real_t change_m_s[2]; /* of the target's velocity from step to step */
    nmpc_real_t aim[4]; /* place and velocity of the target when its input began */
    int found_again; /* the first input after an outage; 0 without one */
} nmpc_self_test_run_t;

static void start(nmpc_self_test_run_t *run, int episode)
{
    run->stream = fold(0UL, (unsigned long)episode + 1UL);
    run->found_again = 0;
    if (((unsigned int)episode & 7U) == 7U) {
        run->found_again = NMPC_SELF_TEST_UNTIL_REST;
    }
    if (((unsigned int)episode & 15U) == 15U) {
        run->found_again = NMPC_SELF_TEST_UNTIL_BRAKING;
    }
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

/* An integer of 24 bits, which nmpc_real_t holds exactly, times `scale`: rounded once. */
static nmpc_real_t scaled(long number, nmpc_real_t scale)
{
    return (nmpc_real_t)number * scale;
}

/* Draw an integer of 24 bits with a sign; in three of 128 cases 0, -1 or 2^23 of either sign. */
NMPC_SELF_TEST_SHARED long draw_integer(unsigned long *stream)
{
    const unsigned long word = next_number(stream);
    const unsigned long which = word & 127UL;
    long number = (long)(word >> 8) - 8388608L;

    if (which == 0UL) {
        number = 0L;
    } else if (which == 1UL) {
        number = -1L;
    } else if (which == 2UL) {
        number = ((word & 128UL) == 0UL) ? -8388608L : 8388608L;
    } else {
        /* Any number. */
    }
    return number;
}

/* Draw a number of either sign. */
NMPC_SELF_TEST_SHARED nmpc_real_t draw(unsigned long *stream, nmpc_real_t scale)
{
    return scaled(draw_integer(stream), scale);
}

/* Draw a number with the sign of `scale`. */
NMPC_SELF_TEST_SHARED nmpc_real_t draw_share(unsigned long *stream, nmpc_real_t scale)
{
    const long number = draw_integer(stream);

    return scaled((number < 0L) ? -number : number, scale);
}

/* A number outside of every range, so it is refused: NaN, with every bit set, or a large one of either sign. */
static nmpc_real_t beyond(unsigned long choice)
{
    nmpc_real_t value = ((choice & 2UL) == 0UL) ? 1e+09f : -1e+09f;
    unsigned char *bytes = (unsigned char *)&value;
    int i;

    for (i = 0; ((choice & 1UL) == 0UL) && (i < NMPC_SELF_TEST_REAL_BYTES); i++) {
        bytes[i] = 0xFFU;
    }
    return value;
}

/* Put each of `count` numbers out of range in one of 64 cases, and change its sign in another. */
NMPC_SELF_TEST_SHARED void spoil(unsigned long *stream, nmpc_real_t numbers[], unsigned int count)
{
    const unsigned long choice = next_number(stream);
    const unsigned int which = (unsigned int)(choice & 31UL);

    if (which < count) {
        numbers[which] = ((choice & 32UL) == 0UL) ? beyond(choice >> 6) : -numbers[which];
    }
}

/* Draw the input of the next steps, number `index` of its run. The target jumps where the error is large. One drone in
 * 16 is at its target, and level. */
static void next_input(nmpc_self_test_run_t *run, int index)
{
    unsigned long *const stream = &run->stream;
    nmpc_state_t *const state = &run->state;
    nmpc_target_t *const target = &run->target;
    const unsigned long choice = next_number(stream);
    unsigned long size = (((choice >> 2) & 15UL) == 0UL) ? 4UL : (choice & 3UL);
    const nmpc_real_t attitude_rad = (size == 4UL) ? (nmpc_real_t)0 : NMPC_SELF_TEST_ATTITUDE_RAD;
    nmpc_real_t target_m = NMPC_SELF_TEST_TARGET_M;
    nmpc_real_t target_m_s = NMPC_SELF_TEST_TARGET_M_S;
    nmpc_real_t change_m_s = NMPC_SELF_TEST_CHANGE_M_S;
    int is_early = 0;
    int axis;

    if (index < run->found_again) {
        is_early = 1;
    }
    if ((is_early != 0) && (run->found_again == NMPC_SELF_TEST_UNTIL_REST)) {
        size = 3UL;
        target_m = (nmpc_real_t)0;
        target_m_s = (nmpc_real_t)0;
        change_m_s = (nmpc_real_t)0;
    }
    for (axis = 0; axis < 2; axis++) {
        const nmpc_real_t place_m = draw(stream, target_m);
        const nmpc_real_t velocity_m_s = draw(stream, target_m_s);

        if ((index == 0) || (size == 0UL)) {
            run->aim[axis] = place_m;
            run->aim[2 + axis] = velocity_m_s;
        }
    }
    for (axis = 0; axis < 2; axis++) {
        target->position_m[axis] = run->aim[axis];
        target->velocity_m_s[axis] = run->aim[2 + axis];
    }
    for (axis = 0; axis < 2; axis++) {
        state->position_m[axis] = target->position_m[axis] + draw(stream, self_test_error_m[size]);
    }
    for (axis = 0; axis < 2; axis++) {
        state->velocity_m_s[axis] = target->velocity_m_s[axis] + draw(stream, self_test_error_m_s[size]);
    }
    state->roll_rad = draw(stream, attitude_rad);
    state->pitch_rad = draw(stream, attitude_rad);
    state->yaw_rad = draw(stream, NMPC_SELF_TEST_YAW_RAD);
    run->thrust_m_s2 = NMPC_SELF_TEST_HOVER_M_S2 + draw(stream, NMPC_SELF_TEST_THRUST_M_S2);
    if ((((choice >> 6) & 15UL) == 0UL) || (run->thrust_m_s2 < NMPC_THRUST_ACCELERATION_MIN_M_S2)) {
        run->thrust_m_s2 = NMPC_THRUST_ACCELERATION_MIN_M_S2;
    } else if ((((choice >> 6) & 15UL) == 1UL) || (run->thrust_m_s2 > NMPC_THRUST_ACCELERATION_MAX_M_S2)) {
        run->thrust_m_s2 = NMPC_THRUST_ACCELERATION_MAX_M_S2;
    } else {
        /* The thrust is within its range. */
    }
    for (axis = 0; axis < 2; axis++) {
        target->acceleration_m_s2[axis] = draw(stream, NMPC_SELF_TEST_TARGET_M_S2);
    }
    for (axis = 0; axis < 2; axis++) {
        target->ahead_m_s2[axis] = draw(stream, NMPC_SELF_TEST_TARGET_M_S2);
    }
    target->known = 0;
    if (((choice >> 17) & 1UL) != 0UL) {
        target->known = 1;
    }
    if (((choice >> 18) & 1UL) != 0UL) {
        target->known += 2;
    }
    if ((target->known == 3) && (((choice >> 19) & 7UL) != 0UL)) {
        target->known = 0;
    }
    if ((target->known == 3) && (((choice >> 22) & 1UL) != 0UL)) {
        target->known = -1;
    }
    for (axis = 0; axis < 2; axis++) {
        run->change_m_s[axis] = draw(stream, change_m_s);
    }
    if ((is_early != 0) && (index >= NMPC_SELF_TEST_FIRST_LOST)) {
        state->position_m[0] = beyond(0UL);
    }
}

static void clear(nmpc_real_t numbers[], unsigned int count)
{
    unsigned int k;

    for (k = 0U; (k < count) && (k < NMPC_SELF_TEST_MOST_NUMBERS); k++) {
        numbers[k] = (nmpc_real_t)0;
    }
}

/* Take a step of a drone almost at its target: its error is less than the smallest normal number, which some boards
 * flush to 0. */
static unsigned long tiny_step(nmpc_t *scratch, nmpc_self_test_run_t *run)
{
    nmpc_command_t command;
    nmpc_status_t status;

    clear(numbers_of(&run->state), NMPC_SELF_TEST_STATE_NUMBERS);
    clear(numbers_of(&run->target), NMPC_SELF_TEST_TARGET_NUMBERS);
    run->target.known = 0;
    run->state.position_m[0] = NMPC_SELF_TEST_TINY_M;
    status = nmpc_step(scratch, &run->state, &run->target, NMPC_SELF_TEST_HOVER_M_S2, &command);
    return fold_controller(fold_command(fold(0UL, (unsigned long)status), &command), scratch);
}

/* The limits of the settings, or a share of these in place of any of them. */
#define NMPC_SELF_TEST_LIMITS 7U
static const nmpc_real_t self_test_limits[NMPC_SELF_TEST_LIMITS] =
    { 2.3841858e-07f, 3.5762787e-07f, -4.7683716e-07f, 4.7683716e-07f, 4.7683716e-07f, 4.7683716e-07f,
      4.172325e-08f };

static nmpc_status_t call_set_limits(nmpc_t *scratch, unsigned long *stream)
{
    const unsigned long choice = next_number(stream);
    nmpc_limits_t limits;
    nmpc_real_t *const numbers = numbers_of(&limits);
    unsigned int k;

    nmpc_default_limits(&limits);
    for (k = 0U; k < NMPC_SELF_TEST_LIMITS; k++) {
        const nmpc_real_t share = draw_share(stream, self_test_limits[k]);

        if (((choice >> k) & 1UL) != 0UL) {
            numbers[k] = share;
        }
    }
    spoil(stream, numbers, NMPC_SELF_TEST_LIMITS);
    return nmpc_set_limits(scratch, &limits);
}

static nmpc_status_t call_shift(nmpc_t *scratch, unsigned long *stream, int turns)
{
    nmpc_real_t changes[5]; /* of position, velocity and heading */
    unsigned int k;

    for (k = 0U; k < 2U; k++) {
        changes[k] = draw(stream, NMPC_SELF_TEST_TARGET_M);
        changes[2U + k] = draw(stream, NMPC_SELF_TEST_TARGET_M_S);
    }
    changes[4] = (turns != 0) ? draw(stream, NMPC_SELF_TEST_YAW_RAD) : (nmpc_real_t)0;
    spoil(stream, changes, 5U);
    return nmpc_frame_jumped(scratch, changes, &changes[2], changes[4]);
}

static void draw_command(unsigned long *stream, nmpc_command_t *command)
{
    command->roll_rad = draw(stream, NMPC_SELF_TEST_ATTITUDE_RAD);
    command->pitch_rad = draw(stream, NMPC_SELF_TEST_ATTITUDE_RAD);
    spoil(stream, numbers_of(command), 2U);
}

/* How many rows the table of the target's observer has. */
#define NMPC_SELF_TEST_MEMORIES 59UL

static void draw_memory(unsigned long *stream, nmpc_motion_t *motion)
{
    const unsigned long drawn = next_number(stream) % NMPC_SELF_TEST_MEMORIES;
    const int counted = 17 + (int)drawn;

    motion->memory = (nmpc_real_t)counted;
    motion->noise = draw_share(stream, ((counted % 2) == 0) ? NMPC_SELF_TEST_NOISE_M_S : NMPC_SELF_TEST_MOST_NOISE_M_S);
}

/* Let the target's observer count any number of set-points: few steps in a row would not reach every row. */
static void draw_memories(nmpc_t *scratch, unsigned long *stream)
{
    draw_memory(stream, &scratch->tracker.axis[0]);
    draw_memory(stream, &scratch->tracker.axis[1]);
}

/* Fold in the next heading from one that may be near the end of the range. */
static unsigned long fold_heading(unsigned long digest, unsigned long *stream)
{
    nmpc_real_t headings_rad[3]; /* previous, wanted, most change */

    headings_rad[0] = draw(stream, NMPC_SELF_TEST_HEADING_RAD);
    headings_rad[1] = draw(stream, NMPC_SELF_TEST_HEADING_RAD);
    headings_rad[2] = draw_share(stream, NMPC_SELF_TEST_TURN_RAD);
    spoil(stream, headings_rad, 3U);
    return fold_real(digest, nmpc_slew_heading(headings_rad[0], headings_rad[1], headings_rad[2]));
}

/* Fold in what functions return for null pointers, and that a step then makes no step. */
static unsigned long fold_nulls(unsigned long digest, nmpc_t *scratch, const nmpc_self_test_run_t *run)
{
    const nmpc_real_t still[2] = { (nmpc_real_t)0, (nmpc_real_t)0 };
    nmpc_command_t command;
    unsigned long refused = 0UL;
    unsigned long results = digest;

    nmpc_init(NULL);
    refused += (unsigned long)nmpc_step(NULL, &run->state, &run->target, run->thrust_m_s2, &command);
    results = fold_command(results, &command);
    refused += (unsigned long)nmpc_step(scratch, NULL, &run->target, run->thrust_m_s2, &command);
    results = fold_command(results, &command);
    refused += (unsigned long)nmpc_step(scratch, &run->state, NULL, run->thrust_m_s2, &command);
    refused += (unsigned long)nmpc_step(scratch, &run->state, &run->target, run->thrust_m_s2, NULL);
    refused += (unsigned long)nmpc_reset(NULL, &command);
    refused += (unsigned long)nmpc_reset(scratch, NULL);
    refused += (unsigned long)nmpc_frame_jumped(NULL, still, still, (nmpc_real_t)0);
    refused += (unsigned long)nmpc_frame_jumped(scratch, NULL, still, (nmpc_real_t)0);
    refused += (unsigned long)nmpc_frame_jumped(scratch, still, NULL, (nmpc_real_t)0);
    refused += (unsigned long)nmpc_report_command(NULL, &command);
    refused += (unsigned long)nmpc_report_command(scratch, NULL);
    refused += (unsigned long)nmpc_last_estimate(scratch, NULL);
    nmpc_default_limits(NULL);
    refused += (unsigned long)nmpc_set_limits(scratch, NULL);
    return fold(results, refused);
}

/* Call other functions before the steps with input number `index`: every time those that change nothing, and in turn
 * one of those that do; none of these in an episode with an outage, which they would end. */
static unsigned long call_others(nmpc_t *scratch, nmpc_self_test_run_t *run, int index, unsigned long digest)
{
    unsigned long *const stream = &run->stream;
    const unsigned int turn = (run->found_again > 0) ? 15U : ((unsigned int)index & 15U);
    unsigned long results = fold_heading(digest, stream);
    nmpc_command_t command;
    nmpc_estimate_t estimate;
    nmpc_status_t status = nmpc_last_estimate(scratch, &estimate);

    results = fold_reals(results, numbers_of(&estimate), 6);
    results = fold(results, (unsigned long)estimate.is_valid);
    if ((turn == 1U) || (turn == 9U)) {
        status = call_shift(scratch, stream, index & 8);
    }
    if ((turn == 2U) || (turn == 10U)) {
        draw_command(stream, &command);
        status = nmpc_report_command(scratch, &command);
    }
    if ((turn == 0U) || (turn == 8U)) {
        status = call_set_limits(scratch, stream);
    }
    if (turn == 5U) {
        draw_command(stream, &command);
        status = nmpc_reset(scratch, &command);
    }
    if ((turn == 7U) || (turn == 13U)) {
        draw_memories(scratch, stream);
    }
    if (turn == 6U) {
        results = fold_nulls(results, scratch, run);
    }
    return fold_controller(fold(results, (unsigned long)status), scratch);
}

/* Take step number `step` of a run, of four steps the first after other calls, and fold in all results. */
static unsigned long run_step(nmpc_t *scratch, nmpc_self_test_run_t *run, int step, unsigned long digest)
{
    const unsigned int turn = (unsigned int)step % NMPC_SELF_TEST_HELD;
    const unsigned int number = (unsigned int)step / NMPC_SELF_TEST_HELD;
    const int index = (int)number;
    /* Of every second input the last step is bad, of the others the last three, so that a bad one follows one without a
     * difference, or with one. A bad target does not move. */
    const unsigned int first_bad = (NMPC_SELF_TEST_HELD - 1U) - (2U * (number % 2U));
    unsigned long results = digest;
    nmpc_command_t command;
    nmpc_status_t status;

    if (turn == 0U) {
        next_input(run, index);
        results = call_others(scratch, run, index, results);
    } else if (turn <= first_bad) {
        run->target.velocity_m_s[0] = run->target.velocity_m_s[0] + run->change_m_s[0];
        run->target.velocity_m_s[1] = run->target.velocity_m_s[1] + run->change_m_s[1];
    } else {
        /* It holds. */
    }
    if (turn == first_bad) {
        spoil(&run->stream, numbers_of(&run->state), NMPC_SELF_TEST_STATE_NUMBERS);
        spoil(&run->stream, numbers_of(&run->target), NMPC_SELF_TEST_TARGET_NUMBERS);
        spoil(&run->stream, &run->thrust_m_s2, 1U);
    }
    status = nmpc_step(scratch, &run->state, &run->target, run->thrust_m_s2, &command);
    results = fold_command(fold(results, (unsigned long)status), &command);
    return fold_controller(results, scratch);
}

int nmpc_self_test(nmpc_t *scratch)
{
    nmpc_self_test_run_t run;
    unsigned long results;
    int first_difference = 0;
    int i;

    nmpc_init(scratch);
    start(&run, NMPC_SELF_TEST_START);
    results = tiny_step(scratch, &run);
    for (i = 0; i < NMPC_SELF_TEST_STEPS; i++) {
        if (i > 0) {
            results = run_step(scratch, &run, i - 1, results);
        }
        if ((first_difference == 0) && (results != self_test_digests[i])) {
            first_difference = i + 1;
        }
    }
    nmpc_init(scratch);
    return first_difference;
}

unsigned long nmpc_self_test_episode(nmpc_t *scratch, int episode, unsigned long digest)
{
    nmpc_self_test_run_t run;
    unsigned long results = 0UL;
    int step;

    nmpc_init(scratch);
    start(&run, episode);
    for (step = 0; step < NMPC_SELF_TEST_TICKS; step++) {
        results = run_step(scratch, &run, step, results);
    }
    nmpc_init(scratch);
    return fold(digest, results);
}
