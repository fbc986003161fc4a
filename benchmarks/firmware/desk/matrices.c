/* Functions of CMSIS-DSP that the firmware uses, without its order of operations: the last bits may differ. */
#include "arm_math.h"

static float32_t *at(const arm_matrix_instance_f32 *a, int row, int column) { return &a->pData[(row * a->numCols) + column]; }

arm_status arm_mat_mult_f32(const arm_matrix_instance_f32 *a, const arm_matrix_instance_f32 *b, arm_matrix_instance_f32 *product)
{
    if ((a->numCols != b->numRows) || (product->numRows != a->numRows) || (product->numCols != b->numCols)) {
        return ARM_MATH_SIZE_MISMATCH;
    }
    for (int row = 0; row < a->numRows; row++) {
        for (int column = 0; column < b->numCols; column++) {
            float32_t sum = 0.0f;

            for (int k = 0; k < a->numCols; k++) {
                sum += *at(a, row, k) * *at(b, k, column);
            }
            *at(product, row, column) = sum;
        }
    }
    return ARM_MATH_SUCCESS;
}

arm_status arm_mat_trans_f32(const arm_matrix_instance_f32 *a, arm_matrix_instance_f32 *transpose)
{
    if ((transpose->numRows != a->numCols) || (transpose->numCols != a->numRows)) {
        return ARM_MATH_SIZE_MISMATCH;
    }
    for (int row = 0; row < a->numRows; row++) {
        for (int column = 0; column < a->numCols; column++) {
            *at(transpose, column, row) = *at(a, row, column);
        }
    }
    return ARM_MATH_SUCCESS;
}

void arm_add_f32(const float32_t *a, const float32_t *b, float32_t *sum, uint32_t count)
{
    for (uint32_t k = 0; k < count; k++) {
        sum[k] = a[k] + b[k];
    }
}

void arm_sub_f32(const float32_t *a, const float32_t *b, float32_t *difference, uint32_t count)
{
    for (uint32_t k = 0; k < count; k++) {
        difference[k] = a[k] - b[k];
    }
}

void arm_scale_f32(const float32_t *a, float32_t factor, float32_t *scaled, uint32_t count)
{
    for (uint32_t k = 0; k < count; k++) {
        scaled[k] = factor * a[k];
    }
}

void arm_dot_prod_f32(const float32_t *a, const float32_t *b, uint32_t count, float32_t *product)
{
    float32_t sum = 0.0f;

    for (uint32_t k = 0; k < count; k++) {
        sum += a[k] * b[k];
    }
    *product = sum;
}

static uint32_t size(const arm_matrix_instance_f32 *a) { return (uint32_t)a->numRows * a->numCols; }

arm_status arm_mat_add_f32(const arm_matrix_instance_f32 *a, const arm_matrix_instance_f32 *b, arm_matrix_instance_f32 *sum)
{
    arm_add_f32(a->pData, b->pData, sum->pData, size(a));
    return ARM_MATH_SUCCESS;
}

arm_status arm_mat_sub_f32(const arm_matrix_instance_f32 *a, const arm_matrix_instance_f32 *b, arm_matrix_instance_f32 *difference)
{
    arm_sub_f32(a->pData, b->pData, difference->pData, size(a));
    return ARM_MATH_SUCCESS;
}

arm_status arm_mat_scale_f32(const arm_matrix_instance_f32 *a, float32_t factor, arm_matrix_instance_f32 *scaled)
{
    arm_scale_f32(a->pData, factor, scaled->pData, size(a));
    return ARM_MATH_SUCCESS;
}

static void swap_rows(const arm_matrix_instance_f32 *a, int one, int other)
{
    for (int column = 0; column < a->numCols; column++) {
        const float32_t kept = *at(a, one, column);

        *at(a, one, column) = *at(a, other, column);
        *at(a, other, column) = kept;
    }
}

/* By Gauss and Jordan with the largest pivot of each column. `a` is overwritten, as in CMSIS. */
arm_status arm_mat_inverse_f32(const arm_matrix_instance_f32 *a, arm_matrix_instance_f32 *inverse)
{
    const int n = a->numRows;

    if ((a->numCols != n) || (inverse->numRows != n) || (inverse->numCols != n)) {
        return ARM_MATH_SIZE_MISMATCH;
    }
    for (int row = 0; row < n; row++) {
        for (int column = 0; column < n; column++) {
            *at(inverse, row, column) = (row == column) ? 1.0f : 0.0f;
        }
    }
    for (int column = 0; column < n; column++) {
        int pivot = column;

        for (int row = column + 1; row < n; row++) {
            if (fabsf(*at(a, row, column)) > fabsf(*at(a, pivot, column))) {
                pivot = row;
            }
        }
        if (*at(a, pivot, column) == 0.0f) {
            return ARM_MATH_SINGULAR;
        }
        swap_rows(a, pivot, column);
        swap_rows(inverse, pivot, column);
        for (int row = 0; row < n; row++) {
            const float32_t divisor = *at(a, column, column);
            const float32_t factor = (row == column) ? (1.0f - (1.0f / divisor)) : (*at(a, row, column) / divisor);

            for (int k = 0; k < n; k++) {
                *at(a, row, k) -= factor * *at(a, column, k);
                *at(inverse, row, k) -= factor * *at(inverse, column, k);
            }
        }
    }
    return ARM_MATH_SUCCESS;
}
