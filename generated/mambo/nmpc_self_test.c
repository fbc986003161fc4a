/* SPDX-License-Identifier: MIT-0
 *
 * Self-test: 24 consecutive control steps with the results of the reference, and 100000 control steps with
 * pseudo-random inputs, of whose results there is a digest.
 * MISRA C:2012: departs from rules 2.3, 8.9, 11.5 and 19.2, for the reasons in deviations.txt.
 */
#include "nmpc_self_test.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0xF8CA429DUL)
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
    { { { 1.1755e-40f, 0.0f }, { 0.0f, 0.0f },
        0.0f, 0.0f, 0.0f },
      { { 0.0f, 0.0f }, { 0.0f, 0.0f } },
      9.81f, NMPC_OK,
      { 0.0f, 1.857e-41f },
    { 1.1755e-40f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, -0.0f, 0.0f, -1.8e-44f, 0.0f,
      1.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 1.857e-41f } },
    { { { -1.474f, 0.769f }, { 0.307f, 0.005f },
        -0.306f, 0.126f, -2.823f },
      { { -1.528f, 0.944f }, { -0.019f, 0.061f } },
      11.476f, NMPC_OK,
      { -0.35f, -0.35f },
    { -0.06562707f, 0.03544571f, -0.0019078979f, 0.0014301338f, -1.5026496e-05f, 8.714896e-06f, 0.0f, -0.0f,
      0.0f, 0.0f, 0.0f, -3e-45f, -0.00034335f, 0.00034335f, -0.3132304f, -0.94967717f, -0.019f, 0.061f,
      -9.4999996e-05f, 0.0f, -3.1666666e-05f, 0.0f, -0.306f, 0.126f, -0.35f, -0.35f } },
    { { { -0.158f, -1.315f }, { -0.241f, 0.408f },
        -0.015f, -0.282f, 3.007f },
      { { 0.138f, -1.39f }, { 0.016f, 0.047f } },
      9.141f, NMPC_OK,
      { 0.35f, 0.35f },
    { -0.07222846f, -0.023333637f, -0.0023563763f, -0.0002895163f, -1.6336284e-05f, -5.138333e-06f,
      -6.42299e-07f, 2.3202945e-06f, -3.428059e-06f, 2.6390626e-06f, -6.841681e-05f, 5.27105e-05f,
      0.00034335f, -0.00034335f, 0.13418669f, -0.99095607f, 0.016f, 0.047f, 0.00011166666f, -7.000001e-05f,
      4.7777783e-05f, -2.3333338e-05f, -0.015f, -0.282f, 0.35f, 0.35f } },
    { { { 1.757f, 0.001f }, { 0.135f, -0.137f },
        0.277f, 0.009f, -5.163f },
      { { 1.803f, 0.276f }, { -0.024f, 0.086f } },
      10.807f, NMPC_OK,
      { 0.35f, -0.35f },
    { 0.011471249f, -0.023134917f, 0.00022662195f, -0.0002137708f, 6.2953895e-06f, -5.4360958e-06f,
      3.9586425e-06f, 5.732742e-07f, 2.0681455e-08f, -3.0174306e-08f, 1.36329145e-05f, -8.092025e-06f,
      0.00034335f, 0.00034335f, 0.9001811f, 0.43551573f, -0.024f, 0.086f, -0.00012027777f, 0.00014833335f,
      -4.546296e-05f, 5.15025e-05f, 0.277f, 0.009f, 0.35f, -0.35f } },
    { { { -0.327f, 1.915f }, { -0.436f, 0.243f },
        -0.132f, 0.301f, 0.666f },
      { { -0.531f, 1.941f }, { -0.011f, 0.05f } },
      8.473f, NMPC_OK,
      { -0.35f, 0.16719145f },
    { -0.00677781f, 0.06701796f, -0.00067935674f, 0.0024355967f, 4.0181476e-08f, 1.7862822e-05f,
      6.1260466e-06f, -9.078226e-07f, 3.4072852e-06f, 2.606496e-06f, 7.933319e-05f, 4.586075e-05f,
      2.9200455e-06f, -0.00016401481f, 0.6178458f, 0.78629935f, -0.011f, 0.05f, -1.7870363e-05f,
      -8.008208e-05f, 3.8271646e-06f, -4.180348e-05f, -0.132f, 0.301f, -0.35f, 0.16719145f } },
    { { { 0.988f, -0.169f }, { -0.081f, -0.322f },
        0.16f, -0.108f, 6.496f },
      { { 1.135f, -0.393f }, { -0.073f, 0.068f } },
      10.138f, NMPC_OK,
      { 0.35f, -0.101114996f },
    { 0.038098477f, 0.055170797f, 0.00081101945f, 0.0019507398f, 1.1210236e-05f, 1.219857e-05f,
      8.6169375e-06f, -2.9679418e-06f, 3.35993e-06f, 1.3413272e-06f, 6.410691e-05f, 1.3641014e-05f,
      -0.00012976155f, 9.9193814e-05f, 0.21121176f, 0.97744036f, -0.073f, 0.068f, -1.7870363e-05f,
      2.9057235e-05f, 0.0f, 8.510786e-06f, 0.16f, -0.108f, 0.35f, -0.101114996f } },
    { { { 2000.0f, 1.146f }, { 0.327f, 0.037f },
        -0.249f, 0.184f, -1.674f },
      { { -1.2f, 1.272f }, { -0.081f, 0.011f } },
      11.804f, NMPC_BAD_STATE,
      { 0.35f, 0.35f },
    { 0.03891307f, 0.057131838f, 0.00081817055f, 0.0019713407f, 1.1210236e-05f, 1.219857e-05f, 1.0232838e-05f,
      -1.38569e-06f, 1.9665315e-06f, 2.1223773e-06f, 2.5476176e-05f, 2.6774933e-05f, 0.00034335f,
      -0.00034335f, 0.21121176f, 0.97744036f, -0.081f, 0.011f, -4.8935188e-05f, 2.9057235e-05f,
      -1.0354942e-05f, 0.0f, 0.16f, -0.108f, 0.35f, 0.35f } },
    { { { 0.219f, -0.938f }, { -0.211f, 0.45f },
        0.043f, -0.225f, 4.155f },
      { { 0.466f, -1.062f }, { -0.036f, 0.007f } },
      9.469f, NMPC_OK,
      { 0.35f, 0.118439086f },
    { 0.046108797f, 0.014976544f, 0.0008311305f, 0.00049602706f, 1.1692888e-05f, 2.295542e-06f,
      -9.683789e-06f, -7.942344e-06f, 5.288947e-06f, -5.1309576e-07f, 8.881654e-05f, -3.0046009e-05f,
      0.00034335f, -0.00011618874f, -0.84863925f, -0.528972f, -0.036f, 0.007f, 0.00019535495f, -5.47138e-06f,
      5.15025e-05f, -1.1509539e-05f, 0.043f, -0.225f, 0.35f, 0.118439086f } },
    { { { -1.865f, 0.378f }, { 0.175f, -0.084f },
        0.334f, 0.067f, -4.015f },
      { { -1.868f, 0.604f }, { -0.066f, 0.057f } },
      11.135f, NMPC_OK,
      { 0.35f, -0.35f },
    { -0.040189367f, 0.031143988f, -0.002053743f, 0.0006781375f, -9.412366e-06f, 5.688953e-06f,
      -8.072377e-06f, 6.9172356e-06f, 8.792884e-06f, -1.3398521e-06f, 0.00013953554f, -4.327049e-05f,
      -9.009719e-05f, 0.00034335f, 0.7665216f, -0.6422186f, -0.066f, 0.057f, -2.6571288e-05f, 0.00024150955f,
      -3.9640418e-05f, 5.15025e-05f, 0.334f, 0.067f, 0.35f, -0.35f } },
    { { { 0.05f, -1.707f }, { -0.384f, 0.308f },
        -0.075f, -0.342f, 1.815f },
      { { -0.203f, -1.731f }, { -0.042f, 0.032f } },
      8.801f, NMPC_OK,
      { -0.35f, 0.35f },
    { -0.03924171f, -0.04617167f, -0.002048937f, -0.0013234961f, -9.340153e-06f, -1.2676057e-05f,
      2.897466e-07f, 6.196553e-06f, 7.942563e-06f, 1.2580053e-06f, 9.377832e-05f, 1.608282e-05f,
      8.877244e-05f, -0.00034335f, 0.9703302f, -0.24178375f, -0.042f, 0.032f, 8.689414e-05f, 2.1506028e-05f,
      1.1394866e-05f, -3.8999515e-05f, -0.075f, -0.342f, -0.35f, 0.35f } },
    { { { 1.366f, 0.209f }, { -0.019f, -0.248f },
        0.217f, -0.05f, -6.355f },
      { { 1.463f, -0.065f }, { -0.093f, 0.06f } },
      10.466f, NMPC_OK,
      { 0.35f, 0.35f },
    { 0.024326185f, -0.036426958f, 0.00013468746f, -0.00082952937f, 7.5219896e-06f, -1.0406035e-05f,
      3.3319066e-06f, -5.9309928e-06f, 8.805585e-06f, -1.4312949e-06f, 9.278083e-05f, -3.9096685e-05f,
      2.7970556e-05f, -0.00034335f, -0.071752995f, 0.99742246f, -0.093f, 0.06f, -0.00020585553f,
      0.00013125324f, -5.15025e-05f, 1.0582731e-05f, 0.217f, -0.05f, 0.35f, 0.35f } },
    { { { -0.719f, 1.524f }, { 0.399f, 0.121f },
        -0.192f, 0.241f, -0.526f },
      { { -0.872f, 1.601f }, { -0.091f, 0.013f } },
      8.132f, NMPC_OK,
      { -0.35f, 0.35f },
    { -0.007334046f, 0.035532832f, -0.0009928418f, 0.0014772824f, 1.1671068e-06f, 8.305156e-06f,
      2.2357976e-06f, -1.19008755e-05f, 9.031788e-06f, -4.0167265e-06f, 7.9866564e-05f, -8.5805135e-05f,
      -0.00034335f, -0.00034335f, -0.5020781f, 0.86482227f, -0.091f, 0.013f, -0.00011867899f, -0.000164082f,
      -5.276157e-06f, -5.15025e-05f, -0.192f, 0.241f, -0.35f, 0.35f } },
    { { { 0.596f, -0.561f }, { -0.128f, -0.455f },
        0.1f, -0.167f, 5.304f },
      { { 0.794f, -0.734f }, { -0.035f, 0.02f } },
      9.798f, NMPC_OK,
      { 0.35f, -0.231168f },
    { 0.019237628f, 0.0058337967f, 3.0261726e-05f, 0.00018695035f, 7.831554e-06f, -1.6293061e-06f,
      -4.3819227e-06f, -1.8077651e-05f, 5.5639184e-06f, -6.5461804e-06f, -4.464666e-06f, -0.00012534298f,
      -0.00034335f, 0.00022677581f, -0.8300433f, 0.55769885f, -0.035f, 0.02f, -0.00011867899f, -7.279225e-05f,
      0.0f, -3.905083e-06f, 0.1f, -0.167f, 0.35f, -0.231168f } },
    { { { -1.488f, 0.755f }, { 0.269f, 0.021f },
        -0.309f, 0.124f, -2.866f },
      { { -1.54f, 0.932f }, { -0.054f, -200.0f } },
      11.463f, NMPC_BAD_TARGET,
      { 0.35f, -0.231168f },
    { -0.048131537f, 0.040539898f, -0.0019308421f, 0.0015862553f, -7.787924e-06f, 6.8472164e-06f,
      -2.04706e-05f, 1.2712875e-05f, 2.1783778e-06f, -4.637679e-06f, -7.199184e-05f, -7.128631e-05f,
      0.0003222538f, 0.00025586906f, -0.27211735f, -0.9622641f, -0.035f, 0.02f, -0.00011867899f,
      -7.279225e-05f, 0.0f, -3.905083e-06f, -0.309f, 0.124f, 0.35f, -0.231168f } },
    { { { -0.173f, -1.33f }, { -0.28f, 0.423f },
        -0.017f, -0.284f, 2.963f },
      { { 0.125f, -1.403f }, { -0.02f, 0.065f } },
      9.129f, NMPC_OK,
      { 0.35f, 0.35f },
    { -0.056472417f, -0.019002218f, -0.002439688f, -0.0001503633f, -9.659408e-06f, -7.2362864e-06f,
      -1.47692435e-05f, 1.7047812e-05f, 5.6099643e-06f, -2.7480967e-06f, 6.56657e-06f, -2.1061984e-05f,
      -0.00034335f, -0.00034335f, 0.17764473f, -0.98409474f, -0.02f, 0.065f, 1.566051e-05f, 0.0001866513f,
      4.4779834e-05f, 5.15025e-05f, -0.017f, -0.284f, 0.35f, 0.35f } },
    { { { 1.743f, -0.014f }, { 0.095f, -0.122f },
        0.274f, 0.007f, -5.207f },
      { { 1.791f, 0.263f }, { -0.061f, 0.104f } },
      10.794f, NMPC_OK,
      { 0.35f, -0.35f },
    { 0.025588293f, -0.019539226f, 9.702706e-05f, -9.2745104e-05f, 1.246822e-05f, -7.746712e-06f,
      1.6880125e-05f, 1.0516849e-05f, 2.3238556e-06f, -5.5086684e-06f, -6.315872e-05f, -7.0539085e-05f,
      0.00034335f, 0.00034335f, 0.8801535f, 0.47468913f, -0.061f, 0.104f, -0.00017477984f, 0.00031407693f,
      -3.362689e-05f, 5.15025e-05f, 0.274f, 0.007f, 0.35f, -0.35f } },
    { { { -0.341f, 1.902f }, { -0.476f, 0.258f },
        -0.134f, 0.299f, 0.623f },
      { { -0.543f, 1.929f }, { -0.048f, 0.068f } },
      8.46f, NMPC_OK,
      { -0.35f, -0.098178186f },
    { 0.005748984f, 0.06999412f, -0.0008685468f, 0.002538508f, 5.7520133e-06f, 1.538006e-05f, 1.7050095e-05f,
      -2.6072485e-07f, 5.598802e-06f, -2.9302691e-06f, 1.7843267e-05f, -6.9995476e-06f, -0.00034335f,
      9.6312804e-05f, 0.5834742f, 0.81213164f, -0.048f, 0.068f, -3.920336e-05f, 2.7897186e-06f,
      2.2774231e-05f, -5.15025e-05f, -0.134f, 0.299f, -0.35f, -0.098178186f } },
    { { { 0.974f, -0.184f }, { -0.121f, -0.308f },
        0.157f, -0.11f, 6.453f },
      { { 1.122f, -0.406f }, { -0.11f, 0.085f } },
      10.126f, NMPC_OK,
      { 0.35f, -0.3259528f },
    { 0.049095247f, 0.057445f, 0.0005869226f, 0.0020217677f, 1.6510623e-05f, 9.532366e-06f, 1.3923435e-05f,
      -7.1444633e-06f, 1.9990987e-06f, -2.1856774e-06f, -5.412904e-05f, 8.860787e-06f, -0.00034335f,
      0.0003197597f, 0.16899978f, 0.9856161f, -0.11f, 0.085f, -3.920336e-05f, 6.0643593e-05f, 0.0f,
      -1.5050373e-05f, 0.157f, -0.11f, 0.35f, -0.3259528f } },
    { { { -1.111f, 1.132f }, { 0.286f, 0.05f },
        -0.251f, 0.181f, -1.718f },
      { { -1.212f, 1.26f }, { -0.119f, 0.027f } },
      11.791f, NMPC_OK,
      { -0.35f, -0.0020963731f },
    { -0.0021688577f, 0.10787856f, -0.0011430187f, 0.0036924386f, 4.6083223e-06f, 2.0866424e-05f,
      -7.4478494e-06f, -7.824697e-06f, -1.5548674e-06f, 3.2382945e-07f, -0.00011175996f, 5.658945e-05f,
      -0.00034335f, 2.0565421e-06f, -0.9891851f, -0.14667268f, -0.119f, 0.027f, -6.46017e-05f, 6.0643593e-05f,
      -8.4661115e-06f, 0.0f, -0.251f, 0.181f, -0.35f, -0.0020963731f } },
    { { { 0.205f, -0.952f }, { -0.252f, 0.463f },
        0.04f, -0.227f, 4.112f },
      { { 0.454f, -1.074f }, { -0.074f, 0.023f } },
      9.457f, NMPC_OK,
      { 0.35f, -0.019321011f },
    { 0.005274503f, 0.06348053f, -0.0010161897f, 0.0020402994f, 6.219134e-06f, 9.388534e-06f,
      -1.34942875e-05f, 2.0938337e-06f, -4.88744e-06f, 3.8478115e-07f, -0.0001579072f, 4.8217655e-05f,
      0.00034335f, 1.8953913e-05f, -0.82511586f, -0.56496346f, -0.074f, 0.023f, 0.0001884661f,
      1.03217935e-05f, 5.15025e-05f, -1.6773934e-05f, 0.04f, -0.227f, 0.35f, -0.019321011f } },
    { { { -1.88f, 0.363f }, { 0.134f, -0.072f },
        0.332f, 0.064f, -4.058f },
      { { -1.881f, 0.591f }, { -0.104f, 0.072f } },
      0.0f, NMPC_BAD_THRUST,
      { 0.35f, -0.019321011f },
    { -0.08078988f, 0.07739417f, -0.003793522f, 0.0020649228f, -1.383241e-05f, 1.13095475e-05f,
      1.0088239e-05f, 1.5166621e-05f, -1.2947901e-06f, 5.0359336e-07f, -5.802539e-05f, 4.3725136e-05f,
      -8.8692585e-05f, -0.000332238f, 0.7934201f, -0.6086745f, -0.074f, 0.023f, 0.0001884661f,
      1.03217935e-05f, 5.15025e-05f, -1.6773934e-05f, 0.332f, 0.064f, 0.35f, -0.019321011f } },
    { { { 0.036f, -1.721f }, { -0.427f, 0.318f },
        -0.077f, -0.344f, 1.771f },
      { { -0.215f, -1.743f }, { -0.081f, 0.046f } },
      8.788f, NMPC_OK,
      { -0.35f, 0.23650494f },
    { -0.079531595f, -0.0021029375f, -0.0036588248f, -9.301657e-05f, -1.2765432e-05f, -8.418226e-06f,
      1.28626025e-05f, 1.0439504e-05f, -2.2671752e-06f, -2.173375e-06f, -6.413621e-05f, -1.3992074e-05f,
      -0.00020242711f, -0.00023201136f, 0.9800261f, -0.19886898f, -0.081f, 0.046f, 8.4984305e-05f,
      0.00011177392f, -1.5893602e-07f, 2.2634755e-05f, -0.077f, -0.344f, -0.35f, 0.23650494f } },
    { { { 1.351f, 0.195f }, { -0.062f, -0.237f },
        0.215f, -0.053f, -6.399f },
      { { 1.45f, -0.077f }, { -0.133f, 0.074f } },
      10.454f, NMPC_OK,
      { 0.35f, -0.35f },
    { -0.015666973f, 0.0055041774f, -0.001358876f, 0.00024873903f, 5.007819e-06f, -7.398172e-06f,
      4.492957e-06f, -1.0761332e-05f, -4.400815e-06f, -4.030694e-06f, -9.169242e-05f, -4.7462017e-05f,
      0.00034335f, 0.00034335f, -0.11555613f, 0.993301f, -0.133f, 0.074f, 8.4984305e-05f, 0.00020720434f,
      0.0f, 4.689998e-05f, 0.215f, -0.053f, 0.35f, -0.35f } },
    { { { -0.733f, 1.51f }, { 0.356f, 0.132f },
        -0.194f, 0.239f, -0.569f },
      { { -0.884f, 1.588f }, { -0.131f, 0.027f } },
      8.12f, NMPC_OK,
      { -0.35f, -0.060859572f },
    { -0.046961125f, 0.07537512f, -0.002388042f, 0.0024298623f, -4.8966194e-07f, 1.016788e-05f,
      -2.948601e-06f, -1.1106759e-05f, -9.974685e-07f, -1.2993933e-06f, -5.0047383e-06f, 1.2534769e-05f,
      -0.00034335f, 5.970324e-05f, -0.53878987f, 0.8424401f, -0.131f, 0.027f, 5.249217e-05f, -0.000107947824f,
      -1.0830712e-05f, -5.15025e-05f, -0.194f, 0.239f, -0.35f, -0.060859572f } }
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

            results = fold_results(results, scratch, status);
            target.velocity_m_s[0] = target.velocity_m_s[0] + change_m_s[0];
            target.velocity_m_s[1] = target.velocity_m_s[1] + change_m_s[1];
        }
    }
    nmpc_init(scratch);
    return fold(digest, results);
}
