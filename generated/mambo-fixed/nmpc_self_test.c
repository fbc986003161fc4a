/* SPDX-License-Identifier: MIT-0
 *
 * Self-test: 24 consecutive control steps with the results of the reference, and 100000 control steps with
 * pseudo-random inputs, of whose results there is a digest.
 * MISRA C:2012: departs from rules 2.3, 2.5, 8.9, 10.1, 11.5 and 19.2, for the reasons in deviations.txt.
 */
#include "nmpc_self_test.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x22D24429UL)
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
    nmpc_real_t stored[NMPC_STORED_NUMBERS];
} nmpc_self_test_step_t;

static const nmpc_self_test_step_t self_test_steps[NMPC_SELF_TEST_STEPS] = {
    { { { 0, 0 }, { 0, 0 },
        0, 0, 0 },
      { { 0, 0 }, { 0, 0 } },
      329168978, NMPC_OK,
      { 0, 0 },
    { 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1073741824, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0 } },
    { { { -772801, 403177 }, { 2575303, 41943 },
        -10267656, 4227858, -2960130 },
      { { -801112, 494928 }, { -159384, 511705 } },
      385070662, NMPC_OK,
      { -11744051, -11744051 },
    { -34408, 18584, -512148, 383898, -1032614, 598882, 0, 0, 0, 0, 0, 0, -23595008, 23595008, -336328570,
      -1019708094, -159384, 511705, -6528368, 0, -2176123, 0, -10267656, 4227858, -11744051, -11744051 } },
    { { { -82838, -689439 }, { -2021655, 3422552 },
        -503316, -9462350, 3153068 },
      { { 72352, -728760 }, { 134218, 394265 } },
      306721063, NMPC_OK,
      { 11744051, 11744051 },
    { -37869, -12233, -632536, -77718, -1122622, -353105, -44139, 159451, -235576, 181356, -4701603, 3622265,
      23595008, -23595008, 144081861, -1064030978, 134218, 394265, 7673693, -4810342, 3283272, -1603448,
      -503316, -9462350, 11744051, 11744051 } },
    { { { 921174, 524 }, { 1132462, -1149239 },
        9294578, 301990, -5413798 },
      { { 945291, 144703 }, { -201327, 721420 } },
      362622747, NMPC_OK,
      { 11744051, -11744051 },
    { 6013, -12129, 60833, -57386, 432616, -373568, 272039, 39395, 1421, -2074, 936853, -556084, 23595008,
      23595008, 966562113, 467631465, -201327, 721420, -8265440, 10193374, -3124197, 3539225, 9294578, 301990,
      11744051, -11744051 } },
    { { { -171442, 1004012 }, { -3657433, 2038432 },
        -4429185, 10099884, 698352 },
      { { -278397, 1017643 }, { -92275, 419430 } },
      284306702, NMPC_OK,
      { -11744051, 5609837 },
    { -3554, 35137, -182363, 653798, 2763, 1227522, 420982, -62386, 234148, 179118, 5451776, 3151550, 200704,
      -11270656, 663407122, 844282237, -92275, 419430, -1228048, -5503211, 262999, -2872712, -4429185,
      10099884, -11744051, 5609837 } },
    { { { 517997, -88605 }, { -679477, -2701132 },
        5368709, -3623879, 6811550 },
      { { 595067, -206045 }, { -612368, 570425 } },
      340174832, NMPC_OK,
      { 11744051, -3392966 },
    { 19974, 28926, 217707, 523645, 770365, 838277, 592158, -203955, 230894, 92179, 4405434, 937478, -8916992,
      6816768, 226787384, 1049518455, -612368, 570425, -1228048, 1996794, 0, 584860, 5368709, -3623879,
      11744051, -3392966 } },
    { { { 1048576000, 600834 }, { 2743075, 310378 },
        -8355054, 6174015, -1755316 },
      { { -629146, 666894 }, { -679477, 92275 } },
      396076515, NMPC_BAD_STATE,
      { 11744051, 11744051 },
    { 20401, 29954, 219627, 529175, 770365, 838277, 703204, -95218, 135142, 145854, 1750773, 1840056,
      23595008, -23595008, 226787384, 1049518455, -679477, 92275, -3362808, 1996794, -711587, 0, 5368709,
      -3623879, 11744051, 11744051 } },
    { { { 114819, -491782 }, { -1769996, 3774874 },
        1442841, -7549747, 4356833 },
      { { 244318, -556794 }, { -301990, 58720 } },
      317726917, NMPC_OK,
      { 11744051, 3974261 },
    { 24174, 7853, 223106, 133149, 803533, 157746, -665466, -545808, 363458, -35256, 6103512, -2064691,
      23595008, -7984640, -911219207, -567979807, -301990, 58720, 13424670, -376016, 3539225, -790937,
      1442841, -7549747, 11744051, 3974261 } },
    { { { -977797, 198181 }, { 1468006, -704643 },
        11207180, 2248147, -4210033 },
      { { -979370, 316670 }, { -553648, 478151 } },
      373628600, NMPC_OK,
      { 11744051, -11744051 },
    { -21071, 16330, -551296, 182033, -646809, 390938, -554741, 475349, 604248, -92072, 9588913, -2973511,
      -6191616, 23595008, 823046584, -689576555, -553648, 478151, -1825964, 16596418, -2724061, 3539225,
      11207180, 2248147, 11744051, -11744051 } },
    { { { 26214, -894960 }, { -3221225, 2583691 },
        -2516582, -11475616, 1903165 },
      { { -106430, -907543 }, { -352322, 268435 } },
      295312556, NMPC_OK,
      { -11744051, 11744051 },
    { -20575, -24206, -550006, -355278, -641847, -871098, 19905, 425829, 545813, 86453, 6444444, 1105242,
      6100480, -23595008, 1041884197, -259612836, -352322, 268435, 5971301, 1477854, 783048, -2680038,
      -2516582, -11475616, -11744051, 11744051 } },
    { { { 716177, 109576 }, { -159384, -2080375 },
        7281312, -1677722, -6663700 },
      { { 767033, -34079 }, { -780141, 503316 } },
      351180685, NMPC_OK,
      { 11744051, 11744051 },
    { 12753, -19097, 36157, -222681, 516911, -715105, 228974, -407574, 605120, -98356, 6375905, -2686698,
      1921536, -23595008, -77043685, 1070974218, -780141, 503316, -14146291, 9019634, -3539225, 727235,
      7281312, -1677722, 11744051, 11744051 } },
    { { { -376963, 799015 }, { 3347055, 1015022 },
        -6442451, 8086618, -551551 },
      { { -457179, 839385 }, { -763363, 109052 } },
      272864641, NMPC_OK,
      { -11744051, 11744051 },
    { -3846, 18630, -266511, 396549, 80208, 570717, 153648, -817825, 620659, -276027, 5488316, -5896506,
      -23595008, -23595008, -539102252, 928595857, -763363, 109052, -8155531, -11275619, -362563, -3539225,
      -6442451, 8086618, -11744051, 11744051 } },
    { { { 312476, -294126 }, { -1073742, -3816817 },
        3355443, -5603590, 5561647 },
      { { 416285, -384827 }, { -293601, 167772 } },
      328766325, NMPC_OK,
      { 11744051, -7756626 },
    { 10085, 3059, 8127, 50177, 538187, -111975, -301124, -1242292, 382347, -449851, -306903, -8613550,
      -23595008, 15583744, -891252258, 598824612, -293601, 167772, -8155531, -5002251, 0, -268361, 3355443,
      -5603590, 11744051, -7756626 } },
    { { { -780141, 395837 }, { 2256536, 176161 },
        -10368319, 4160750, -3005219 },
      { { -807404, 488636 }, { -452985, -1677721600 } },
      384634454, NMPC_BAD_TARGET,
      { 11744051, -7756626 },
    { -25236, 21255, -518302, 425800, -535175, 470527, -1406735, 873630, 149693, -318701, -4947351, -4898823,
      22145009, 17583404, -292183517, -1033223256, -293601, 167772, -8155531, -5002251, 0, -268361, -10368319,
      4160750, 11744051, -7756626 } },
    { { { -90702, -697303 }, { -2348810, 3548381 },
        -570425, -9529459, 3106931 },
      { { 65536, -735576 }, { -167772, 545260 } },
      306318410, NMPC_OK,
      { 11744051, 11744051 },
    { -29609, -9962, -654894, -40370, -663781, -497284, -1014943, 1171525, 385509, -188848, 451143, -1447390,
      -23595008, -23595008, 190744324, -1056663668, -167772, 545260, 1076191, 12826603, 3077241, 3539225,
      -570425, -9529459, 11744051, 11744051 } },
    { { { 913834, -7340 }, { 796918, -1023410 },
        9193914, 234881, -5459935 },
      { { 939000, 137888 }, { -511705, 872415 } },
      362186539, NMPC_OK,
      { 11744051, -11744051 },
    { 13415, -10244, 26051, -24903, 856819, -532360, 1160003, 722723, 159688, -378554, -4340355, -4847454,
      23595008, 23595008, 945057653, 509693573, -511705, 872415, -12010779, 21583183, -2310830, 3539225,
      9193914, 234881, 11744051, -11744051 } },
    { { { -178782, 997196 }, { -3992977, 2164261 },
        -4496294, 10032775, 653263 },
      { { -284688, 1011352 }, { -402653, 570425 } },
      283870495, NMPC_OK,
      { -11744051, -3294343 },
    { 3013, 36697, -233143, 681419, 395285, 1056901, 1171682, -17911, 384742, -201366, 1226118, -481016,
      -23595008, 6618624, 626500754, 872019673, -402653, 570425, -2694034, 191694, 1565028, -3539225,
      -4496294, 10032775, -11744051, -3294343 } },
    { { { 510657, -96469 }, { -1015022, -2583691 },
        5268046, -3690988, 6766461 },
      { { 588251, -212861 }, { -922747, 713032 } },
      339772178, NMPC_OK,
      { 11744051, -10937309 },
    { 25739, 30117, 157557, 542708, 1134613, 655052, 956818, -490961, 137370, -150198, -3719804, 608908,
      -23595008, 21974016, 181462130, 1058297217, -922747, 713032, -2694034, 4167417, 0, -1034242, 5268046,
      -3690988, 11744051, -10937309 } },
    { { { -582484, 593494 }, { 2399142, 419430 },
        -8422162, 6073352, -1801454 },
      { { -635437, 660603 }, { -998244, 226492 } },
      395640308, NMPC_OK,
      { -11744051, -70336 },
    { -1138, 56559, -306820, 991176, 316694, 1433925, -511809, -537712, -106858, 22256, -7680189, 3888843,
      -23595008, 141312, -1062129338, -157488969, -998244, 226492, -4439374, 4167417, -581780, 0, -8422162,
      6073352, -11744051, -70336 } },
    { { { 107479, -499122 }, { -2113929, 3883926 },
        1342177, -7616856, 4311745 },
      { { 238027, -563085 }, { -620757, 192938 } },
      317324263, NMPC_OK,
      { 11744051, -648318 },
    { 2765, 33282, -272774, 547684, 427389, 645172, -927322, 143887, -335872, 26444, -10851417, 3313529,
      23595008, 1302528, -885961753, -606624495, -620757, 192938, 12951291, 709337, 3539225, -1152694,
      1342177, -7616856, 11744051, -648318 } },
    { { { -985661, 190317 }, { 1124073, -603980 },
        11140071, 2147484, -4255121 },
      { { -986186, 309854 }, { -872415, 603980 } },
      0, NMPC_BAD_THRUST,
      { 11744051, -648318 },
    { -42357, 40577, -1018309, 554294, -950542, 777184, 693262, 1042247, -88985, 34609, -3987533, 3004804,
      -6094939, -22831398, 851927971, -653559666, -620757, 192938, 12951291, 709337, 3539225, -1152694,
      11140071, 2147484, 11744051, -648318 } },
    { { { 18874, -902300 }, { -3581936, 2667577 },
        -2583691, -11542725, 1857028 },
      { { -112722, -913834 }, { -679477, 385876 } },
      294876348, NMPC_OK,
      { -11744051, 7935780 },
    { -41697, -1102, -982152, -24974, -877222, -578498, 883915, 717402, -155807, -149352, -4407460, -961525,
      -13911040, -15943680, 1052295025, -213533802, -679477, 385876, 5840087, 7681062, -10918, 1555446,
      -2583691, -11542725, -11744051, 7935780 } },
    { { { 708313, 102236 }, { -520094, -1988100 },
        7214203, -1778385, -6709838 },
      { { 760218, -40370 }, { -1115685, 620757 } },
      350778032, NMPC_OK,
      { 11744051, -11744051 },
    { -8214, 2886, -364765, 66766, 344145, -508401, 308758, -739514, -302433, -276986, -6301168, -3261560,
      23595008, 23595008, -124077449, 1066548776, -1115685, 620757, 5840087, 14238980, 0, 3222937, 7214203,
      -1778385, 11744051, -11744051 } },
    { { { -384303, 791675 }, { 2986344, 1107296 },
        -6509560, 8019509, -596640 },
      { { -463471, 832569 }, { -1098908, 226492 } },
      272461988, NMPC_OK,
      { -11744051, -2042049 },
    { -24622, 39519, -641030, 652257, -33640, 698729, -202626, -763251, -68555, -89291, -343978, 861414,
      -23595008, 4102656, -578521448, 904563121, -1098908, 226492, 3607230, -7418136, -744286, -3539225,
      -6509560, 8019509, -11744051, -2042049 } }
};

