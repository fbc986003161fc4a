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
      1244700, 304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, 0, 0, 0, 0 } },
    { { { -386400, 201589 }, { 2575303, 41943 },
        -10267656, 4227858, -2960130 },
      { { -400556, 247464 }, { -159384, 511705 } },
      385070662, NMPC_OK,
      { -11744051, -11743629 },
    { -17203, 9291, -256073, 191949, -1032612, 598884, 0, 0, 0, 0, 0, 0, -23593984, 23593984, -336328572,
      -1019708094, -21472963, 13754693, 0, 0, 0, 0, 0, 0, 260899300, 260899300, 1244700, 304895, 213426,
      41943040, 201326592, 11744051, 23041, 23041, -10267656, 4227858, -11744051, -11743629 } },
    { { { -41419, -344719 }, { -2021655, 3422552 },
        -503316, -9462350, 3153068 },
      { { 36176, -364380 }, { 134218, 394265 } },
      306721063, NMPC_OK,
      { 11744051, -4554027 },
    { -18933, -6118, -316268, -38858, -1122623, -353099, -44137, 159444, -235566, 181348, -4701399, 3622108,
      23593984, 9149440, 144081861, -1064030978, 3449246, -21390846, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, -503316, -9462350, 11744051,
      -4554027 } },
    { { { 460587, 262 }, { 1132462, -1149239 },
        9294578, 301990, -5413798 },
      { { 472646, 72352 }, { -201327, 721420 } },
      362622747, NMPC_OK,
      { 11744051, -4615189 },
    { 3008, -6066, 30415, -28691, 432610, -373558, 435622, -14098, 1421, 249599, 936812, 4470654, -23593984,
      9272320, 966562113, 467631465, 25307184, 4976088, 0, 0, 0, 0, 0, 0, 260899300, 260899300, 1244700,
      304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, 9294578, 301990, 11744051, -4615189 } },
    { { { -85721, 502006 }, { -3657433, 2038432 },
        -4429185, 10099884, 698352 },
      { { -139198, 508822 }, { -92275, 419430 } },
      284306702, NMPC_OK,
      { -11744051, -11651886 },
    { -1776, 17567, -91184, 326902, 2754, 1227536, 444423, 127852, -238594, 319874, -3951258, 5207797,
      23593984, 23409664, 663407122, 844282237, -7341932, 26341194, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, -4429185, 10099884, -11744051,
      -11651886 } },
    { { { 258998, -44302 }, { -679477, -2701132 },
        5368709, -3623879, 6811550 },
      { { 297533, -103023 }, { -612368, 570425 } },
      340174832, NMPC_OK,
      { 11744051, -11743629 },
    { 9988, 14462, 108851, 261827, 770352, 838296, 583425, 343471, -6536, 497565, 1537478, 8002116, 249856,
      23593984, 226787385, 1049518455, 17962785, -6982237, 0, 0, 0, 0, 0, 0, 260899300, 260899300, 1244700,
      304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, 5368709, -3623879, 11744051, -11743629 } },
    { { { 524288000, 300417 }, { 2743075, 310378 },
        -8355054, 6174015, -1755316 },
      { { -314573, 333447 }, { -679477, 92275 } },
      396076515, NMPC_BAD_STATE,
      { 11743629, 6597350 },
    { 10204, 14976, 111822, 264856, 770352, 838296, 617965, 940057, -10055, 674373, 1280903, 10395753,
      23593984, -13254656, 226787385, 1049518455, -18647900, 17751998, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, 5368709, -3623879, 11743629,
      6597350 } },
    { { { 57410, -245891 }, { -1769996, 3774874 },
        1442841, -7549747, 4356833 },
      { { 122159, -278397 }, { -301990, 58720 } },
      317726917, NMPC_OK,
      { 4100917, -7492864 },
    { 12092, 3926, 113438, 66828, 802966, 157695, 522460, -1550931, 219211, 562908, 5727065, 6764983, 8239104,
      15053824, -911219207, -567979806, 6885372, -18328031, 0, 0, 0, 0, 0, 0, 260899300, 260899300, 1244700,
      304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, 1442841, -7549747, 4100917, -7492864 } },
    { { { -488899, 99090 }, { 1468006, -704643 },
        11207180, 2248147, -4210033 },
      { { -489685, 158335 }, { -553648, 478151 } },
      373628600, NMPC_OK,
      { 11744051, -11743629 },
    { -10529, 8165, -273882, 91254, -647903, 390819, -1138298, -433692, 295169, 688467, 6227620, 8037472,
      23593984, 23593984, 823046584, -689576556, -26004491, 8457413, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, 11207180, 2248147, 11744051,
      -11743629 } },
    { { { 13107, -447480 }, { -3221225, 2583691 },
        -2516582, -11475616, 1903165 },
      { { -53215, -453771 }, { -352322, 268435 } },
      295312556, NMPC_OK,
      { -11744051, 11743629 },
    { -10280, -12103, -273351, -177416, -643440, -871282, -557546, 522880, 540567, 871012, 9688087, 10425681,
      23593984, -23593984, 1041884197, -259612837, -2783433, -24455884, 0, 0, 0, 0, 0, 0, 260899300,
      260899300, 1244700, 304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, -2516582, -11475616,
      -11744051, 11743629 } },
    { { { 358089, 54788 }, { -159384, -2080375 },
        7281312, -1677722, -6663700 },
      { { 383517, -17039 }, { -780141, 503316 } },
      351180685, NMPC_OK,
      { 11744051, -11743629 },
    { 6385, -9548, 19622, -111131, 514849, -715349, 983014, -287822, 779538, 683130, 12459012, 5203041,
      -22222848, 23593984, -77043686, 1070974218, 21784409, 40611, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, 7281312, -1677722, 11744051,
      -11743629 } },
    { { { -188482, 399507 }, { 3347055, 1015022 },
        -6442451, 8086618, -551551 },
      { { -228590, 419693 }, { -763363, 109052 } },
      272864641, NMPC_OK,
      { -11744051, 9979103 },
    { -1913, 9315, -131816, 198470, 77701, 570414, 1296484, -412272, 545386, 865245, 5548215, 8026387,
      11483136, -20048896, -539102251, 928595857, -13162231, 22555924, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, -6442451, 8086618, -11744051,
      9979103 } },
    { { { 156238, -147063 }, { -1073742, -3816817 },
        3355443, -5603590, 5561647 },
      { { 208142, -192414 }, { -293601, 167772 } },
      328766325, NMPC_OK,
      { 11744051, -7964832 },
    { 5053, 1529, 5404, 25272, 535259, -112331, 1386551, -645077, 646122, 712139, 6730823, 3716318, 3846144,
      16002048, -891252258, 598824611, 13314861, -12824652, 0, 0, 0, 0, 0, 0, 260899300, 260899300, 1244700,
      304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, 3355443, -5603590, 11744051, -7964832 } },
    { { { -390070, 197919 }, { 2256536, 176161 },
        -10368319, 4160750, -3005219 },
      { { -403702, 244318 }, { -452985, -1677721600 } },
      384634454, NMPC_BAD_TARGET,
      { 1914373, -7964832 },
    { -12607, 10627, -257905, 213072, -538496, 470124, -753894, -1467535, 669470, 838901, 6156014, 5602402,
      3846144, 16002048, -292183518, -1033223256, 13314861, -12824652, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, -10368319, 4160750, 1914373,
      -7964832 } },
    { { { -45351, -348652 }, { -2348810, 3548381 },
        -570425, -9529459, 3106931 },
      { { 32768, -367788 }, { -167772, 545260 } },
      306318410, NMPC_OK,
      { 11744051, 1793578 },
    { -14793, -4982, -326290, -20024, -667473, -497733, -796975, -627943, 713871, 971325, 5695743, 7198938,
      23593984, -3603456, 190744325, -1056663668, 2676449, -21431617, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, -570425, -9529459, 11744051,
      1793578 } },
    { { { 456917, -3670 }, { 796918, -1023410 },
        9193914, 234881, -5459935 },
      { { 469500, 68944 }, { -511705, 872415 } },
      362186539, NMPC_OK,
      { 11744051, -6093782 },
    { 6719, -5123, 14097, -12300, 852779, -532850, 2880, 426138, 955941, 946395, 9262193, 5540573, -23593984,
      12242944, 945057653, 509693572, 24793046, 4919749, 0, 0, 0, 0, 0, 0, 260899300, 260899300, 1244700,
      304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, 9193914, 234881, 11744051, -6093782 } },
    { { { -89391, 498598 }, { -3992977, 2164261 },
        -4496294, 10032775, 653263 },
      { { -142344, 505676 }, { -402653, 570425 } },
      283870495, NMPC_OK,
      { -11744051, -11743629 },
    { 1519, 18347, -115581, 340852, 390921, 1056373, 627388, 632834, 718288, 1035796, 2715186, 6569509,
      23593984, 23593984, 626500753, 872019673, -8006785, 26329351, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, -4496294, 10032775, -11744051,
      -11743629 } },
    { { { 255328, -48234 }, { -1015022, -2583691 },
        5268046, -3690988, 6766461 },
      { { 294126, -106430 }, { -922747, 713032 } },
      339772178, NMPC_OK,
      { 11744051, -11743629 },
    { 12882, 15058, 79691, 271489, 1129941, 654491, 1267709, 675228, 947013, 1210642, 6875550, 9183077,
      484352, 23593984, 181462131, 1058297217, 17338201, -7138175, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, 5268046, -3690988, 11744051,
      -11743629 } },
    { { { -291242, 296747 }, { 2399142, 419430 },
        -8422162, 6073352, -1801454 },
      { { -317719, 330301 }, { -998244, 226492 } },
      395640308, NMPC_OK,
      { -11744051, 11222732 },
    { -556, 28279, -152571, 495714, 311737, 1433328, 822807, -1867685, 937862, 1384522, 5602023, 11395415,
      -23593984, -22547456, -1062129338, -157488970, -18843476, 17258091, 0, 0, 0, 0, 0, 0, 260899300,
      260899300, 1244700, 304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, -8422162, 6073352,
      -11744051, 11222732 } },
    { { { 53740, -249561 }, { -2113929, 3883926 },
        1342177, -7616856, 4311745 },
      { { 119013, -281543 }, { -620757, 192938 } },
      317324263, NMPC_OK,
      { 11744051, -6596330 },
    { 1395, 16640, -135618, 273959, 422167, 644542, 346278, -1416630, 692919, 1222149, -215649, 6184564,
      11890688, 13252608, -885961753, -606624493, 6871015, -18805360, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, 1342177, -7616856, 11744051,
      -6596330 } },
    { { { -492831, 95158 }, { 1124073, -603980 },
        11140071, 2147484, -4255121 },
      { { -493093, 154927 }, { -872415, 603980 } },
      0, NMPC_BAD_THRUST,
      { 5918451, -6596330 },
    { -21167, 20288, -508452, 277256, -956012, 776524, -908945, -131959, 808137, 1332829, 2196691, 7269638,
      11890688, 13252608, 851927971, -653559665, 6871015, -18805360, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, 11140071, 2147484, 5918451,
      -6596330 } },
    { { { 9437, -451150 }, { -3581936, 2667577 },
        -2583691, -11542725, 1857028 },
      { { -56361, -456917 }, { -679477, 385876 } },
      294876348, NMPC_OK,
      { -11744051, 11743629 },
    { -20837, -551, -490436, -12385, -882916, -579187, -428541, 710443, 935131, 1433652, 4128342, 8188133,
      17440768, -23593984, 1052295025, -213533803, -2693883, -24817479, 0, 0, 0, 0, 0, 0, 260899300,
      260899300, 1244700, 304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, -2583691, -11542725,
      -11744051, 11743629 } },
    { { { 354157, 51118 }, { -520094, -1988100 },
        7214203, -1778385, -6709838 },
      { { 380109, -20185 }, { -1115685, 620757 } },
      350778032, NMPC_OK,
      { 11744051, -11743629 },
    { -4096, 1444, -181800, 33477, 338245, -509117, 1091755, -217957, 1112424, 1244746, 6781011, 3308997,
      -22170624, 23593984, -124077449, 1066548776, 21673232, -661004, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, 7214203, -1778385, 11744051,
      -11743629 } },
    { { { -192152, 395837 }, { 2986344, 1107296 },
        -6509560, 8019509, -596640 },
      { { -231735, 416285 }, { -1098908, 226492 } },
      272461988, NMPC_OK,
      { -11744051, 8992864 },
    { -12300, 19760, -319988, 326214, -39732, 697983, 1204987, -376022, 878786, 1426636, 1012033, 6423113,
      8686592, -18067456, -578521445, 904563121, -13291503, 22235628, 0, 0, 0, 0, 0, 0, 260899300, 260899300,
      1244700, 304895, 213426, 41943040, 201326592, 11744051, 23041, 23041, -6509560, 8019509, -11744051,
      8992864 } }
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
