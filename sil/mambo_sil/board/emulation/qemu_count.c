/* SPDX-License-Identifier: MIT-0
 *
 * QEMU plugin that counts instructions (QEMU manual, TCG plugins); it declares the functions of QEMU that it uses.
 * Its argument counts=N is the descriptor of a file of three tables of 64-bit numbers by word address of flash: how
 * often the instruction there was executed, how often the next one was not the one behind it, and, for the plugin to
 * read, its length in words, which QEMU does not say of AVR.
 */
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/stat.h>

struct qemu_plugin_tb;
struct qemu_plugin_insn;

size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *block);
struct qemu_plugin_insn *qemu_plugin_tb_get_insn(const struct qemu_plugin_tb *block, size_t index);
uint64_t qemu_plugin_insn_vaddr(const struct qemu_plugin_insn *instruction);
void qemu_plugin_register_vcpu_tb_trans_cb(uint64_t id, void (*callback)(uint64_t id, struct qemu_plugin_tb *block));
void qemu_plugin_register_vcpu_insn_exec_cb(struct qemu_plugin_insn *instruction,
                                            void (*callback)(unsigned int cpu, void *data), int flags, void *data);
int qemu_plugin_install(uint64_t id, const void *info, int argc, char **argv);

int qemu_plugin_version = QEMU_PLUGIN_INTERFACE;

static uint64_t *times;
static uint64_t *taken;
static const uint64_t *words;
static uintptr_t last; /* word address of the instruction before */

/* `data`: word address of the instruction. */
static void count_instruction(unsigned int cpu, void *data)
{
    const uintptr_t address = (uintptr_t)data;

    (void)cpu;
    times[address] += 1U;
    if (address != (last + words[last])) {
        taken[last] += 1U;
    }
    last = address;
}

static void instrument_block(uint64_t id, struct qemu_plugin_tb *block)
{
    size_t index;

    (void)id;
    for (index = 0U; index < qemu_plugin_tb_n_insns(block); index += 1U) {
        struct qemu_plugin_insn *const instruction = qemu_plugin_tb_get_insn(block, index);
        void *const address = (void *)(uintptr_t)(qemu_plugin_insn_vaddr(instruction) / 2U);

        qemu_plugin_register_vcpu_insn_exec_cb(instruction, count_instruction, 0, address);
    }
}

int qemu_plugin_install(uint64_t id, const void *info, int argc, char **argv)
{
    struct stat status;
    int file;

    (void)info;
    if (argc != 1) {
        return 1;
    }
    file = atoi(argv[0] + sizeof("counts=") - 1U);
    if (fstat(file, &status) != 0) {
        return 1;
    }
    times = mmap(NULL, (size_t)status.st_size, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (times == MAP_FAILED) {
        return 1;
    }
    taken = times + ((size_t)status.st_size / 3U / sizeof *times);
    words = taken + (taken - times);
    qemu_plugin_register_vcpu_tb_trans_cb(id, instrument_block);
    return 0;
}
