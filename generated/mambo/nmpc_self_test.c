/* SPDX-License-Identifier: MIT-0
 *
 * Self-test: 24 consecutive control steps with the results of the reference, and 100000 control steps with
 * pseudo-random inputs, of whose results there is a digest.
 * MISRA C:2012: departs from rules 2.3, 8.9, 11.5 and 19.2, for the reasons in deviations.txt.
 */
#include "nmpc_self_test.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0xB3EF302BUL)
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
      1.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f,
      0.81415856f, 5.0f, 6.0f, 0.35f, 0.00034335f, 0.00034335f, 0.0f, 0.0f, 0.0f, 1.857e-41f } },
    { { { -1.474f, 0.769f }, { 0.307f, 0.005f },
        -0.306f, 0.126f, -2.823f },
      { { -1.528f, 0.944f }, { -0.019f, 0.061f } },
      11.476f, NMPC_OK,
      { -0.35f, -0.35f },
    { -0.06562707f, 0.03544571f, -0.0019078979f, 0.0014301338f, -1.5026496e-05f, 8.714896e-06f, 0.0f, -0.0f,
      0.0f, 0.0f, 0.0f, -3e-45f, -0.00034335f, 0.00034335f, -0.3132304f, -0.94967717f, -2.559785f, 1.63969f,
      0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f,
      0.35f, 0.00034335f, 0.00034335f, -0.306f, 0.126f, -0.35f, -0.35f } },
    { { { -0.158f, -1.315f }, { -0.241f, 0.408f },
        -0.015f, -0.282f, 3.007f },
      { { 0.138f, -1.39f }, { 0.016f, 0.047f } },
      9.141f, NMPC_OK,
      { 0.35f, -0.13573632f },
    { -0.07222846f, -0.023333637f, -0.0023563763f, -0.0002895163f, -1.6336284e-05f, -5.138333e-06f,
      -6.42299e-07f, 2.3202945e-06f, -3.428059e-06f, 2.6390626e-06f, -6.841681e-05f, 5.27105e-05f,
      0.00034335f, 0.00013315733f, 0.13418669f, -0.99095607f, 0.4111907f, -2.5500042f, 0.0f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f, 0.00034335f,
      0.00034335f, -0.015f, -0.282f, 0.35f, -0.13573632f } },
    { { { 1.757f, 0.001f }, { 0.135f, -0.137f },
        0.277f, 0.009f, -5.163f },
      { { 1.803f, 0.276f }, { -0.024f, 0.086f } },
      10.807f, NMPC_OK,
      { 0.35f, -0.13752978f },
    { 0.011471249f, -0.023134917f, 0.00022662195f, -0.0002137708f, 6.2953895e-06f, -5.4360958e-06f,
      6.33942e-06f, -2.0518382e-07f, 2.0681455e-08f, 3.6323645e-06f, 1.36329145e-05f, 6.506056e-05f,
      -0.00034335f, 0.00013491671f, 0.9001811f, 0.43551573f, 3.0168598f, 0.59318745f, 0.0f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f, 0.00034335f,
      0.00034335f, 0.277f, 0.009f, 0.35f, -0.13752978f } },
    { { { -0.327f, 1.915f }, { -0.436f, 0.243f },
        -0.132f, 0.301f, 0.666f },
      { { -0.531f, 1.941f }, { -0.011f, 0.05f } },
      8.473f, NMPC_OK,
      { -0.35f, -0.34723502f },
    { -0.00677781f, 0.06701796f, -0.00067935674f, 0.0024355967f, 4.0181476e-08f, 1.7862822e-05f,
      6.4674714e-06f, 1.8605151e-06f, -3.4721288e-06f, 4.654903e-06f, -5.7500427e-05f, 7.578476e-05f,
      0.00034335f, 0.00034063758f, 0.6178458f, 0.78629935f, -0.8752269f, 3.140105f, 0.0f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f, 0.00034335f,
      0.00034335f, -0.132f, 0.301f, -0.35f, -0.34723502f } },
    { { { 0.988f, -0.169f }, { -0.081f, -0.322f },
        0.16f, -0.108f, 6.496f },
      { { 1.135f, -0.393f }, { -0.073f, 0.068f } },
      10.138f, NMPC_OK,
      { 0.35f, -0.35f },
    { 0.038098477f, 0.055170797f, 0.00081101945f, 0.0019507398f, 1.1210236e-05f, 1.219857e-05f, 8.490169e-06f,
      4.998078e-06f, -9.512178e-08f, 7.240514e-06f, 2.2374072e-05f, 0.00011644451f, 3.6471756e-06f,
      0.00034335f, 0.21121176f, 0.97744036f, 2.1413434f, -0.83235204f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f,
      995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f, 0.00034335f, 0.00034335f,
      0.16f, -0.108f, 0.35f, -0.35f } },
    { { { 2000.0f, 1.146f }, { 0.327f, 0.037f },
        -0.249f, 0.184f, -1.674f },
      { { -1.2f, 1.272f }, { -0.081f, 0.011f } },
      11.804f, NMPC_BAD_STATE,
      { 0.35f, 0.19660413f },
    { 0.038920566f, 0.05713282f, 0.0008331578f, 0.0019733107f, 1.1210236e-05f, 1.219857e-05f, 8.992863e-06f,
      1.3679524e-05f, -1.462191e-07f, 9.8135115e-06f, 1.8642502e-05f, 0.00015127865f, 0.00034335f,
      -0.00019286865f, 0.21121176f, 0.97744036f, -2.2230058f, 2.116208f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f,
      995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f, 0.00034335f, 0.00034335f,
      0.16f, -0.108f, 0.35f, 0.19660413f } },
    { { { 0.219f, -0.938f }, { -0.211f, 0.45f },
        0.043f, -0.225f, 4.155f },
      { { 0.466f, -1.062f }, { -0.036f, 0.007f } },
      9.469f, NMPC_OK,
      { 0.122215435f, -0.22328968f },
    { 0.046121497f, 0.014978209f, 0.00084520056f, 0.0004978763f, 1.1684859e-05f, 2.2944869e-06f,
      7.602507e-06f, -2.2569333e-05f, 3.1901645e-06f, 8.191577e-06f, 8.334456e-05f, 9.844575e-05f,
      0.000119893346f, 0.00021904719f, -0.84863925f, -0.528972f, 0.8208122f, -2.1848803f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f,
      0.00034335f, 0.00034335f, 0.043f, -0.225f, 0.122215435f, -0.22328968f } },
    { { { -1.865f, 0.378f }, { 0.175f, -0.084f },
        0.334f, 0.067f, -4.015f },
      { { -1.868f, 0.604f }, { -0.066f, 0.057f } },
      11.135f, NMPC_OK,
      { 0.35f, -0.35f },
    { -0.040172048f, 0.03114626f, -0.0020405499f, 0.0006798715f, -9.427995e-06f, 5.6868985e-06f,
      -1.6564609e-05f, -6.3108882e-06f, 4.295491e-06f, 1.0018585e-05f, 9.062736e-05f, 0.00011696028f,
      0.00034335f, 0.00034335f, 0.7665216f, -0.6422186f, -3.099972f, 1.0082028f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f,
      0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f, 0.00034335f,
      0.00034335f, 0.334f, 0.067f, 0.35f, -0.35f } },
    { { { 0.05f, -1.707f }, { -0.384f, 0.308f },
        -0.075f, -0.342f, 1.815f },
      { { -0.203f, -1.731f }, { -0.042f, 0.032f } },
      8.801f, NMPC_OK,
      { -0.35f, 0.35f },
    { -0.039220303f, -0.046168856f, -0.0020365822f, -0.0013218723f, -9.362971e-06f, -1.26790555e-05f,
      -8.113253e-06f, 7.6090873e-06f, 7.866619e-06f, 1.2675059e-05f, 0.00014098553f, 0.00015171524f,
      0.00034335f, -0.00034335f, 0.9703302f, -0.24178375f, -0.33180118f, -2.9153786f, 0.0f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f, 0.00034335f,
      0.00034335f, -0.075f, -0.342f, -0.35f, 0.35f } },
    { { { 1.366f, 0.209f }, { -0.019f, -0.248f },
        0.217f, -0.05f, -6.355f },
      { { 1.463f, -0.065f }, { -0.093f, 0.06f } },
      10.466f, NMPC_OK,
      { 0.35f, -0.35f },
    { 0.024351176f, -0.036423672f, 0.00014624157f, -0.00082801084f, 7.492382e-06f, -1.0409925e-05f,
      1.4304807e-05f, -4.188799e-06f, 1.1344219e-05f, 9.940915e-06f, 0.0001813092f, 7.571369e-05f,
      -0.0003233974f, 0.00034335f, -0.071752995f, 0.99742246f, 2.5969155f, 0.0048393235f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f,
      0.00034335f, 0.00034335f, 0.217f, -0.05f, 0.35f, -0.35f } },
    { { { -0.719f, 1.524f }, { 0.399f, 0.121f },
        -0.192f, 0.241f, -0.526f },
      { { -0.872f, 1.601f }, { -0.091f, 0.013f } },
      8.132f, NMPC_OK,
      { -0.35f, 0.29738045f },
    { -0.0073059383f, 0.035536535f, -0.000982052f, 0.0014787007f, 1.1310922e-06f, 8.300425e-06f,
      1.8866422e-05f, -5.9997956e-06f, 7.936739e-06f, 1.259114e-05f, 8.074004e-05f, 0.00011680075f,
      0.00016710162f, -0.00029173022f, -0.5020781f, 0.86482227f, -1.5690516f, 2.6888814f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f,
      0.00034335f, 0.00034335f, -0.192f, 0.241f, -0.35f, 0.29738045f } },
    { { { 0.596f, -0.561f }, { -0.128f, -0.455f },
        0.1f, -0.167f, 5.304f },
      { { 0.794f, -0.734f }, { -0.035f, 0.02f } },
      9.798f, NMPC_OK,
      { 0.35f, -0.23737085f },
    { 0.019268423f, 0.005837855f, 4.0322644e-05f, 0.00018827282f, 7.789503e-06f, -1.6348313e-06f,
      2.0177064e-05f, -9.387397e-06f, 9.402637e-06f, 1.0363312e-05f, 9.794867e-05f, 5.4083786e-05f,
      5.598031e-05f, 0.00023286081f, -0.8300433f, 0.55769885f, 1.5872685f, -1.5288206f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f,
      0.00034335f, 0.00034335f, 0.1f, -0.167f, 0.35f, -0.23737085f } },
    { { { -1.488f, 0.755f }, { 0.269f, 0.021f },
        -0.309f, 0.124f, -2.866f },
      { { -1.54f, 0.932f }, { -0.054f, -200.0f } },
      11.463f, NMPC_BAD_TARGET,
      { 0.057064533f, -0.23737085f },
    { -0.04809845f, 0.04054426f, -0.0019214757f, 0.0015874865f, -7.835656e-06f, 6.8409445e-06f,
      -1.0970671e-05f, -2.135568e-05f, 9.742503e-06f, 1.2207949e-05f, 8.958595e-05f, 8.152933e-05f,
      5.598031e-05f, 0.00023286081f, -0.27211735f, -0.9622641f, 1.5872685f, -1.5288206f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f,
      0.00034335f, 0.00034335f, -0.309f, 0.124f, 0.057064533f, -0.23737085f } },
    { { { -0.173f, -1.33f }, { -0.28f, 0.423f },
        -0.017f, -0.284f, 2.963f },
      { { 0.125f, -1.403f }, { -0.02f, 0.065f } },
      9.129f, NMPC_OK,
      { 0.35f, 0.053462163f },
    { -0.056437407f, -0.018997602f, -0.0024309834f, -0.00014921911f, -9.712478e-06f, -7.2432595e-06f,
      -1.159736e-05f, -9.137827e-06f, 1.0388737e-05f, 1.4134979e-05f, 8.28896e-05f, 0.00010476148f,
      0.00034335f, -5.2446383e-05f, 0.17764473f, -0.98409474f, 0.31907326f, -2.5548651f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f,
      0.00034335f, 0.00034335f, -0.017f, -0.284f, 0.35f, 0.053462163f } },
    { { { 1.743f, -0.014f }, { 0.095f, -0.122f },
        0.274f, 0.007f, -5.207f },
      { { 1.791f, 0.263f }, { -0.061f, 0.104f } },
      10.794f, NMPC_OK,
      { 0.35f, -0.18160214f },
    { 0.02562489f, -0.019534402f, 0.00010510189f, -9.1683716e-05f, 1.2410139e-05f, -7.754344e-06f,
      4.186245e-08f, 6.200676e-06f, 1.3911435e-05f, 1.3772126e-05f, 0.00013478962f, 8.06272e-05f,
      -0.00034335f, 0.00017815169f, 0.8801535f, 0.47468913f, 2.955576f, 0.5864655f, 0.0f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f, 0.00034335f,
      0.00034335f, 0.274f, 0.007f, 0.35f, -0.18160214f } },
    { { { -0.341f, 1.902f }, { -0.476f, 0.258f },
        -0.134f, 0.299f, 0.623f },
      { { -0.543f, 1.929f }, { -0.048f, 0.068f } },
      8.46f, NMPC_OK,
      { -0.35f, -0.35f },
    { 0.005786866f, 0.069999106f, -0.0008610708f, 0.0025394903f, 5.6892386e-06f, 1.537181e-05f, 9.129713e-06f,
      9.208524e-06f, 1.0452998e-05f, 1.50730375e-05f, 3.951427e-05f, 9.559899e-05f, 0.00034335f, 0.00034335f,
      0.5834742f, 0.81213164f, -0.95447546f, 3.1386912f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 995.2518f,
      995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f, 0.00034335f, 0.00034335f, -0.134f,
      0.299f, -0.35f, -0.35f } },
    { { { 0.974f, -0.184f }, { -0.121f, -0.308f },
        0.157f, -0.11f, 6.453f },
      { { 1.122f, -0.406f }, { -0.11f, 0.085f } },
      10.126f, NMPC_OK,
      { 0.35f, -0.35f },
    { 0.04913413f, 0.057450116f, 0.00059382926f, 0.002022675f, 1.6443457e-05f, 9.523539e-06f, 1.8447654e-05f,
      9.825484e-06f, 1.3781508e-05f, 1.7617478e-05f, 0.00010005737f, 0.0001336333f, 7.0681563e-06f,
      0.00034335f, 0.16899978f, 0.9856161f, 2.066885f, -0.85095847f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f,
      995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f, 0.00034335f, 0.00034335f,
      0.157f, -0.11f, 0.35f, -0.35f } },
    { { { -1.111f, 1.132f }, { 0.286f, 0.05f },
        -0.251f, 0.181f, -1.718f },
      { { -1.212f, 1.26f }, { -0.119f, 0.027f } },
      11.791f, NMPC_OK,
      { -0.35f, 0.3344756f },
    { -0.002129232f, 0.10788378f, -0.0011366529f, 0.003693275f, 4.537056e-06f, 2.085706e-05f, 1.1973161e-05f,
      -2.7178681e-05f, 1.3648547e-05f, 2.0147865e-05f, 8.1528095e-05f, 0.00016582865f, -0.00034335f,
      -0.00032812057f, -0.9891851f, -0.14667268f, -2.24631f, 2.0573227f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f,
      995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f, 0.00034335f, 0.00034335f,
      -0.251f, 0.181f, -0.35f, 0.3344756f } },
    { { { 0.205f, -0.952f }, { -0.252f, 0.463f },
        0.04f, -0.227f, 4.112f },
      { { 0.454f, -1.074f }, { -0.074f, 0.023f } },
      9.457f, NMPC_OK,
      { 0.35f, -0.1965837f },
    { 0.0053146333f, 0.063485816f, -0.001010337f, 0.0020410684f, 6.144046e-06f, 9.3786675e-06f,
      5.0389726e-06f, -2.0614792e-05f, 1.0084031e-05f, 1.778494e-05f, -3.1342206e-06f, 8.9998415e-05f,
      0.00017302758f, 0.00019284862f, -0.82511586f, -0.56496346f, 0.81910956f, -2.24179f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f,
      0.00034335f, 0.00034335f, 0.04f, -0.227f, 0.35f, -0.1965837f } },
    { { { -1.88f, 0.363f }, { 0.134f, -0.072f },
        0.332f, 0.064f, -4.058f },
      { { -1.881f, 0.591f }, { -0.104f, 0.072f } },
      0.0f, NMPC_BAD_THRUST,
      { 0.17637877f, -0.1965837f },
    { -0.08074946f, 0.07739949f, -0.003788156f, 0.002065628f, -1.39110525e-05f, 1.1299213e-05f,
      -1.32269715e-05f, -1.920372e-06f, 1.17606205e-05f, 1.9395524e-05f, 3.1968237e-05f, 0.000105787796f,
      0.00017302758f, 0.00019284862f, 0.7934201f, -0.6086745f, 0.81910956f, -2.24179f, 0.0f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f, 0.00034335f,
      0.00034335f, 0.332f, 0.064f, 0.17637877f, -0.1965837f } },
    { { { 0.036f, -1.721f }, { -0.427f, 0.318f },
        -0.077f, -0.344f, 1.771f },
      { { -0.215f, -1.743f }, { -0.081f, 0.046f } },
      8.788f, NMPC_OK,
      { -0.35f, 0.35f },
    { -0.07949108f, -0.0020976085f, -0.0036539203f, -9.237212e-05f, -1.2847375e-05f, -8.428993e-06f,
      -6.2361046e-06f, 1.0338249e-05f, 1.36085755e-05f, 2.086268e-05f, 6.0076087e-05f, 0.00011915322f,
      0.00025379396f, -0.00034335f, 0.9800261f, -0.19886898f, -0.3211314f, -2.9584892f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f,
      0.00034335f, 0.00034335f, -0.077f, -0.344f, -0.35f, 0.35f } },
    { { { 1.351f, 0.195f }, { -0.062f, -0.237f },
        0.215f, -0.053f, -6.399f },
      { { 1.45f, -0.077f }, { -0.133f, 0.074f } },
      10.454f, NMPC_OK,
      { 0.35f, -0.35f },
    { -0.015626542f, 0.0055094957f, -0.001354408f, 0.0002493261f, 4.92282e-06f, -7.4093414e-06f,
      1.5887046e-05f, -3.1717004e-06f, 1.6188495e-05f, 1.8113646e-05f, 9.8676814e-05f, 4.8150527e-05f,
      -0.0003226374f, 0.00034335f, -0.11555613f, 0.993301f, 2.5836613f, -0.078803256f, 0.0f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f, 0.00034335f,
      0.00034335f, 0.215f, -0.053f, 0.35f, -0.35f } },
    { { { -0.733f, 1.51f }, { 0.356f, 0.132f },
        -0.194f, 0.239f, -0.569f },
      { { -0.884f, 1.588f }, { -0.131f, 0.027f } },
      8.12f, NMPC_OK,
      { -0.35f, 0.2679965f },
    { -0.046920933f, 0.07538041f, -0.0023839872f, 0.0024303948f, -5.7748593e-07f, 1.0156337e-05f,
      1.7534772e-05f, -5.471831e-06f, 1.2788494e-05f, 2.076059e-05f, 1.47246465e-05f, 9.346905e-05f,
      0.00012640371f, -0.00026290456f, -0.53878987f, 0.8424401f, -1.5844755f, 2.6506999f, 0.0f, 0.0f, 0.0f,
      0.0f, 0.0f, 0.0f, 995.2518f, 995.2518f, 4.74821f, 1.1630836f, 0.81415856f, 5.0f, 6.0f, 0.35f,
      0.00034335f, 0.00034335f, -0.194f, 0.239f, -0.35f, 0.2679965f } }
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
