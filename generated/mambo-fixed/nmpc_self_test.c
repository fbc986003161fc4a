/* SPDX-License-Identifier: MIT-0
 *
 * Self-test: 24 consecutive control steps with the results of the reference, and 100000 control steps with
 * pseudo-random inputs, of whose results there is a digest.
 * MISRA C:2012: departs from rules 2.3, 2.5, 8.9, 10.1, 11.5 and 19.2, for the reasons in deviations.txt.
 */
#include "nmpc_self_test.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x48A3891DUL)
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
    { 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1073741824, 0, 0, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 41943040, 201326592, 11744051, 23041, 23041, 0, 0, 0, 0 } },
    { { { -386400, 201589 }, { 2575303, 41943 },
        -10267656, 4227858, -2960130 },
      { { -400556, 247464 }, { -159384, 511705 } },
      385070662, NMPC_OK,
      { -11744051, -9646789 },
    { -17203, 9291, -256073, 191949, -1032612, 598884, 0, 0, 0, 0, 0, 0, -23593984, 19381248, -336328572,
      -1019708094, -18813625, 12102339, 0, 0, 0, 0, 0, 0, 260899300, 260899300, 1244700, 304895, 41943040,
      201326592, 11744051, 23041, 23041, -10267656, 4227858, -11744051, -9646789 } },
    { { { -41419, -344719 }, { -2021655, 3422552 },
        -503316, -9462350, 3153068 },
      { { 36176, -364380 }, { 134218, 394265 } },
      306721063, NMPC_OK,
      { 11744051, -4482161 },
    { -18933, -6118, -316268, -38858, -1122623, -353099, -53833, 139535, -235566, 148968, -4701399, 2975376,
      21507072, 9005056, 144081861, -1064030978, 2901046, -17788287, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 41943040, 201326592, 11744051, 23041, 23041, -503316, -9462350, 11744051, -4482161 } },
    { { { 460587, 262 }, { 1132462, -1149239 },
        9294578, 301990, -5413798 },
      { { 472646, 72352 }, { -201327, 721420 } },
      362622747, NMPC_OK,
      { 11744051, -3428135 },
    { 3008, -6066, 30415, -28691, 432610, -373558, 385568, 22222, -19320, 216416, 520969, 3901042, -23593984,
      6887424, 966562113, 467631465, 22323107, 4478362, 0, 0, 0, 0, 0, 0, 260899300, 260899300, 1244700,
      304895, 41943040, 201326592, 11744051, 23041, 23041, 9294578, 301990, 11744051, -3428135 } },
    { { { -85721, 502006 }, { -3657433, 2038432 },
        -4429185, 10099884, 698352 },
      { { -139198, 508822 }, { -92275, 419430 } },
      284306702, NMPC_OK,
      { -11744051, -10072885 },
    { -1776, 17567, -91184, 326902, 2754, 1227536, 380385, 144039, -258758, 268230, -4284239, 4359506,
      23593984, 20237312, 663407122, 844282237, -6563001, 23556063, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 41943040, 201326592, 11744051, 23041, 23041, -4429185, 10099884, -11744051, -10072885 } },
    { { { 258998, -44302 }, { -679477, -2701132 },
        5368709, -3623879, 6811550 },
      { { 297533, -103023 }, { -612368, 570425 } },
      340174832, NMPC_OK,
      { 11744051, -10459225 },
    { 9988, 14462, 108851, 261827, 770352, 838296, 492561, 327843, -26003, 421627, 1270848, 6797039, 4552704,
      21013504, 226787385, 1049518455, 14173301, -5441431, 0, 0, 0, 0, 0, 0, 260899300, 260899300, 1244700,
      304895, 41943040, 201326592, 11744051, 23041, 23041, 5368709, -3623879, 11744051, -10459225 } },
    { { { 524288000, 300417 }, { 2743075, 310378 },
        -8355054, 6174015, -1755316 },
      { { -314573, 333447 }, { -679477, 92275 } },
      396076515, NMPC_BAD_STATE,
      { 11743629, 5478593 },
    { 10203, 14976, 111658, 264665, 770352, 838296, 539962, 837358, 14385, 579016, 1924799, 8979526, 23593984,
      -11006976, 226787385, 1049518455, -16425172, 15567456, 0, 0, 0, 0, 0, 0, 260899300, 260899300, 1244700,
      304895, 41943040, 201326592, 11744051, 23041, 23041, 5368709, -3623879, 11743629, 5478593 } },
    { { { 57410, -245891 }, { -1769996, 3774874 },
        1442841, -7549747, 4356833 },
      { { 122159, -278397 }, { -301990, 58720 } },
      317726917, NMPC_OK,
      { -2140163, -2440877 },
    { 12090, 3925, 113285, 66648, 803014, 157747, 432942, -1395708, 244281, 485945, 6242657, 5911233,
      -4299776, 4903936, -911219207, -567979806, -301990, 58720, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 41943040, 201326592, 11744051, 23041, 23041, 1442841, -7549747, -2140163, -2440877 } },
    { { { -488899, 99090 }, { 1468006, -704643 },
        11207180, 2248147, -4210033 },
      { { -489685, 158335 }, { -553648, 478151 } },
      373628600, NMPC_OK,
      { 11744051, -11743629 },
    { -10532, 8163, -274024, 91087, -647808, 390922, -1064055, -328392, 195817, 532550, 4141944, 5756595,
      23455744, 23593984, 823046584, -689576556, -23216497, 7583407, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 41943040, 201326592, 11744051, 23041, 23041, 11207180, 2248147, 11744051, -11743629 } },
    { { { 13107, -447480 }, { -3221225, 2583691 },
        -2516582, -11475616, 1903165 },
      { { -53215, -453771 }, { -352322, 268435 } },
      295312556, NMPC_OK,
      { -11744051, 11743629 },
    { -10283, -12104, -273481, -177571, -643297, -871127, -588376, 489948, 439546, 714878, 7990462, 8494960,
      23593984, -23593984, 1041884197, -259612837, -2473393, -21304224, 0, 0, 0, 0, 0, 0, 260899300,
      260899300, 1244700, 304895, 41943040, 201326592, 11744051, 23041, 23041, -2516582, -11475616, -11744051,
      11743629 } },
    { { { 358089, 54788 }, { -159384, -2080375 },
        7281312, -1677722, -6663700 },
      { { 383517, -17039 }, { -780141, 503316 } },
      351180685, NMPC_OK,
      { 11744051, -10161570 },
    { 6382, -9549, 19503, -111275, 515037, -715149, 868807, -146828, 679179, 527728, 11099660, 3568721,
      -22427648, 20415488, -77043686, 1070974218, 18243670, 113270, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 41943040, 201326592, 11744051, 23041, 23041, 7281312, -1677722, 11744051, -10161570 } },
    { { { -188482, 399507 }, { 3347055, 1015022 },
        -6442451, 8086618, -551551 },
      { { -228590, 419693 }, { -763363, 109052 } },
      272864641, NMPC_OK,
      { -11744051, 7922018 },
    { -1917, 9315, -131925, 198335, 77930, 570656, 1151845, -329341, 444393, 684780, 4418922, 6155008,
      7161856, -15916032, -539102251, 928595857, -11685267, 19882295, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 41943040, 201326592, 11744051, 23041, 23041, -6442451, 8086618, -11744051, 7922018 } },
    { { { 156238, -147063 }, { -1073742, -3816817 },
        3355443, -5603590, 5561647 },
      { { 208142, -192414 }, { -293601, 167772 } },
      328766325, NMPC_OK,
      { 11744051, -2353211 },
    { 5050, 1530, 5305, 25146, 535530, -112052, 1192640, -573102, 503647, 563301, 4965486, 2766700, 1391616,
      4727808, -891252258, 598824611, -293601, 167772, 0, 0, 0, 0, 0, 0, 260899300, 260899300, 1244700,
      304895, 41943040, 201326592, 11744051, 23041, 23041, 3355443, -5603590, 11744051, -2353211 } },
    { { { -390070, 197919 }, { 2256536, 176161 },
        -10368319, 4160750, -3005219 },
      { { -403702, 244318 }, { -452985, -1677721600 } },
      384634454, NMPC_BAD_TARGET,
      { 692661, -2353211 },
    { -12610, 10628, -257995, 212954, -538190, 470434, -723218, -1193118, 504769, 603128, 4253347, 3067766,
      1391616, 4727808, -292183518, -1033223256, -293601, 167772, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 41943040, 201326592, 11744051, 23041, 23041, -10368319, 4160750, 692661, -2353211 } },
    { { { -45351, -348652 }, { -2348810, 3548381 },
        -570425, -9529459, 3106931 },
      { { 32768, -367788 }, { -167772, 545260 } },
      306318410, NMPC_OK,
      { 11744051, 3242100 },
    { -14796, -4981, -326373, -20135, -667134, -497394, -836334, -568251, 524779, 647497, 3683111, 3322613,
      23593984, -6513664, 190744325, -1056663668, 2212035, -17842031, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 41943040, 201326592, 11744051, 23041, 23041, -570425, -9529459, 11744051, 3242100 } },
    { { { 456917, -3670 }, { 796918, -1023410 },
        9193914, 234881, -5459935 },
      { { 469500, 68944 }, { -511705, 872415 } },
      362186539, NMPC_OK,
      { 11744051, -4664628 },
    { 6716, -5122, 14022, -12405, 853149, -532484, -152962, 605909, 767677, 600733, 7650603, 1812565,
      -23593984, 9371648, 945057653, 509693572, 21774809, 4436930, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 41943040, 201326592, 11744051, 23041, 23041, 9193914, 234881, 11744051, -4664628 } },
    { { { -89391, 498598 }, { -3992977, 2164261 },
        -4496294, 10032775, 653263 },
      { { -142344, 505676 }, { -402653, 570425 } },
      283870495, NMPC_OK,
      { -11744051, -10470948 },
    { 1515, 18348, -115648, 340753, 391320, 1056764, 394026, 652957, 531912, 667676, 1424725, 2973022,
      23593984, 21037056, 626500753, 872019673, -7185848, 23548867, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 41943040, 201326592, 11744051, 23041, 23041, -4496294, 10032775, -11744051, -10470948 } },
    { { { 255328, -48234 }, { -1015022, -2583691 },
        5268046, -3690988, 6766461 },
      { { 294126, -106430 }, { -922747, 713032 } },
      339772178, NMPC_OK,
      { 11744051, -10358818 },
    { 12878, 15059, 79632, 271395, 1130370, 654906, 916659, 595031, 763219, 823645, 5842229, 5746181, 5091328,
      20811776, 181462131, 1058297217, 13538623, -5504528, 0, 0, 0, 0, 0, 0, 260899300, 260899300, 1244700,
      304895, 41943040, 201326592, 11744051, 23041, 23041, 5268046, -3690988, 11744051, -10358818 } },
    { { { -291242, 296747 }, { 2399142, 419430 },
        -8422162, 6073352, -1801454 },
      { { -317719, 330301 }, { -998244, 226492 } },
      395640308, NMPC_OK,
      { -11744051, 10141692 },
    { -560, 28280, -152623, 495626, 312194, 1433766, 638278, -1426299, 803747, 977633, 5692603, 8059025,
      -20751360, -20375552, -1062129338, -157488970, -16533713, 15053777, 0, 0, 0, 0, 0, 0, 260899300,
      260899300, 1244700, 304895, 41943040, 201326592, 11744051, 23041, 23041, -8422162, 6073352, -11744051,
      10141692 } },
    { { { 53740, -249561 }, { -2113929, 3883926 },
        1342177, -7616856, 4311745 },
      { { 119013, -281543 }, { -620757, 192938 } },
      317324263, NMPC_OK,
      { 11744051, -4637615 },
    { 1391, 16641, -135663, 273877, 422650, 645001, 287646, -1158568, 589003, 829540, 423310, 3693798,
      6823936, 9317376, -885961753, -606624493, 5404457, -15085864, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 41943040, 201326592, 11744051, 23041, 23041, 1342177, -7616856, 11744051, -4637615 } },
    { { { -492831, 95158 }, { 1124073, -603980 },
        11140071, 2147484, -4255121 },
      { { -493093, 154927 }, { -872415, 603980 } },
      0, NMPC_BAD_THRUST,
      { 3396534, -4637615 },
    { -21170, 20289, -508489, 277179, -955504, 777002, -840676, -91468, 654103, 908726, 1698715, 4557120,
      6823936, 9317376, 851927971, -653559665, 5404457, -15085864, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 41943040, 201326592, 11744051, 23041, 23041, 11140071, 2147484, 3396534, -4637615 } },
    { { { 9437, -451150 }, { -3581936, 2667577 },
        -2583691, -11542725, 1857028 },
      { { -56361, -456917 }, { -679477, 385876 } },
      294876348, NMPC_OK,
      { -11744051, 11743629 },
    { -20840, -551, -490467, -12457, -882389, -578691, -486870, 553812, 729975, 979737, 2719980, 5287906,
      11392000, -23593984, 1052295025, -213533803, -2446442, -21723465, 0, 0, 0, 0, 0, 0, 260899300,
      260899300, 1244700, 304895, 41943040, 201326592, 11744051, 23041, 23041, -2583691, -11542725, -11744051,
      11743629 } },
    { { { 354157, 51118 }, { -520094, -1988100 },
        7214203, -1778385, -6709838 },
      { { 380109, -20185 }, { -1115685, 620757 } },
      350778032, NMPC_OK,
      { 11744051, -11743629 },
    { -4098, 1444, -181826, 33410, 338789, -508602, 811144, 27735, 847773, 792786, 4447989, 854008, -20994048,
      23593984, -124077449, 1066548776, 18184109, -464753, 0, 0, 0, 0, 0, 0, 260899300, 260899300, 1244700,
      304895, 41943040, 201326592, 11744051, 23041, 23041, 7214203, -1778385, 11744051, -11743629 } },
    { { { -192152, 395837 }, { 2986344, 1107296 },
        -6509560, 8019509, -596640 },
      { { -231735, 416285 }, { -1098908, 226492 } },
      272461988, NMPC_OK,
      { -11744051, 5997961 },
    { -12302, 19760, -320010, 326153, -39175, 698516, 904481, -163230, 629152, 973528, -621657, 4345010,
      6439936, -12050432, -578521445, 904563121, -11778907, 19505380, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 41943040, 201326592, 11744051, 23041, 23041, -6509560, 8019509, -11744051, 5997961 } }
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
