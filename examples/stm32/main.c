/* The generated C on an STM32F4 at 168 MHz, from a timer interrupt every 10 ms, without a HAL and without an allocator.
 *
 * $ mambo-nmpc generate mambo -o nmpc
 * ...
 * $ arm-none-eabi-gcc -mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 -O2 -ffp-contract=off -Inmpc -c main.c nmpc/*.c
 * $ ls *.o
 * main.o
 * nmpc.o
 * nmpc_self_test.o
 */
#include <stdint.h>

#include "nmpc.h"
#include "nmpc_self_test.h"

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define RCC_APB1ENR REGISTER(0x40023840U)
#define TIM6_CR1 REGISTER(0x40001000U)
#define TIM6_DIER REGISTER(0x4000100CU)
#define TIM6_SR REGISTER(0x40001010U)
#define TIM6_PSC REGISTER(0x40001028U)
#define TIM6_ARR REGISTER(0x4000102CU)
#define NVIC_ISER1 REGISTER(0xE000E104U)

/* Yours: north-east-down, in m, m/s and rad; the newest estimate, the set-point, and the attitude loop. */
void read_state(nmpc_state_t *state);
void read_target(nmpc_target_t *target);
float thrust_over_mass(void);
void fly_attitude(float roll_rad, float pitch_rad);
void TIM6_DAC_IRQHandler(void);
static nmpc_t controller;

void TIM6_DAC_IRQHandler(void)
{
    nmpc_state_t state;
    nmpc_target_t target = { { 0 }, { 0 }, { 0 }, { 0 }, 0 };
    nmpc_command_t command;

    TIM6_SR = 0U;
    read_state(&state);
    read_target(&target);
    (void)nmpc_step(&controller, &state, &target, thrust_over_mass(), &command); /* refused: the last command */
    fly_attitude(command.roll_rad, command.pitch_rad);
}

int main(void)
{
    while (nmpc_self_test(&controller) != 0) { /* other bits than the reference: do not arm */
    }
    nmpc_init(&controller);
    RCC_APB1ENR |= 1U << 4;
    (void)RCC_APB1ENR; /* the timer has its clock two cycles later */
    TIM6_PSC = 8400U - 1U; /* 84 MHz to 10 kHz */
    TIM6_ARR = 100U - 1U;  /* to 100 Hz: NMPC_UPDATE_PERIOD_S */
    TIM6_DIER = 1U;
    NVIC_ISER1 = 1U << (54U - 32U);
    TIM6_CR1 = 1U;
    for (;;) { /* the rest of your firmware */
    }
}
