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
    { { { -386400, 201589 }, { 2575303, 41943 },
        -10267656, 4227858, -2960130 },
      { { -400556, 247464 }, { -159384, 511705 } },
      385070662, NMPC_OK,
      { -11744051, -11743629 },
    { -17203, 9291, -256073, 191949, -1032612, 598884, 0, 0, 0, 0, 0, 0, -23593984, 23593984, -336328572,
      -1019708094, -159384, 511705, -6528368, 0, -2176123, 0, -10267656, 4227858, -11744051, -11743629 } },
    { { { -41419, -344719 }, { -2021655, 3422552 },
        -503316, -9462350, 3153068 },
      { { 36176, -364380 }, { 134218, 394265 } },
      306721063, NMPC_OK,
      { 11744051, 11743629 },
    { -18933, -6118, -316268, -38858, -1122623, -353099, -44137, 159444, -235566, 181348, -4701399, 3622108,
      23593984, -23593984, 144081861, -1064030978, 134218, 394265, 7673693, -4810342, 3283272, -1603448,
      -503316, -9462350, 11744051, 11743629 } },
    { { { 460587, 262 }, { 1132462, -1149239 },
        9294578, 301990, -5413798 },
      { { 472646, 72352 }, { -201327, 721420 } },
      362622747, NMPC_OK,
      { 11744051, -11743629 },
    { 3008, -6066, 30415, -28691, 432610, -373558, 272027, 39394, 1421, -2074, 936812, -556060, 23593984,
      23593984, 966562113, 467631465, -201327, 721420, -8265440, 10193374, -3124197, 3539225, 9294578, 301990,
      11744051, -11743629 } },
    { { { -85721, 502006 }, { -3657433, 2038432 },
        -4429185, 10099884, 698352 },
      { { -139198, 508822 }, { -92275, 419430 } },
      284306702, NMPC_OK,
      { -11744051, 5610601 },
    { -1776, 17567, -91184, 326902, 2754, 1227536, 420964, -62383, 234138, 179110, 5451539, 3151413, 199680,
      -11272192, 663407122, 844282237, -92275, 419430, -1228048, -5503210, 262999, -2872712, -4429185,
      10099884, -11744051, 5610601 } },
    { { { 258998, -44302 }, { -679477, -2701132 },
        5368709, -3623879, 6811550 },
      { { 297533, -103023 }, { -612368, 570425 } },
      340174832, NMPC_OK,
      { 11744051, -3392966 },
    { 9988, 14462, 108851, 261827, 770352, 838296, 592122, -203954, 230874, 92159, 4405040, 937126, -8918016,
      6816768, 226787385, 1049518455, -612368, 570425, -1228048, 1996794, 0, 584860, 5368709, -3623879,
      11744051, -3392966 } },
    { { { 524288000, 300417 }, { 2743075, 310378 },
        -8355054, 6174015, -1755316 },
      { { -314573, 333447 }, { -679477, 92275 } },
      396076515, NMPC_BAD_STATE,
      { 11743629, 11743629 },
    { 10202, 14976, 109811, 264592, 770352, 838296, 703149, -95238, 135112, 145834, 1750253, 1839758,
      23593984, -23593984, 226787385, 1049518455, -679477, 92275, -3362808, 1996794, -711587, 0, 5368709,
      -3623879, 11743629, 11743629 } },
    { { { 57410, -245891 }, { -1769996, 3774874 },
        1442841, -7549747, 4356833 },
      { { 122159, -278397 }, { -301990, 58720 } },
      317726917, NMPC_OK,
      { 11743629, 3974006 },
    { 12088, 3925, 111550, 66579, 803518, 157767, -665434, -545730, 363419, -35268, 6102892, -2064786,
      23593984, -7984128, -911219207, -567979806, -301990, 58720, 13424671, -376016, 3539225, -790937,
      1442841, -7549747, 11743629, 3974006 } },
    { { { -488899, 99090 }, { 1468006, -704643 },
        11207180, 2248147, -4210033 },
      { { -489685, 158335 }, { -553648, 478151 } },
      373628600, NMPC_OK,
      { 11744051, -11743629 },
    { -10535, 8163, -275652, 91022, -646827, 390961, -554676, 475326, 604199, -92080, 9588212, -2973513,
      -6191104, 23593984, 823046584, -689576556, -553648, 478151, -1825963, 16596418, -2724062, 3539225,
      11207180, 2248147, 11744051, -11743629 } },
    { { { 13107, -447480 }, { -3221225, 2583691 },
        -2516582, -11475616, 1903165 },
      { { -53215, -453771 }, { -352322, 268435 } },
      295312556, NMPC_OK,
      { -11744051, 11743629 },
    { -10287, -12104, -275007, -177633, -641865, -871071, 19925, 425789, 545768, 86437, 6443985, 1105083,
      6099968, -23593984, 1041884197, -259612837, -352322, 268435, 5971301, 1477855, 783047, -2680038,
      -2516582, -11475616, -11744051, 11743629 } },
    { { { 358089, 54788 }, { -159384, -2080375 },
        7281312, -1677722, -6663700 },
      { { 383517, -17039 }, { -780141, 503316 } },
      351180685, NMPC_OK,
      { 11744051, 11743629 },
    { 6377, -9550, 18074, -111334, 516894, -715076, 228935, -407558, 605070, -98363, 6375435, -2686675,
      1923072, -23593984, -77043686, 1070974218, -780141, 503316, -14146292, 9019635, -3539225, 727235,
      7281312, -1677722, 11744051, 11743629 } },
    { { { -188482, 399507 }, { 3347055, 1015022 },
        -6442451, 8086618, -551551 },
      { { -228590, 419693 }, { -763363, 109052 } },
      272864641, NMPC_OK,
      { -11744051, 11743629 },
    { -1922, 9314, -133261, 198282, 80189, 570748, 153613, -817784, 620625, -276026, 5488246, -5896329,
      -23593984, -23593984, -539102251, 928595857, -763363, 109052, -8155531, -11275618, -362563, -3539225,
      -6442451, 8086618, -11744051, 11743629 } },
    { { { 156238, -147063 }, { -1073742, -3816817 },
        3355443, -5603590, 5561647 },
      { { 208142, -192414 }, { -293601, 167772 } },
      328766325, NMPC_OK,
      { 11744051, -7757390 },
    { 5043, 1529, 4058, 25097, 538166, -111943, -301130, -1242229, 382324, -449843, -306755, -8613242,
      -23593984, 15585280, -891252258, 598824611, -293601, 167772, -8155531, -5002250, 0, -268361, 3355443,
      -5603590, 11744051, -7757390 } },
    { { { -390070, 197919 }, { 2256536, 176161 },
        -10368319, 4160750, -3005219 },
      { { -403702, 244318 }, { -452985, -1677721600 } },
      384634454, NMPC_BAD_TARGET,
      { 11744051, -7757390 },
    { -12618, 10627, -259157, 212909, -535194, 470560, -1406655, 873600, 149680, -318682, -4947029, -4898327,
      22146150, 17581952, -292183518, -1033223256, -293601, 167772, -8155531, -5002250, 0, -268361, -10368319,
      4160750, 11744051, -7757390 } },
    { { { -45351, -348652 }, { -2348810, 3548381 },
        -570425, -9529459, 3106931 },
      { { 32768, -367788 }, { -167772, 545260 } },
      306318410, NMPC_OK,
      { 11744051, 11743629 },
    { -14805, -4981, -327452, -20177, -663799, -497253, -1014861, 1171479, 385506, -188840, 451628, -1447193,
      -23593984, -23593984, 190744325, -1056663668, -167772, 545260, 1076191, 12826604, 3077241, 3539225,
      -570425, -9529459, 11744051, 11743629 } },
    { { { 456917, -3670 }, { 796918, -1023410 },
        9193914, 234881, -5459935 },
      { { 469500, 68944 }, { -511705, 872415 } },
      362186539, NMPC_OK,
      { 11744051, -11743629 },
    { 6707, -5122, 13022, -12444, 856804, -532331, 1159947, 722634, 159694, -378538, -4339763, -4847130,
      23593984, 23593984, 945057653, 509693572, -511705, 872415, -12010779, 21583184, -2310830, 3539225,
      9193914, 234881, 11744051, -11743629 } },
    { { { -89391, 498598 }, { -3992977, 2164261 },
        -4496294, 10032775, 653263 },
      { { -142344, 505676 }, { -402653, 570425 } },
      283870495, NMPC_OK,
      { -11744051, -3294088 },
    { 1507, 18349, -116575, 340717, 395273, 1056928, 1171621, -17958, 384739, -201358, 1226388, -480899,
      -23593984, 6618112, 626500753, 872019673, -402653, 570425, -2694034, 191695, 1565028, -3539225,
      -4496294, 10032775, -11744051, -3294088 } },
    { { { 255328, -48234 }, { -1015022, -2583691 },
        5268046, -3690988, 6766461 },
      { { 294126, -106430 }, { -922747, 713032 } },
      339772178, NMPC_OK,
      { 11744051, -10936799 },
    { 12870, 15060, 78774, 271361, 1134599, 655076, 956761, -490978, 137378, -150193, -3719384, 608929,
      -23593984, 21972992, 181462131, 1058297217, -922747, 713032, -2694034, 4167418, 0, -1034242, 5268046,
      -3690988, 11744051, -10936799 } },
    { { { -291242, 296747 }, { 2399142, 419430 },
        -8422162, 6073352, -1801454 },
      { { -317719, 330301 }, { -998244, 226492 } },
      395640308, NMPC_OK,
      { -11744051, -70336 },
    { -569, 28281, -153414, 495594, 316680, 1433942, -511818, -537675, -106840, 22254, -7679648, 3888703,
      -23593984, 141312, -1062129338, -157488970, -998244, 226492, -4439374, 4167418, -581780, 0, -8422162,
      6073352, -11744051, -70336 } },
    { { { 53740, -249561 }, { -2113929, 3883926 },
        1342177, -7616856, 4311745 },
      { { 119013, -281543 }, { -620757, 192938 } },
      317324263, NMPC_OK,
      { 11744051, -648318 },
    { 1382, 16642, -136391, 273847, 427377, 645183, -927295, 143904, -335844, 26442, -10850780, 3313410,
      23593984, 1302528, -885961753, -606624493, -620757, 192938, 12951291, 709337, 3539225, -1152694,
      1342177, -7616856, 11744051, -648318 } },
    { { { -492831, 95158 }, { 1124073, -603980 },
        11140071, 2147484, -4255121 },
      { { -493093, 154927 }, { -872415, 603980 } },
      0, NMPC_BAD_THRUST,
      { 11744051, -648318 },
    { -21179, 20290, -509158, 277151, -950553, 777190, 693257, 1042200, -88968, 34607, -3987227, 3004703,
      -6094621, -22830424, 851927971, -653559665, -620757, 192938, 12951291, 709337, 3539225, -1152694,
      11140071, 2147484, 11744051, -648318 } },
    { { { 9437, -451150 }, { -3581936, 2667577 },
        -2583691, -11542725, 1857028 },
      { { -56361, -456917 }, { -679477, 385876 } },
      294876348, NMPC_OK,
      { -11744051, 7935780 },
    { -20849, -550, -491079, -12484, -877230, -578498, 883903, 717357, -155787, -149346, -4407152, -961461,
      -13910016, -15943680, 1052295025, -213533803, -679477, 385876, 5840087, 7681063, -10918, 1555446,
      -2583691, -11542725, -11744051, 7935780 } },
    { { { 354157, 51118 }, { -520094, -1988100 },
        7214203, -1778385, -6709838 },
      { { 380109, -20185 }, { -1115685, 620757 } },
      350778032, NMPC_OK,
      { 11744051, -11743629 },
    { -4107, 1445, -182384, 33385, 344141, -508405, 308720, -739507, -302403, -276980, -6300717, -3261505,
      23593984, 23593984, -124077449, 1066548776, -1115685, 620757, 5840087, 14238981, 0, 3222937, 7214203,
      -1778385, 11744051, -11743629 } },
    { { { -192152, 395837 }, { 2986344, 1107296 },
        -6509560, 8019509, -596640 },
      { { -231735, 416285 }, { -1098908, 226492 } },
      272461988, NMPC_OK,
      { -11744051, -2042304 },
    { -12311, 19761, -320517, 326129, -33645, 698717, -202644, -763237, -68535, -89293, -343821, 861303,
      -23593984, 4103168, -578521445, 904563121, -1098908, 226492, 3607230, -7418135, -744286, -3539225,
      -6509560, 8019509, -11744051, -2042304 } }
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
#define NMPC_SELF_TEST_TARGET_M 524288
#define NMPC_SELF_TEST_TARGET_M_S 8388608
#define NMPC_SELF_TEST_ATTITUDE_RAD 16777216
#define NMPC_SELF_TEST_YAW_RAD 104857600
#define NMPC_SELF_TEST_THRUST_M_S2 100663296
#define NMPC_SELF_TEST_HOVER_M_S2 329168978
#define NMPC_SELF_TEST_CHANGE_M_S 540043

/* Consecutive control steps with the same input, but for the target's velocity, so that moves reach their limits and searches converge. */
#define NMPC_SELF_TEST_HELD 4

/* Scales of the errors of position and velocity, from large to small; each input draws one of the four. */
static const nmpc_real_t self_test_error_m[4] = { 5242880, 131072, 13107, 1311 };
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
