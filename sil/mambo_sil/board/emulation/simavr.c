/* SPDX-License-Identifier: MIT-0
 *
 * Calls functions of a program in simavr's ATmega2560, without interrupts and peripherals, and counts by word address
 * of flash how often each instruction was executed and the clock cycles that it took. What is skipped counts as
 * executed; its cycles are those of the instruction that skips it.
 */
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>

#include <simavr/sim_avr.h>
#include <simavr/sim_core.h>

enum { RETURNED, FAULTED, LATE };
enum { ERASED = 0xFFFF }; /* word of flash that holds no code; simavr would take it for a skip */

static int reported; /* simavr met an instruction or address that the part lacks */

static void note_error(avr_t *avr, const int level, const char *format, va_list arguments)
{
    (void)avr;
    (void)format;
    (void)arguments;
    if (level == LOG_ERROR) {
        reported = 1;
    }
}

void machine_destroy(avr_t *avr)
{
    avr_terminate(avr);
    free(avr);
}

avr_t *machine_create(void)
{
    avr_t *const avr = avr_make_mcu_by_name("atmega2560");

    avr_global_logger_set(note_error);
    if (avr != NULL) {
        (void)avr_init(avr);
    }
    return avr;
}

uint8_t *machine_flash(avr_t *avr)
{
    return avr->flash;
}

uint8_t *machine_data(avr_t *avr)
{
    return avr->data;
}

uint32_t machine_place(const avr_t *avr)
{
    return avr->pc;
}

static unsigned word_at(const avr_t *avr, uint32_t address)
{
    return (unsigned)avr->flash[address] | ((unsigned)avr->flash[address + 1U] << 8);
}

/* Whether an opcode is cpse, sbrc, sbrs, sbic or sbis (DS40002198). */
static int is_skip(unsigned opcode)
{
    return ((opcode & 0xFC00U) == 0x1000U) || ((opcode & 0xFC08U) == 0xFC00U) || ((opcode & 0xFD00U) == 0x9900U);
}

/* Whether an opcode is lds, sts, jmp or call, which have a second word. */
static int has_second_word(unsigned opcode)
{
    return ((opcode & 0xFC0FU) == 0x9000U) || ((opcode & 0xFE0CU) == 0x940CU);
}

/* Set program counter and cycles behind a skipped instruction: of some adiw and sbiw simavr 1.6 skips two words. */
static void skip(avr_t *avr, uint32_t skipped, avr_cycle_count_t before)
{
    const uint32_t words = 1U + (uint32_t)has_second_word(word_at(avr, skipped));

    avr->pc = skipped + (2U * words);
    avr->cycle = before + 1U + words;
}

/* Run from byte address `start` until `end` is next. A fault leaves the program counter where it happened. */
int machine_run(avr_t *avr, uint32_t start, uint32_t end, uint64_t limit_cycles, uint64_t *times, uint64_t *cycles)
{
    const avr_cycle_count_t limit = avr->cycle + limit_cycles;

    reported = 0;
    avr->state = cpu_Running;
    avr->pc = start;
    while (avr->pc != end) {
        const uint32_t address = avr->pc;
        const avr_cycle_count_t before = avr->cycle;
        unsigned opcode;

        if (address >= avr->flashend) {
            return FAULTED;
        }
        opcode = word_at(avr, address);
        if (opcode == ERASED) {
            return FAULTED;
        }
        avr->pc = avr_run_one(avr);
        if ((reported != 0) || (avr->state != cpu_Running)) {
            avr->pc = address;
            return FAULTED;
        }
        if (is_skip(opcode) && (avr->pc != (address + 2U))) {
            skip(avr, address + 2U, before);
            times[(address + 2U) / 2U] += 1U;
        }
        times[address / 2U] += 1U;
        cycles[address / 2U] += avr->cycle - before;
        if (avr->cycle > limit) {
            return LATE;
        }
    }
    return RETURNED;
}
