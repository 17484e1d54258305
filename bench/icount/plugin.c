/* A QEMU plugin that counts the instructions between two markers of a Thumb program, exactly.
 *
 * A marker is `dbg #n` (Armv7-M Architecture Reference Manual, A7.7.32: a hint, encoded F3AF 80Fn; a no-operation on
 * Cortex-M3, M4 and M7 and in QEMU):
 *
 *     dbg #0 .. #7     opens region 0 .. 7
 *     dbg #8 .. #15    closes it
 *
 * Every instruction after the opening marker and before the closing one counts, calls included; the markers do not.
 * An instruction in an IT block whose condition is false counts too: the core takes a cycle for it. Regions may overlap.
 *
 * Argument: out=FILE. One line for each region that was closed at least once: region, samples, sum, smallest, largest.
 */
#include <inttypes.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The part of QEMU's plugin interface that is used here. Debian packages no header for it.
 * QP_API is the version that QEMU asks for: 1 up to QEMU 8, 4 from QEMU 9 on. */
#define EXPORT __attribute__((visibility("default")))
typedef uint64_t qemu_plugin_id_t;
struct qemu_info_t;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t, void (*)(qemu_plugin_id_t, struct qemu_plugin_tb *));
void qemu_plugin_register_vcpu_insn_exec_cb(struct qemu_plugin_insn *, void (*)(unsigned, void *), int, void *);
void qemu_plugin_register_atexit_cb(qemu_plugin_id_t, void (*)(qemu_plugin_id_t, void *), void *);
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *);
struct qemu_plugin_insn *qemu_plugin_tb_get_insn(const struct qemu_plugin_tb *, size_t);
size_t qemu_plugin_insn_size(const struct qemu_plugin_insn *);
#if QP_API >= 3
size_t qemu_plugin_insn_data(const struct qemu_plugin_insn *, void *, size_t);
#else
const void *qemu_plugin_insn_data(const struct qemu_plugin_insn *);
#endif
EXPORT int qemu_plugin_version = QP_API;

enum { REGIONS = 8 };

struct region {
    bool open;
    uint64_t start; /* value of `executed` at the opening marker */
    uint64_t samples, sum, smallest, largest;
};

static struct region regions[REGIONS];
static uint64_t executed; /* instructions since power-up, markers left out */
static FILE *out;

static void on_instruction(unsigned cpu, void *unused)
{
    (void)cpu, (void)unused;
    executed++;
}

static void on_opening(unsigned cpu, void *region)
{
    (void)cpu;
    struct region *r = region;
    r->open = true;
    r->start = executed;
}

static void on_closing(unsigned cpu, void *region)
{
    (void)cpu;
    struct region *r = region;
    if (!r->open)
        return;
    uint64_t count = executed - r->start;
    if (r->samples == 0 || count < r->smallest)
        r->smallest = count;
    if (count > r->largest)
        r->largest = count;
    r->open = false;
    r->sum += count;
    r->samples++;
}

/* The first four bytes of an instruction as one number, its first halfword lowest; 0 if it has only two. Two bytes before
 * the end of a page QEMU looks ahead, and adds the halfword that it has read to the instruction's own. */
static uint32_t wide_encoding(const struct qemu_plugin_insn *instruction)
{
    uint32_t encoding = 0;
    if (qemu_plugin_insn_size(instruction) < sizeof encoding)
        return 0;
#if QP_API >= 3
    qemu_plugin_insn_data(instruction, &encoding, sizeof encoding);
#else
    memcpy(&encoding, qemu_plugin_insn_data(instruction), sizeof encoding);
#endif
    return encoding;
}

static void on_translation(qemu_plugin_id_t id, struct qemu_plugin_tb *block)
{
    (void)id;
    for (size_t i = 0; i < qemu_plugin_tb_n_insns(block); i++) {
        struct qemu_plugin_insn *instruction = qemu_plugin_tb_get_insn(block, i);
        uint32_t encoding = wide_encoding(instruction);
        bool is_marker = (encoding & 0xfff0ffff) == 0x80f0f3af;
        uint32_t option = encoding >> 16 & 0xf;
        if (!is_marker)
            qemu_plugin_register_vcpu_insn_exec_cb(instruction, on_instruction, 0, NULL);
        else if (option < REGIONS)
            qemu_plugin_register_vcpu_insn_exec_cb(instruction, on_opening, 0, &regions[option]);
        else
            qemu_plugin_register_vcpu_insn_exec_cb(instruction, on_closing, 0, &regions[option - REGIONS]);
    }
}

static void on_power_off(qemu_plugin_id_t id, void *unused)
{
    (void)id, (void)unused;
    for (int i = 0; i < REGIONS; i++) {
        const struct region *r = &regions[i];
        if (r->samples > 0)
            fprintf(out, "%d %" PRIu64 " %" PRIu64 " %" PRIu64 " %" PRIu64 "\n", i, r->samples, r->sum, r->smallest,
                    r->largest);
    }
    fclose(out);
}

EXPORT int qemu_plugin_install(qemu_plugin_id_t id, const struct qemu_info_t *info, int argc, char **argv)
{
    (void)info;
    if (argc != 1 || strncmp(argv[0], "out=", 4) != 0) {
        fprintf(stderr, "plugin: the one argument is out=FILE\n");
        return -1;
    }
    out = fopen(argv[0] + 4, "w");
    if (!out) {
        perror(argv[0] + 4);
        return -1;
    }
    qemu_plugin_register_vcpu_tb_trans_cb(id, on_translation);
    qemu_plugin_register_atexit_cb(id, on_power_off, NULL);
    return 0;
}
