/* SPDX-License-Identifier: MIT-0
 *
 * Self-test: 24 consecutive control steps with the results of the reference, and 100000 control steps with
 * pseudo-random inputs, of whose results there is a digest.
 * MISRA C:2012: departs from rules 2.5, 8.9 and 10.1, for the reasons in deviations.txt.
 */
#include "nmpc_self_test.h"

#include "nmpc_math.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0xD4C905DCUL)
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
    { { { 0, 0 }, { 0, 0 },
        0, 0, 0 },
      { { 0, 0 }, { 0, 0 } },
      329168978, NMPC_OK,
      { 0, 0 }, 0,
      { 0, 0 } },
    { { { -772801, 403177 }, { 285213, 7449084 },
        -164282499, 67645735, -2960130 },
      { { -801112, 494928 }, { -2449474, 7918846 } },
      385070662, NMPC_OK,
      { -39951780, -39951780 }, 168003652807LL,
      { 43988793088LL, 632213836544LL } },
    { { { -82838, -689439 }, { 2382365, 1157628 },
        -8053064, -151397597, 3153068 },
      { { 72352, -728760 }, { 4538237, -1870660 } },
      306721063, NMPC_OK,
      { 0, 0 }, 479946772376LL,
      { -312869088000LL, -562993900544LL } },
    { { { 921174, 524 }, { -3917480, 3246391 },
        148713243, 4831838, -5413798 },
      { { 945291, 144703 }, { -5251269, 5117051 } },
      362622747, NMPC_OK,
      { -39951780, -39951780 }, 284582260376LL,
      { 200071977088LL, 790268812544LL } },
    { { { -171442, 1004012 }, { -1828717, -3053453 },
        -70866960, 161598145, 698352 },
      { { -278397, 1017643 }, { 1736442, -4672455 } },
      284306702, NMPC_OK,
      { 0, -79903560 }, 68532004376LL,
      { -89511120000LL, 221277580544LL } },
    { { { 517997, -88605 }, { -8128561, -956301 },
        85899346, -57982058, 6811550 },
      { { 595067, -206045 }, { -8061452, 2315256 } },
      340174832, NMPC_OK,
      { -39951780, -97899470 }, 207897905767LL,
      { 439392633088LL, 176868124544LL } },
    { { { 1048576000, 600834 }, { 2348810, -7264535 },
        -133680857, 98784248, -1755316 },
      { { -629146, 666894 }, { -1073742, -7482638 } },
      396076515, NMPC_BAD_STATE,
      { -39951780, -97899470 }, 207897905767LL,
      { 439392633088LL, 176868124544LL } },
    { { { 114819, -491782 }, { 4445962, 3221225 },
        23085449, -120795955, 4356833 },
      { { 244318, -556794 }, { 5913969, -494928 } },
      317726917, NMPC_OK,
      { 0, -137851250 }, 363171000771LL,
      { -521117568000LL, 165503356544LL } },
    { { { -977797, 198181 }, { -1853882, 5309989 },
        179314885, 35970351, -4210033 },
      { { -979370, 316670 }, { -3875537, 6492783 } },
      373628600, NMPC_OK,
      { -39951780, -177803030 }, 294232296771LL,
      { 601408905088LL, 108988972544LL } },
    { { { 26214, -894960 }, { 243270, -981467 },
        -40265318, -183609852, 1903165 },
      { { -106430, -907543 }, { 3112174, -3296723 } },
      295312556, NMPC_OK,
      { 0, -137851250 }, 295703256771LL,
      { -260747856000LL, -404203804544LL } },
    { { { 716177, 109576 }, { -6056575, 1107296 },
        116500988, -26843546, -6663700 },
      { { 767033, -34079 }, { -6677332, 3690988 } },
      351180685, NMPC_OK,
      { -39951780, -97899470 }, 256017864771LL,
      { 437295849088LL, -335291020544LL } },
    { { { -376963, 799015 }, { 4412408, -5200937 },
        -103079215, 129385890, -551551 },
      { { -457179, 839385 }, { 301990, -6106907 } },
      272864641, NMPC_OK,
      { 0, -57947690 }, 250538664771LL,
      { -117842832000LL, -608488108544LL } },
    { { { 312476, -294126 }, { 6509560, -3103785 },
        53687091, -89657442, 5561647 },
      { { 416285, -384827 }, { 7289700, 880804 } },
      328766325, NMPC_OK,
      { 39951780, -97899470 }, 160161243174LL,
      { -476283600000LL, 5255241088LL } },
    { { { -780141, 395837 }, { 209715, 7373586 },
        -165893112, 66571993, -3005219 },
      { { -807404, 488636 }, { -2499805, -1677721600 } },
      384634454, NMPC_BAD_TARGET,
      { 39951780, -97899470 }, 160161243174LL,
      { -476283600000LL, 5255241088LL } },
    { { { -90702, -697303 }, { 2306867, 1082130 },
        -9126806, -152471339, 3106931 },
      { { 65536, -735576 }, { 4487905, -1920991 } },
      306318410, NMPC_OK,
      { 79903560, -57947690 }, 469555994743LL,
      { -294107184000LL, -580819536000LL } },
    { { { 913834, -7340 }, { -3992977, 3170894 },
        147102630, 3758096, -5459935 },
      { { 939000, 137888 }, { -5301600, 5066719 } },
      362186539, NMPC_OK,
      { 39951780, -97899470 }, 289815626743LL,
      { 174302745088LL, 800367369088LL } },
    { { { -178782, 997196 }, { -1912603, -3128951 },
        -71940702, 160524403, 653263 },
      { { -284688, 1011352 }, { 1677722, -4722786 } },
      283870495, NMPC_OK,
      { 0, -137851250 }, 68605562743LL,
      { 14956377088LL, 107879865088LL } },
    { { { 510657, -96469 }, { -8204059, -1040187 },
        84288733, -59055800, 6766461 },
      { { 588251, -212861 }, { -8111784, 2256536 } },
      339772178, NMPC_OK,
      { -39951780, -155847160 }, 200494819739LL,
      { 433383081088LL, 202259049088LL } },
    { { { -582484, 593494 }, { 2273313, -7340032 },
        -134754599, 97173635, -1801454 },
      { { -635437, 660603 }, { -1124073, -7532970 } },
      395640308, NMPC_OK,
      { -79903560, -115895380 }, 147879866743LL,
      { 534494841088LL, -544046688000LL } },
    { { { 107479, -499122 }, { 4370465, 3145728 },
        21474836, -121869697, 4311745 },
      { { 238027, -563085 }, { 5863637, -545260 } },
      317324263, NMPC_OK,
      { -39951780, -155847160 }, 389514602743LL,
      { -525167568000LL, 134201625088LL } },
    { { { -985661, 190317 }, { -1929380, 5234491 },
        178241143, 34359738, -4255121 },
      { { -986186, 309854 }, { -3925869, 6442451 } },
      0, NMPC_BAD_THRUST,
      { -39951780, -155847160 }, 389514602743LL,
      { -525167568000LL, 134201625088LL } },
    { { { 18874, -902300 }, { 159384, -1065353 },
        -41339060, -184683594, 1857028 },
      { { -112722, -913834 }, { 3061842, -3347055 } },
      294876348, NMPC_OK,
      { 0, -115895380 }, 272492138743LL,
      { -413875872000LL, -375956784000LL } },
    { { { 708313, 102236 }, { -6140461, 1023410 },
        115427246, -28454158, -6709838 },
      { { 760218, -40370 }, { -6736052, 3632267 } },
      350778032, NMPC_OK,
      { -39951780, -75943600 }, 233297642743LL,
      { 425273001088LL, -36731952000LL } },
    { { { -384303, 791675 }, { 4336910, -5276434 },
        -104152957, 128312148, -596640 },
      { { -463471, 832569 }, { 251658, -6157238 } },
      272461988, NMPC_OK,
      { 0, -35991820 }, 210618218743LL,
      { -98499600000LL, -614230560000LL } }
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

