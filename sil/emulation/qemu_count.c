/* SPDX-License-Identifier: MIT-0
 *
 * Counts instructions for Python: a plugin for QEMU, whose interface it declares as far as it uses it
 * (QEMU manual, TCG plugins). Its one argument, counts=N, names an open file of 64-bit counts by the word address
 * at which a run of instructions begins.
 */
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/stat.h>

struct qemu_plugin_tb;

size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *run);
uint64_t qemu_plugin_tb_vaddr(const struct qemu_plugin_tb *run);
void qemu_plugin_register_vcpu_tb_trans_cb(uint64_t id, void (*translated)(uint64_t id, struct qemu_plugin_tb *run));
void qemu_plugin_register_vcpu_tb_exec_cb(struct qemu_plugin_tb *run, void (*entered)(unsigned int cpu, void *data),
                                          int flags, void *data);
int qemu_plugin_install(uint64_t id, const void *info, int argc, char **argv);

int qemu_plugin_version = QEMU_PLUGIN_INTERFACE;

static uint64_t *counts;

/* `data` is the number of instructions, and in its lower half their word address. */
static void entered(unsigned int cpu, void *data)
{
    (void)cpu;
    counts[(uintptr_t)data & 0xFFFFFFFFU] += (uintptr_t)data >> 32;
}

static void translated(uint64_t id, struct qemu_plugin_tb *run)
{
    const uintptr_t where = (uintptr_t)(qemu_plugin_tb_vaddr(run) / 2U);
    const uintptr_t count = (uintptr_t)qemu_plugin_tb_n_insns(run);

    (void)id;
    qemu_plugin_register_vcpu_tb_exec_cb(run, entered, 0, (void *)((count << 32) | where));
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
    qemu_plugin_register_vcpu_tb_trans_cb(id, translated);
    return 0;
}
