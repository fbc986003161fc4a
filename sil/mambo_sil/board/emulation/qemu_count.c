/* SPDX-License-Identifier: MIT-0
 *
 * QEMU plugin that counts instructions (QEMU manual, TCG plugins); it declares the functions of QEMU that it uses.
 * Its argument counts=N is the descriptor of a file of 64-bit counts, one for each word address of flash: the
 * instructions executed in the translation blocks that begin there.
 */
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/stat.h>

struct qemu_plugin_tb;

size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *block);
uint64_t qemu_plugin_tb_vaddr(const struct qemu_plugin_tb *block);
void qemu_plugin_register_vcpu_tb_trans_cb(uint64_t id, void (*callback)(uint64_t id, struct qemu_plugin_tb *block));
void qemu_plugin_register_vcpu_tb_exec_cb(struct qemu_plugin_tb *block, void (*callback)(unsigned int cpu, void *data),
                                          int flags, void *data);
int qemu_plugin_install(uint64_t id, const void *info, int argc, char **argv);

int qemu_plugin_version = QEMU_PLUGIN_INTERFACE;

static uint64_t *counts;

/* `data`: number of instructions in the upper half, word address of the block in the lower. */
static void count_block(unsigned int cpu, void *data)
{
    (void)cpu;
    counts[(uintptr_t)data & 0xFFFFFFFFU] += (uintptr_t)data >> 32;
}

static void instrument_block(uint64_t id, struct qemu_plugin_tb *block)
{
    const uintptr_t address = (uintptr_t)(qemu_plugin_tb_vaddr(block) / 2U);
    const uintptr_t count = (uintptr_t)qemu_plugin_tb_n_insns(block);

    (void)id;
    qemu_plugin_register_vcpu_tb_exec_cb(block, count_block, 0, (void *)((count << 32) | address));
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
    counts = mmap(NULL, (size_t)status.st_size, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (counts == MAP_FAILED) {
        return 1;
    }
    qemu_plugin_register_vcpu_tb_trans_cb(id, instrument_block);
    return 0;
}