/* Scale of each pseudo-random input: its value per 2^23 units of a draw, a signed integer of 24 bits. */
#define NMPC_SELF_TEST_TARGET_M 1048576
#define NMPC_SELF_TEST_TARGET_M_S 8388608
#define NMPC_SELF_TEST_ATTITUDE_RAD 268435456
#define NMPC_SELF_TEST_YAW_RAD 104857600
#define NMPC_SELF_TEST_THRUST_M_S2 100663296
#define NMPC_SELF_TEST_HOVER_M_S2 329168978

/* Consecutive control steps with the same input, so that moves reach their limits and searches converge. */
#define NMPC_SELF_TEST_HELD 4

/* Scales of the errors of position and velocity, from large to small; each input draws one of the four. */
static const nmpc_real_t self_test_error_m[4] = { 10485760, 262144, 26214, 2621 };
static const nmpc_real_t self_test_error_m_s[4] = { 83886080, 2097152, 209715, 20972 };

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
    return fold(digest, (unsigned long)nmpc_bits(value));
}

/* The same for a sum: the upper word first. */
static unsigned long fold_sum(unsigned long digest, nmpc_sum_t value)
{
    const unsigned long long bits = (unsigned long long)value;

    return fold(fold(digest, (unsigned long)(bits >> 32)), (unsigned long)(bits & 0xFFFFFFFFU));
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
    folded = fold_sum(folded, nmpc_last_cost(self));
    for (k = 0; k < NMPC_MOVES; k++) {
        folded = fold_sum(folded, self->gradient[k]);
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

/* Draw a signed integer of 24 bits, times `scale` / 2^23. */
static nmpc_real_t draw(unsigned long *stream, nmpc_real_t scale)
{
    const unsigned long bits = next_number(stream) >> 8;
    const nmpc_real_t number = (nmpc_real_t)bits - 8388608;

    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)number * scale, 23);
}

/* The largest number: outside of every range, so it is refused. */
#define NMPC_SELF_TEST_BEYOND 2147483647

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
        state->position_m[0] = NMPC_SELF_TEST_BEYOND;
        break;
    case 1UL:
        state->pitch_rad = NMPC_SELF_TEST_BEYOND;
        break;
    case 2UL:
        state->yaw_rad = NMPC_SELF_TEST_BEYOND;
        break;
    case 3UL:
        target->velocity_m_s[1] = -NMPC_SELF_TEST_BEYOND;
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
