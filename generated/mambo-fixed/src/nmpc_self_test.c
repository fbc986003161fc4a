/* SPDX-License-Identifier: MIT-0
 *
 * Self-test: inputs of consecutive steps of one controller, and what the reference controller made of them;
 * and many more steps, from inputs made of whole numbers, of which the reference made a digest.
 * MISRA C:2012: departs from rules 2.5, 8.9 and 10.1, for the reasons in deviations.txt.
 */
#include "nmpc_self_test.h"

#include "nmpc_math.h"

#define NMPC_SELF_TEST_STEPS 24

typedef struct {
    nmpc_state_t state;
    nmpc_target_t target;
    nmpc_real_t thrust_acceleration_m_s2;
    nmpc_status_t status;
    nmpc_command_t command;
    nmpc_sum_t cost;
    nmpc_sum_t gradient[NMPC_AXES];
} nmpc_self_test_step_t;

static const nmpc_self_test_step_t self_test_steps[NMPC_SELF_TEST_STEPS] = {
    { { { 0, 0 }, { 0, 0 },
        0, 0, 0 },
      { { 0, 0 }, { 0, 0 } },
      329168978, NMPC_OK,
      { 0, 0 }, 0,
      { 0, 0 } },
    { { { -1545601, 806355 }, { 285213, 7449084 },
        -164282499, 67645735, -2960130 },
      { { -1602224, 989856 }, { -2449474, 7918846 } },
      385070662, NMPC_OK,
      { -39951785, -39951785 }, 336011805615LL,
      { 351911496704LL, 5057710944352LL } },
    { { { -165675, -1378877 }, { 2382365, 1157628 },
        -8053064, -151397597, 3153068 },
      { { 144703, -1457521 }, { 4538237, -1870660 } },
      306721063, NMPC_OK,
      { 0, 0 }, 959895344754LL,
      { -2502951696000LL, -4503950592352LL } },
    { { { 1842348, 1049 }, { -3917480, 3246391 },
        148713243, 4831838, -5413798 },
      { { 1890583, 289407 }, { -5251269, 5117051 } },
      362622747, NMPC_OK,
      { -39951785, -39951785 }, 569163800754LL,
      { 1600576608704LL, 6322150968352LL } },
    { { { -342884, 2008023 }, { -1828717, -3053453 },
        -70866960, 161598145, 698352 },
      { { -556794, 2035286 }, { 1736442, -4672455 } },
      284306702, NMPC_OK,
      { 0, -79903570 }, 137066456754LL,
      { -716088744000LL, 1770221472352LL } },
    { { { 1035993, -177209 }, { -8128561, -956301 },
        85899346, -57982058, 6811550 },
      { { 1190134, -412090 }, { -8061452, 2315256 } },
      340174832, NMPC_OK,
      { -39951785, -97899483 }, 415800023535LL,
      { 3515142144704LL, 1414946112352LL } },
    { { { 2097152000, 1201668 }, { 2348810, -7264535 },
        -133680857, 98784248, -1755316 },
      { { -1258291, 1333789 }, { -1073742, -7482638 } },
      396076515, NMPC_BAD_STATE,
      { -39951785, -97899483 }, 415800023535LL,
      { 3515142144704LL, 1414946112352LL } },
    { { { 229638, -983564 }, { 4445962, 3221225 },
        23085449, -120795955, 4356833 },
      { { 488636, -1113588 }, { 5913969, -494928 } },
      317726917, NMPC_OK,
      { 0, -137851268 }, 726342901543LL,
      { -4168940328000LL, 1324027068352LL } },
    { { { -1955594, 396362 }, { -1853882, 5309989 },
        179314885, 35970351, -4210033 },
      { { -1958740, 633340 }, { -3875537, 6492783 } },
      373628600, NMPC_OK,
      { -39951785, -177803053 }, 588465169543LL,
      { 4811272068704LL, 871912716352LL } },
    { { { 52429, -1789919 }, { 243270, -981467 },
        -40265318, -183609852, 1903165 },
      { { -212861, -1815085 }, { 3112174, -3296723 } },
      295312556, NMPC_OK,
      { 0, -137851268 }, 591409897543LL,
      { -2085982344000LL, -3233629356352LL } },
    { { { 1432355, 219152 }, { -6056575, 1107296 },
        116500988, -26843546, -6663700 },
      { { 1534067, -68157 }, { -6677332, 3690988 } },
      351180685, NMPC_OK,
      { -39951785, -97899483 }, 512035513543LL,
      { 3498367368704LL, -2682327084352LL } },
    { { { -753926, 1598030 }, { 4412408, -5200937 },
        -103079215, 129385890, -551551 },
      { { -914358, 1678770 }, { 301990, -6106907 } },
      272864641, NMPC_OK,
      { 0, -57947698 }, 501077977543LL,
      { -942741576000LL, -4867903860352LL } },
    { { { 624951, -588251 }, { 6509560, -3103785 },
        53687091, -89657442, 5561647 },
      { { 832569, -769655 }, { 7289700, 880804 } },
      328766325, NMPC_OK,
      { 39951785, -97899483 }, 320321046351LL,
      { -3810267756000LL, 42042972704LL } },
    { { { -1560281, 791675 }, { 209715, 7373586 },
        -165893112, 66571993, -3005219 },
      { { -1614807, 977273 }, { -2499805, -1677721600 } },
      384634454, NMPC_BAD_TARGET,
      { 39951785, -97899483 }, 320321046351LL,
      { -3810267756000LL, 42042972704LL } },
    { { { -181404, -1394606 }, { 2306867, 1082130 },
        -9126806, -152471339, 3106931 },
      { { 131072, -1471152 }, { 4487905, -1920991 } },
      306318410, NMPC_OK,
      { 79903570, -57947698 }, 939113897490LL,
      { -2352857364000LL, -4646555856000LL } },
    { { { 1827668, -14680 }, { -3992977, 3170894 },
        147102630, 3758096, -5459935 },
      { { 1878000, 275775 }, { -5301600, 5066719 } },
      362186539, NMPC_OK,
      { 39951785, -97899483 }, 579624665490LL,
      { 1394422356704LL, 6402938952704LL } },
    { { { -357564, 1994392 }, { -1912603, -3128951 },
        -71940702, 160524403, 653263 },
      { { -569377, 2022703 }, { 1677722, -4722786 } },
      283870495, NMPC_OK,
      { 0, -137851268 }, 137211269490LL,
      { 119651736704LL, 863038920704LL } },
    { { { 1021313, -192938 }, { -8204059, -1040187 },
        84288733, -59055800, 6766461 },
      { { 1176502, -425722 }, { -8111784, 2256536 } },
      339772178, NMPC_OK,
      { -39951785, -155847181 }, 400993023481LL,
      { 3467065260704LL, 1618072536704LL } },
    { { { -1164968, 1186988 }, { 2273313, -7340032 },
        -134754599, 97173635, -1801454 },
      { { -1270874, 1321206 }, { -1124073, -7532970 } },
      395640308, NMPC_OK,
      { -79903570, -115895396 }, 295757321490LL,
      { 4275958872704LL, -4352372316000LL } },
    { { { 214958, -998244 }, { 4370465, 3145728 },
        21474836, -121869697, 4311745 },
      { { 476054, -1126171 }, { 5863637, -545260 } },
      317324263, NMPC_OK,
      { -39951785, -155847181 }, 779032229490LL,
      { -4201339500000LL, 1073613000704LL } },
    { { { -1971323, 380633 }, { -1929380, 5234491 },
        178241143, 34359738, -4255121 },
      { { -1972371, 619708 }, { -3925869, 6442451 } },
      0, NMPC_BAD_THRUST,
      { -39951785, -155847181 }, 779032229490LL,
      { -4201339500000LL, 1073613000704LL } },
    { { { 37749, -1804599 }, { 159384, -1065353 },
        -41339060, -184683594, 1857028 },
      { { -225444, -1827668 }, { 3061842, -3347055 } },
      294876348, NMPC_OK,
      { 0, -115895396 }, 544990109490LL,
      { -3311006112000LL, -3007653660000LL } },
    { { { 1416626, 204472 }, { -6140461, 1023410 },
        115427246, -28454158, -6709838 },
      { { 1520435, -80740 }, { -6736052, 3632267 } },
      350778032, NMPC_OK,
      { -39951785, -75943611 }, 466596725490LL,
      { 3402184944704LL, -293855148000LL } },
    { { { -768606, 1583350 }, { 4336910, -5276434 },
        -104152957, 128312148, -596640 },
      { { -926941, 1665139 }, { 251658, -6157238 } },
      272461988, NMPC_OK,
      { 0, -35991826 }, 421234997490LL,
      { -787996152000LL, -4913844192000LL } }
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

/* What 2^23 units of a draw, a whole number of 24 bits, is in each input. */
#define NMPC_SELF_TEST_TARGET_M 2097152
#define NMPC_SELF_TEST_TARGET_M_S 8388608
#define NMPC_SELF_TEST_ATTITUDE_RAD 268435456
#define NMPC_SELF_TEST_YAW_RAD 104857600
#define NMPC_SELF_TEST_THRUST_M_S2 100663296
#define NMPC_SELF_TEST_HOVER_M_S2 329168978

/* Steps that see the same input: plans reach their limits, and costs come to rest. */
#define NMPC_SELF_TEST_HELD 4

/* The same for the errors, far to near. */
static const nmpc_real_t self_test_error_m[4] = { 20971520, 524288, 52429, 5243 };
static const nmpc_real_t self_test_error_m_s[4] = { 83886080, 2097152, 209715, 20972 };

/* Of nmpc_real_t. */
#define NMPC_SELF_TEST_REAL_BYTES 4

/* The lower 32 bits of an unsigned long, which may have more. */
static unsigned long word_of(unsigned long value)
{
    return value & 0xFFFFFFFFUL;
}

/* Fold a word into a digest: no two words give the same, and upper bits reach lower ones. */
static unsigned long fold(unsigned long digest, unsigned long word)
{
    const unsigned long mixed = word_of((digest ^ word) * 2654435761UL);

    return mixed ^ (mixed >> 15);
}

static unsigned long fold_real(unsigned long digest, nmpc_real_t value)
{
    return fold(digest, (unsigned long)nmpc_bits(value));
}

/* Fold a sum, the upper word first. */
static unsigned long fold_sum(unsigned long digest, nmpc_sum_t value)
{
    const unsigned long long bits = (unsigned long long)value;

    return fold(fold(digest, (unsigned long)(bits >> 32)), (unsigned long)(bits & 0xFFFFFFFFU));
}

static unsigned long fold_outcome(unsigned long digest, const nmpc_t *self, nmpc_status_t status,
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

/* The next of all 32-bit numbers but zero: xorshift (Marsaglia, Journal of Statistical Software 8(14), 2003). */
static unsigned long next_number(unsigned long *stream)
{
    unsigned long number = *stream;

    number ^= word_of(number << 13);
    number ^= number >> 17;
    number ^= word_of(number << 5);
    *stream = number;
    return number;
}

/* Draw a number of 24 bits, of which 2^23 are one `scale`. */
static nmpc_real_t draw(unsigned long *stream, nmpc_real_t scale)
{
    return (nmpc_real_t)NMPC_ROUNDED((nmpc_sum_t)((nmpc_real_t)(next_number(stream) >> 8) - 8388608) * scale, 23);
}

/* The largest number, which no range contains. */
#define NMPC_SELF_TEST_BEYOND 2147483647

/* Make the next input; five in 64 are refused. Returns the thrust acceleration, in m/s^2. */
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
    default: /* good as it is */
        break;
    }
    return thrust_m_s2;
}

unsigned long nmpc_self_test_episode(nmpc_t *scratch, int episode, unsigned long digest)
{
    unsigned long stream = fold(0UL, (unsigned long)episode + 1UL);
    unsigned long seen = 0UL;
    int tick;
    int again;

    nmpc_init(scratch);
    for (tick = 0; tick < NMPC_SELF_TEST_TICKS; tick += NMPC_SELF_TEST_HELD) {
        nmpc_state_t state;
        nmpc_target_t target;
        const nmpc_real_t thrust_m_s2 = next_input(&stream, &state, &target);

        for (again = 0; again < NMPC_SELF_TEST_HELD; again++) {
            nmpc_command_t command;
            const nmpc_status_t status = nmpc_step(scratch, &state, &target, thrust_m_s2, &command);

            seen = fold_outcome(seen, scratch, status, &command);
        }
    }
    nmpc_init(scratch);
    return fold(digest, seen);
}
