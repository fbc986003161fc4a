/* In the place of the microcontroller's header: the desk is never in an interrupt. */
#ifndef STM32FXXX_H
#define STM32FXXX_H

#include <stdint.h>

static const struct { uint32_t ICSR; } desk_control_block = { 0 };
#define SCB (&desk_control_block)
#define SCB_ICSR_VECTACTIVE_Msk 0U

#endif
