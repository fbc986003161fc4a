/* SPDX-License-Identifier: MIT-0
 *
 * Self-test: 24 consecutive control steps with the results of the reference, and 100000 control steps with
 * pseudo-random inputs, of whose results there is a digest.
 * MISRA C:2012: departs from rules 2.3, 8.9, 11.5 and 19.2, for the reasons in deviations.txt.
 */
#include "nmpc_self_test.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x663AE989UL)
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
      1.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f,
      6.0f, 0.35f, 0.00034335f, 0.00034335f, 0.0f, 0.0f, 0.0f, 1.857e-41f } },
    { { { -1.474f, 0.769f }, { 0.307f, 0.005f },
        -0.306f, 0.126f, -2.823f },
      { { -1.528f, 0.944f }, { -0.019f, 0.061f } },
      11.476f, NMPC_OK,
      { -0.35f, -0.28749388f },
    { -0.06562707f, 0.03544571f, -0.0019078979f, 0.0014301338f, -1.5026496e-05f, 8.714896e-06f, 0.0f, -0.0f,
      0.0f, 0.0f, 0.0f, -3e-45f, -0.00034335f, 0.0002820315f, -0.3132304f, -0.94967717f, -2.2427692f,
      1.4427156f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f,
      0.35f, 0.00034335f, 0.00034335f, -0.306f, 0.126f, -0.35f, -0.28749388f } },
    { { { -0.158f, -1.315f }, { -0.241f, 0.408f },
        -0.015f, -0.282f, 3.007f },
      { { 0.138f, -1.39f }, { 0.016f, 0.047f } },
      9.141f, NMPC_OK,
      { 0.35f, -0.133597f },
    { -0.07222846f, -0.023333637f, -0.0023563763f, -0.0002895163f, -1.6336284e-05f, -5.138333e-06f,
      -7.8342424e-07f, 2.0305038e-06f, -3.428059e-06f, 2.1677554e-06f, -6.841681e-05f, 4.329699e-05f,
      0.00031295343f, 0.00013105867f, 0.13418669f, -0.99095607f, 0.34583923f, -2.1205456f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f,
      0.00034335f, -0.015f, -0.282f, 0.35f, -0.133597f } },
    { { { 1.757f, 0.001f }, { 0.135f, -0.137f },
        0.277f, 0.009f, -5.163f },
      { { 1.803f, 0.276f }, { -0.024f, 0.086f } },
      10.807f, NMPC_OK,
      { 0.35f, -0.10216917f },
    { 0.011471249f, -0.023134917f, 0.00022662195f, -0.0002137708f, 6.2953895e-06f, -5.4360958e-06f,
      5.610894e-06f, 3.2356445e-07f, -2.8142176e-07f, 3.1493864e-06f, 7.5760217e-06f, 5.677001e-05f,
      -0.00034335f, 0.00010022796f, 0.9001811f, 0.43551573f, 2.6611354f, 0.5338559f, 0.0f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f, 0.00034335f,
      0.277f, 0.009f, 0.35f, -0.10216917f } },
    { { { -0.327f, 1.915f }, { -0.436f, 0.243f },
        -0.132f, 0.301f, 0.666f },
      { { -0.531f, 1.941f }, { -0.011f, 0.05f } },
      8.473f, NMPC_OK,
      { -0.35f, -0.30019534f },
    { -0.00677781f, 0.06701796f, -0.00067935674f, 0.0024355967f, 4.0181476e-08f, 1.7862822e-05f,
      5.5353617e-06f, 2.096399e-06f, -3.7658292e-06f, 3.903401e-06f, -6.235041e-05f, 6.344161e-05f,
      0.00034335f, 0.00029449162f, 0.6178458f, 0.78629935f, -0.7823719f, 2.8080952f, 0.0f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f, 0.00034335f,
      -0.132f, 0.301f, -0.35f, -0.30019534f } },
    { { { 0.988f, -0.169f }, { -0.081f, -0.322f },
        0.16f, -0.108f, 6.496f },
      { { 1.135f, -0.393f }, { -0.073f, 0.068f } },
      10.138f, NMPC_OK,
      { 0.35f, -0.31171134f },
    { 0.038098477f, 0.055170797f, 0.00081101945f, 0.0019507398f, 1.1210236e-05f, 1.219857e-05f,
      7.1677505e-06f, 4.7712524e-06f, -3.7866948e-07f, 6.135616e-06f, 1.8490508e-05f, 9.891201e-05f,
      6.625624e-05f, 0.00030578882f, 0.21121176f, 0.97744036f, 1.6896037f, -0.64867467f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f,
      0.00034335f, 0.16f, -0.108f, 0.35f, -0.31171134f } },
    { { { 2000.0f, 1.146f }, { 0.327f, 0.037f },
        -0.249f, 0.184f, -1.674f },
      { { -1.2f, 1.272f }, { -0.081f, 0.011f } },
      11.804f, NMPC_BAD_STATE,
      { 0.35f, 0.16327366f },
    { 0.038919955f, 0.05713211f, 0.0008319376f, 0.0019718853f, 1.1210236e-05f, 1.219857e-05f, 7.85744e-06f,
      1.2185774e-05f, 2.0910863e-07f, 8.425941e-06f, 2.8008431e-05f, 0.00013067138f, 0.00034335f,
      -0.00016017146f, 0.21121176f, 0.97744036f, -1.9580381f, 1.8557924f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f,
      995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f, 0.00034335f, 0.16f, -0.108f,
      0.35f, 0.16327366f } },
    { { { 0.219f, -0.938f }, { -0.211f, 0.45f },
        0.043f, -0.225f, 4.155f },
      { { 0.466f, -1.062f }, { -0.036f, 0.007f } },
      9.469f, NMPC_OK,
      { -0.063792884f, -0.07274542f },
    { 0.04612046f, 0.014977003f, 0.00084405503f, 0.0004965382f, 1.1685513e-05f, 2.295249e-06f, 6.300689e-06f,
      -2.031069e-05f, 3.554657e-06f, 7.0715837e-06f, 9.084421e-05f, 8.60217e-05f, -6.258082e-05f,
      7.1363254e-05f, -0.84863925f, -0.528972f, -0.036f, 0.007f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f,
      995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f, 0.00034335f, 0.043f,
      -0.225f, -0.063792884f, -0.07274542f } },
    { { { -1.865f, 0.378f }, { 0.175f, -0.084f },
        0.334f, 0.067f, -4.015f },
      { { -1.868f, 0.604f }, { -0.066f, 0.057f } },
      11.135f, NMPC_OK,
      { 0.35f, -0.35f },
    { -0.040173456f, 0.031144615f, -0.0020416242f, 0.0006786167f, -9.4267225e-06f, 5.6883837e-06f,
      -1.5484495e-05f, -4.7791414e-06f, 2.8492964e-06f, 7.749787e-06f, 6.0272338e-05f, 8.377136e-05f,
      0.00034133173f, 0.00034335f, 0.7665216f, -0.6422186f, -2.7676308f, 0.9040088f, 0.0f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f, 0.00034335f,
      0.334f, 0.067f, 0.35f, -0.35f } },
    { { { 0.05f, -1.707f }, { -0.384f, 0.308f },
        -0.075f, -0.342f, 1.815f },
      { { -0.203f, -1.731f }, { -0.042f, 0.032f } },
      8.801f, NMPC_OK,
      { -0.35f, 0.35f },
    { -0.039222047f, -0.046170887f, -0.002037588f, -0.0013230474f, -9.361113e-06f, -1.2676888e-05f,
      -8.562498e-06f, 7.129709e-06f, 6.396075e-06f, 1.0403105e-05f, 0.00011627696f, 0.00012362143f,
      0.00034335f, -0.00034335f, 0.9703302f, -0.24178375f, -0.2948592f, -2.539676f, 0.0f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f, 0.00034335f,
      -0.075f, -0.342f, -0.35f, 0.35f } },
    { { { 1.366f, 0.209f }, { -0.019f, -0.248f },
        0.217f, -0.05f, -6.355f },
      { { 1.463f, -0.065f }, { -0.093f, 0.06f } },
      10.466f, NMPC_OK,
      { 0.35f, -0.30282792f },
    { 0.024349138f, -0.036426045f, 0.00014530073f, -0.0008291098f, 7.494792e-06f, -1.0407113e-05f,
      1.2643098e-05f, -2.1363064e-06f, 9.8833225e-06f, 7.679619e-06f, 0.00016152412f, 5.193278e-05f,
      -0.00032638197f, 0.0002970742f, -0.071752995f, 0.99742246f, 2.1748126f, 0.013497204f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f,
      0.00034335f, 0.217f, -0.05f, 0.35f, -0.30282792f } },
    { { { -0.719f, 1.524f }, { 0.399f, 0.121f },
        -0.192f, 0.241f, -0.526f },
      { { -0.872f, 1.601f }, { -0.091f, 0.013f } },
      8.132f, NMPC_OK,
      { -0.35f, 0.23609528f },
    { -0.0073082307f, 0.035533864f, -0.0009829305f, 0.0014776742f, 1.1340244e-06f, 8.303847e-06f,
      1.6761984e-05f, -4.792395e-06f, 6.466573e-06f, 9.964939e-06f, 6.430268e-05f, 8.956647e-05f,
      0.00010420316f, -0.00023160948f, -0.5020781f, 0.86482227f, -1.3930019f, 2.3701653f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f,
      0.00034335f, -0.192f, 0.241f, -0.35f, 0.23609528f } },
    { { { 0.596f, -0.561f }, { -0.128f, -0.455f },
        0.1f, -0.167f, 5.304f },
      { { 0.794f, -0.734f }, { -0.035f, 0.02f } },
      9.798f, NMPC_OK,
      { 0.35f, -0.070131674f },
    { 0.019265914f, 0.005834927f, 3.9503502e-05f, 0.00018731575f, 7.792927e-06f, -1.630835e-06f,
      1.7355494e-05f, -8.339768e-06f, 7.328679e-06f, 8.197187e-06f, 7.225335e-05f, 4.0260093e-05f,
      2.0242525e-05f, 6.879917e-05f, -0.8300433f, 0.55769885f, -0.035f, 0.02f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f,
      0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f, 0.00034335f, 0.1f,
      -0.167f, 0.35f, -0.070131674f } },
    { { { -1.488f, 0.755f }, { 0.269f, 0.021f },
        -0.309f, 0.124f, -2.866f },
      { { -1.54f, 0.932f }, { -0.054f, -200.0f } },
      11.463f, NMPC_BAD_TARGET,
      { 0.020634582f, -0.070131674f },
    { -0.048101146f, 0.040541116f, -0.0019222384f, 0.0015865954f, -7.831768e-06f, 6.845481e-06f,
      -1.0524296e-05f, -1.7362212e-05f, 7.3449246e-06f, 8.776752e-06f, 6.1889536e-05f, 4.464136e-05f,
      2.0242525e-05f, 6.879917e-05f, -0.27211735f, -0.9622641f, -0.035f, 0.02f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f,
      0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f, 0.00034335f, -0.309f,
      0.124f, 0.020634582f, -0.070131674f } },
    { { { -0.173f, -1.33f }, { -0.28f, 0.423f },
        -0.017f, -0.284f, 2.963f },
      { { 0.125f, -1.403f }, { -0.02f, 0.065f } },
      9.129f, NMPC_OK,
      { 0.35f, 0.096615605f },
    { -0.05644026f, -0.019000933f, -0.002431692f, -0.00015004727f, -9.708155e-06f, -7.2382163e-06f,
      -1.21705925e-05f, -8.269072e-06f, 7.636034e-06f, 9.422415e-06f, 5.3590844e-05f, 4.8350026e-05f,
      0.00034335f, -9.477991e-05f, 0.17764473f, -0.98409474f, 0.26369378f, -2.1269429f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f,
      0.00034335f, -0.017f, -0.284f, 0.35f, 0.096615605f } },
    { { { 1.743f, -0.014f }, { 0.095f, -0.122f },
        0.274f, 0.007f, -5.207f },
      { { 1.791f, 0.263f }, { -0.061f, 0.104f } },
      10.794f, NMPC_OK,
      { 0.35f, -0.1390173f },
    { 0.025621906f, -0.019537883f, 0.00010444442f, -9.245197e-05f, 1.2414871e-05f, -7.748824e-06f,
      -2.2256493e-06f, 8.817589e-06f, 1.1170795e-05f, 8.741963e-06f, 0.000111329005f, 2.6376965e-05f,
      -0.00034335f, 0.00013637597f, 0.8801535f, 0.47468913f, 2.5957677f, 0.52892196f, 0.0f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f, 0.00034335f,
      0.274f, 0.007f, 0.35f, -0.1390173f } },
    { { { -0.341f, 1.902f }, { -0.476f, 0.258f },
        -0.134f, 0.299f, 0.623f },
      { { -0.543f, 1.929f }, { -0.048f, 0.068f } },
      8.46f, NMPC_OK,
      { -0.35f, -0.31207034f },
    { 0.005783777f, 0.069995515f, -0.00086167944f, 0.0025387793f, 5.6943527e-06f, 1.5377776e-05f,
      5.7341163e-06f, 9.502176e-06f, 7.739833e-06f, 9.716113e-06f, 2.0728483e-05f, 4.3263823e-05f,
      0.00034335f, 0.000306141f, 0.5834742f, 0.81213164f, -0.856626f, 2.8072424f, 0.0f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f, 0.00034335f,
      -0.134f, 0.299f, -0.35f, -0.31207034f } },
    { { { 0.974f, -0.184f }, { -0.121f, -0.308f },
        0.157f, -0.11f, 6.453f },
      { { 1.122f, -0.406f }, { -0.11f, 0.085f } },
      10.126f, NMPC_OK,
      { 0.35f, -0.3087234f },
    { 0.04913096f, 0.057446428f, 0.00059326703f, 0.0020220182f, 1.644893e-05f, 9.529924e-06f, 1.333949e-05f,
      8.659206e-06f, 1.1105918e-05f, 1.19858505e-05f, 8.501488e-05f, 8.362028e-05f, 7.409768e-05f,
      0.00030285766f, 0.16899978f, 0.9856161f, 1.6139252f, -0.65620035f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f,
      995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f, 0.00034335f, 0.157f, -0.11f,
      0.35f, -0.3087234f } },
    { { { -1.111f, 1.132f }, { 0.286f, 0.05f },
        -0.251f, 0.181f, -1.718f },
      { { -1.212f, 1.26f }, { -0.119f, 0.027f } },
      11.791f, NMPC_OK,
      { -0.35f, 0.30226216f },
    { -0.0021324577f, 0.10788001f, -0.0011371709f, 0.003692669f, 4.5428633e-06f, 2.0863834e-05f,
      9.288566e-06f, -2.0755848e-05f, 1.169577e-05f, 1.42267145e-05f, 8.283949e-05f, 0.000117277224f,
      -0.00030196644f, -0.00029651917f, -0.9891851f, -0.14667268f, -1.9709827f, 1.7945566f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f,
      0.00034335f, -0.251f, 0.181f, -0.35f, 0.30226216f } },
    { { { 0.205f, -0.952f }, { -0.252f, 0.463f },
        0.04f, -0.227f, 4.112f },
      { { 0.454f, -1.074f }, { -0.074f, 0.023f } },
      9.457f, NMPC_OK,
      { 0.35f, -0.13820413f },
    { 0.0053113676f, 0.06348201f, -0.0010108133f, 0.0020405115f, 6.150164e-06f, 9.385806e-06f, 4.18604e-06f,
      -1.6859882e-05f, 8.570879e-06f, 1.2071552e-05f, 6.1620594e-06f, 5.3751915e-05f, 9.929949e-05f,
      0.00013557824f, -0.82511586f, -0.56496346f, 0.64426184f, -1.7983862f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f,
      0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f, 0.00034335f, 0.04f,
      -0.227f, 0.35f, -0.13820413f } },
    { { { -1.88f, 0.363f }, { 0.134f, -0.072f },
        0.332f, 0.064f, -4.058f },
      { { -1.881f, 0.591f }, { -0.104f, 0.072f } },
      0.0f, NMPC_BAD_THRUST,
      { 0.10122272f, -0.13820413f },
    { -0.080752745f, 0.077395655f, -0.0037885925f, 0.0020651175f, -1.3904645e-05f, 1.1306691e-05f,
      -1.2233998e-05f, -1.3311603e-06f, 9.5181895e-06f, 1.32238e-05f, 2.4720866e-05f, 6.6313754e-05f,
      9.929949e-05f, 0.00013557824f, 0.7934201f, -0.6086745f, 0.64426184f, -1.7983862f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f,
      0.00034335f, 0.332f, 0.064f, 0.10122272f, -0.13820413f } },
    { { { 0.036f, -1.721f }, { -0.427f, 0.318f },
        -0.077f, -0.344f, 1.771f },
      { { -0.215f, -1.743f }, { -0.081f, 0.046f } },
      8.788f, NMPC_OK,
      { -0.35f, 0.35f },
    { -0.07949437f, -0.0021014619f, -0.003654319f, -9.283901e-05f, -1.2840699e-05f, -8.421201e-06f,
      -7.0854453e-06f, 8.059047e-06f, 1.06222615e-05f, 1.4257084e-05f, 3.9581595e-05f, 7.694712e-05f,
      0.00016577546f, -0.00034335f, 0.9800261f, -0.19886898f, -0.2916485f, -2.589653f, 0.0f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f, 0.00034335f,
      -0.077f, -0.344f, -0.35f, 0.35f } },
    { { { 1.351f, 0.195f }, { -0.062f, -0.237f },
        0.215f, -0.053f, -6.399f },
      { { 1.45f, -0.077f }, { -0.133f, 0.074f } },
      10.454f, NMPC_OK,
      { 0.35f, -0.35f },
    { -0.01562983f, 0.0055056494f, -0.0013547714f, 0.0002489008f, 4.929743e-06f, -7.401258e-06f,
      1.1803715e-05f, 4.0413693e-07f, 1.23364525e-05f, 1.15364965e-05f, 6.472731e-05f, 1.2423836e-05f,
      -0.00030550503f, 0.00034335f, -0.11555613f, 0.993301f, 2.1677194f, -0.05540228f, 0.0f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f, 0.00034335f,
      0.215f, -0.053f, 0.35f, -0.35f } },
    { { { -0.733f, 1.51f }, { 0.356f, 0.132f },
        -0.194f, 0.239f, -0.569f },
      { { -0.884f, 1.588f }, { -0.131f, 0.027f } },
      8.12f, NMPC_OK,
      { -0.35f, 0.17873648f },
    { -0.0469242f, 0.075376585f, -0.0023843169f, 0.0024300092f, -5.7033276e-07f, 1.016469e-05f,
      1.3162103e-05f, -2.375003e-06f, 9.1550855e-06f, 1.4166731e-05f, -9.046151e-06f, 6.322705e-05f,
      9.371454e-05f, -0.0001753405f, -0.53878987f, 0.8424401f, -1.4041677f, 2.3252356f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 5.0f, 6.0f, 0.35f, 0.00034335f,
      0.00034335f, -0.194f, 0.239f, -0.35f, 0.17873648f } }
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
