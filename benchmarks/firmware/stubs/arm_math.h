/* In the place of CMSIS-DSP: the functions that the firmware uses (desk/matrices.c). */
#ifndef ARM_MATH_H
#define ARM_MATH_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#define PI 3.14159265358979f

typedef float float32_t;

typedef enum { ARM_MATH_SUCCESS = 0, ARM_MATH_SIZE_MISMATCH = -3, ARM_MATH_SINGULAR = -5 } arm_status;

typedef struct {
    uint16_t numRows;
    uint16_t numCols;
    float32_t *pData;
} arm_matrix_instance_f32;

arm_status arm_mat_mult_f32(const arm_matrix_instance_f32 *a, const arm_matrix_instance_f32 *b, arm_matrix_instance_f32 *product);
arm_status arm_mat_trans_f32(const arm_matrix_instance_f32 *a, arm_matrix_instance_f32 *transpose);
arm_status arm_mat_scale_f32(const arm_matrix_instance_f32 *a, float32_t factor, arm_matrix_instance_f32 *scaled);
arm_status arm_mat_add_f32(const arm_matrix_instance_f32 *a, const arm_matrix_instance_f32 *b, arm_matrix_instance_f32 *sum);
arm_status arm_mat_sub_f32(const arm_matrix_instance_f32 *a, const arm_matrix_instance_f32 *b, arm_matrix_instance_f32 *difference);
arm_status arm_mat_inverse_f32(const arm_matrix_instance_f32 *a, arm_matrix_instance_f32 *inverse);

void arm_add_f32(const float32_t *a, const float32_t *b, float32_t *sum, uint32_t count);
void arm_sub_f32(const float32_t *a, const float32_t *b, float32_t *difference, uint32_t count);
void arm_scale_f32(const float32_t *a, float32_t factor, float32_t *scaled, uint32_t count);
void arm_dot_prod_f32(const float32_t *a, const float32_t *b, uint32_t count, float32_t *product);

static inline arm_status arm_sqrt_f32(float32_t square, float32_t *root)
{
    *root = sqrtf(square);
    return ARM_MATH_SUCCESS;
}

static inline float32_t arm_sin_f32(float32_t angle_rad) { return sinf(angle_rad); }
static inline float32_t arm_cos_f32(float32_t angle_rad) { return cosf(angle_rad); }

#endif