/* The numbers of a controller, in the order of its members, all of which come before its single bytes. */
static const nmpc_real_t *stored_numbers(const nmpc_t *self)
{
    return (const nmpc_real_t *)(const void *)self;
}

static int has_stored(const nmpc_t *self, const nmpc_real_t expected[NMPC_STORED_NUMBERS])
{
    const nmpc_real_t *const stored = stored_numbers(self);
    int equal = 1;
    int k;

    for (k = 0; k < NMPC_STORED_NUMBERS; k++) {
        if (!(stored[k] == expected[k])) {
            equal = 0;
        }
    }
    return equal;
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

        if ((first_difference == 0)
            && !((status == expected->status) && (command.roll_rad == expected->command.roll_rad)
                 && (command.pitch_rad == expected->command.pitch_rad)
                 && (has_stored(scratch, expected->stored) != 0))) {
            first_difference = i + 1;
        }
    }
    nmpc_init(scratch);
    return first_difference;
}

/* Scale of each pseudo-random input: its value per 2^23 units of a draw, a signed integer of 24 bits. */
#define NMPC_SELF_TEST_TARGET_M 1048576
#define NMPC_SELF_TEST_TARGET_M_S 8388608
#define NMPC_SELF_TEST_ATTITUDE_RAD 16777216
#define NMPC_SELF_TEST_YAW_RAD 104857600
#define NMPC_SELF_TEST_THRUST_M_S2 100663296
#define NMPC_SELF_TEST_HOVER_M_S2 329168978
#define NMPC_SELF_TEST_CHANGE_M_S 540043

/* Consecutive control steps with the same input, but for the target's velocity, so that moves reach their limits and searches converge. */
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
    union {
        nmpc_real_t real;
        nmpc_word_t bits;
    } view;

    view.real = value;
    return fold(digest, (unsigned long)view.bits);
}

static unsigned long fold_results(unsigned long digest, const nmpc_t *self, nmpc_status_t status)
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

    return (nmpc_real_t)((((nmpc_sum_t)number * scale) + 4194304) >> 23);
}

/* The largest number: outside of every range, so it is refused. */
#define NMPC_SELF_TEST_BEYOND 2147483647

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

            results = fold_results(results, scratch, status);
            target.velocity_m_s[0] = target.velocity_m_s[0] + change_m_s[0];
            target.velocity_m_s[1] = target.velocity_m_s[1] + change_m_s[1];
        }
    }
    nmpc_init(scratch);
    return fold(digest, results);
}
