/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The firmware as a program of this computer: a fake accelerator, a TCP port in place of the serial line, and, if
 * wanted, a fake frame link on a UDP port. */

#define _DEFAULT_SOURCE

#include <getopt.h>
#include <setjmp.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>

#include "app/app.h"
#include "boot/start.h"
#include "drivers/reset_word.h"
#include "drivers/trial_choice.h"
#include "fake_flash.h"
#include "fake_frame_link.h"
#include "fake_grids.h"
#include "fake_stereo.h"
#include "generated/csr.h"
#include "generated/soc.h"
#include "lib/bytes.h"
#include "litestereo/firmware_tag.h"
#include "litestereo/platform.h"
#include "tcp_uart.h"
#include "udp_wire.h"

/* Address of the frame memory: registers hold 32-bit addresses, so it is below 4 GiB; the kernel may place the heap
 * of a program that is not position-independent anywhere in the first GiB after the program. */
#define MEMORY_BASE 0x50000000u

static struct {
    app_t         app;
    app_buffers_t buffers;
    uint8_t      *memory;
    size_t        memory_size;
    uint32_t      clock_hz;
    uint16_t      port;
    long          udp_port;               /* -1 for none. */
    bool          stored_only;            /* Without streaming. */
    bool          bad_updates;            /* A firmware on trial is reset before it confirms itself. */
    jmp_buf       reset;                  /* Target of a reset. */
    uint32_t      reset_word;             /* The register reset_record_cause. */
    uint16_t      version;                /* Of the firmware that the boot program found in flash. */
    uint8_t       booted[FLASH_IMAGE_BYTES];  /* The image that the boot program found in flash. */
} device = {.memory_size = 16 << 20, .clock_hz = 100000000, .udp_port = -1};

static void stop(int signal)
{
    (void)signal;
    tcp_uart_stop();
}

static void fail(const char *what)
{
    perror(what);
    exit(1);
}

/* Time. */

static uint64_t real_clock(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * device.clock_hz + (uint64_t)now.tv_nsec * device.clock_hz / 1000000000;
}

uint64_t clock_now(void)
{
    fake_stereo_advance();
    fake_frame_link_advance();
    return real_clock();
}

uint32_t clock_hz(void)
{
    return device.clock_hz;
}

const char *platform_name(void)
{
    return "LiteStereo";
}

/* Memory. */

void memory_to_device(void)
{
}

void memory_from_device(void)
{
}

size_t platform_stack_used(size_t *size)
{
    *size = 4096;
    return 1000;
}

void *platform_frame_memory(size_t *size)
{
    *size = device.memory_size;
    return device.memory;
}

void platform_attach_stereo(void (*handler)(void))
{
    fake_stereo_attach(handler);
}

static void handle_interrupt(void)
{
    stereo_isr(&device.app.stereo);
}

/* Resets. */

uint32_t reset_record_cause_read(void)           { return device.reset_word; }
void     reset_record_cause_write(uint32_t word) { device.reset_word = word; }

void reset_begin(reset_report_t *report)
{
    *report = (reset_report_t){.image = (uint8_t)reset_image(device.reset_word)};
}

void reset_forget_starts(void)
{
    device.reset_word &= ~(RESET_STARTS_MOST << RESET_STARTS_SHIFT);
}

void reset_now(reset_cause_t cause, uint32_t place, uint16_t line)
{
    if (cause != RESET_REQUESTED) {
        fprintf(stderr, "native_device: the firmware resets the SoC: cause %d, at 0x%x, line %u\n", (int)cause, place,
            line);
        exit(1);
    }
    longjmp(device.reset, 1);
}

const char *reset_cause_name(reset_cause_t cause)
{
    (void)cause;
    return "";
}

/* UDP. */

static bool is_matching(void)
{
    return (stereo_status_read() & 1) != 0;
}

/* Creates the frame link, if it has a port. */
static void listen_to_udp(void)
{
    if (device.udp_port < 0) {
        return;
    }
    device.udp_port = udp_wire_listen((uint16_t)device.udp_port);
    if (device.udp_port == 0) {
        fail("listen");
    }
    fake_frame_link.version   = FRAME_LINK_VERSION;
    fake_frame_link.streaming = !device.stored_only;
    fake_frame_link.matching  = is_matching;
}

/* Flash. */

/* Writes what `make flash` does: this firmware twice, or at least a firmware with its tag. */
static void fill_flash(void)
{
    uint8_t firmware[1000];

    memset(firmware, 0x5a, sizeof(firmware));
    memcpy(firmware + sizeof(firmware) - sizeof(firmware_tag), &firmware_tag, sizeof(firmware_tag));
    for (uint32_t image = 0; image < FLASH_IMAGES; image++) {
        fake_flash_put_image(FLASH_IMAGES_OFFSET + image * FLASH_IMAGE_BYTES, firmware, sizeof(firmware));
    }
}

/* The boot program. This program remains the firmware, but takes the version of the one in flash. */
static void boot(void)
{
    const uint8_t *tag_bytes;
    firmware_tag_t tag;
    trial_record_t record;
    uint32_t       image;

    device.version = (uint16_t)firmware_tag.version;
    if (!fake_flash.present) {
        return;
    }
    do {
        image = start_load(device.booted);
        if (image == FLASH_IMAGES) {
            fprintf(stderr, "native_device: no firmware in flash\n");
            exit(1);
        }
        tag_bytes = device.booted + get_u32(fake_flash.contents + FLASH_IMAGES_OFFSET + image * FLASH_IMAGE_BYTES);
        memcpy(&tag, tag_bytes - sizeof(tag), sizeof(tag));
        /* A bad one is reset at once, and the next start is that of the boot program again. */
    } while (device.bad_updates && trial_read(&record) && record.state == TRIAL_RUNNING && record.image == image);
    device.version = (uint16_t)tag.version;
}

/* Starts the firmware as after a reset. */
static bool start(void)
{
    boot();
    if (app_init(&device.app, &device.buffers) != STATUS_OK) {
        return false;
    }
    device.app.info.firmware_version = device.version;
    platform_attach_stereo(handle_interrupt);
    return true;
}

/* The program. */

static void usage(void)
{
    fprintf(stderr,
        "usage: native_device [options]\n"
        "  --port N              TCP port of 127.0.0.1, 0 picks one (default: 0)\n"
        "  --udp-port N          UDP port of 127.0.0.1, 0 picks one (default: no UDP)\n"
        "  --max-chunks N        chunks of a frame over UDP (default: 1024)\n"
        "  --stored-only         no streamed frames\n"
        "  --rectification ROWS  a rectification that keeps so many rows\n"
        "  --rows-gone           rows of each rectified frame are gone\n"
        "  --skip-parts N        one in N parts of a streamed map never leaves (default: 0, none)\n"
        "  --memory BYTES        memory for frames (default: 16777216)\n"
        "  --clock-hz N          simulated clock (default: 100000000)\n"
        "  --clocks-per-pixel N  simulated speed of the matcher (default: 1)\n"
        "  --max-width N         widest image (default: 1024)\n"
        "  --max-disparities N   built number of disparities (default: 64)\n"
        "  --max-block-size N    built largest block size (default: 21)\n"
        "  --hang-matcher        never finish a frame\n"
        "  --bus-error           end every frame with a bus error\n"
        "  --flash               a flash, with the firmware in it\n"
        "  --flash-protected     a flash that does not follow commands to write\n"
        "  --bad-updates         a firmware that an update brings does not work\n"
        "  --flash-busy N        polls of its status that an operation takes (default: 3)\n");
    exit(2);
}

static void parse_options(int argc, char **argv)
{
    enum { PORT, UDP_PORT, MAX_CHUNKS, MEMORY, CLOCK_HZ, CLOCKS_PER_PIXEL, MAX_WIDTH, MAX_DISPARITIES, MAX_BLOCK_SIZE,
        HANG, BUS_ERROR, STORED_ONLY, RECTIFICATION, ROWS_GONE, SKIP_PARTS, FLASH, FLASH_PROTECTED, FLASH_BUSY,
        BAD_UPDATES };
    static const struct option options[] = {
        {"port",             required_argument, NULL, PORT},
        {"udp-port",         required_argument, NULL, UDP_PORT},
        {"max-chunks",       required_argument, NULL, MAX_CHUNKS},
        {"memory",           required_argument, NULL, MEMORY},
        {"clock-hz",         required_argument, NULL, CLOCK_HZ},
        {"clocks-per-pixel", required_argument, NULL, CLOCKS_PER_PIXEL},
        {"max-width",        required_argument, NULL, MAX_WIDTH},
        {"max-disparities",  required_argument, NULL, MAX_DISPARITIES},
        {"max-block-size",   required_argument, NULL, MAX_BLOCK_SIZE},
        {"hang-matcher",     no_argument,       NULL, HANG},
        {"bus-error",        no_argument,       NULL, BUS_ERROR},
        {"stored-only",      no_argument,       NULL, STORED_ONLY},
        {"rectification",    required_argument, NULL, RECTIFICATION},
        {"rows-gone",        no_argument,       NULL, ROWS_GONE},
        {"skip-parts",       required_argument, NULL, SKIP_PARTS},
        {"flash",            no_argument,       NULL, FLASH},
        {"flash-protected",  no_argument,       NULL, FLASH_PROTECTED},
        {"flash-busy",       required_argument, NULL, FLASH_BUSY},
        {"bad-updates",      no_argument,       NULL, BAD_UPDATES},
        {NULL, 0, NULL, 0},
    };
    int option;

    while ((option = getopt_long(argc, argv, "", options, NULL)) != -1) {
        unsigned long value = optarg != NULL ? strtoul(optarg, NULL, 0) : 0;

        switch (option) {
        case PORT:             device.port = (uint16_t)value; break;
        case UDP_PORT:         device.udp_port = (uint16_t)value; break;
        case MAX_CHUNKS:       fake_frame_link.max_chunks = (uint16_t)value; break;
        case MEMORY:           device.memory_size = value; break;
        case CLOCK_HZ:         device.clock_hz = (uint32_t)value; break;
        case CLOCKS_PER_PIXEL: fake_stereo.clocks_per_pixel = (uint32_t)value; break;
        case MAX_WIDTH:        fake_stereo.max_width = (uint16_t)value; break;
        case MAX_DISPARITIES:  fake_stereo.max_disparities = (uint16_t)value; break;
        case MAX_BLOCK_SIZE:   fake_stereo.max_block_size = (uint8_t)value; break;
        case HANG:             fake_stereo.hang = true; break;
        case BUS_ERROR:        fake_stereo.bus_error = true; break;
        case STORED_ONLY:      device.stored_only = true; break;
        case RECTIFICATION:
            fake_grids.rows       = (uint16_t)value;
            fake_stereo.features |= LITESTEREO_FEATURE_RECTIFICATION;
            break;
        case ROWS_GONE:        fake_stereo.flags = 1; break;
        case SKIP_PARTS:       fake_frame_link.skips = (unsigned)value; break;
        case FLASH:            fake_flash.present = true; break;
        case FLASH_PROTECTED:  fake_flash.present = fake_flash.protect = true; break;
        case FLASH_BUSY:       fake_flash.busy_polls = (unsigned)value; break;
        case BAD_UPDATES:      device.bad_updates = true; break;
        default:               usage();
        }
    }
}

int main(int argc, char **argv)
{
    struct sigaction on_term = {.sa_handler = stop};
    uint16_t         port;

    fake_flash_reset();
    fake_flash.present = false;
    parse_options(argc, argv);
    sigaction(SIGTERM, &on_term, NULL);
    sigaction(SIGINT, &on_term, NULL);
    device.memory = mmap((void *)(uintptr_t)MEMORY_BASE, device.memory_size, PROT_READ | PROT_WRITE,
        MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED_NOREPLACE, -1, 0);
    if (device.memory == MAP_FAILED) {
        fail("mmap");
    }
    fake_stereo.clock = real_clock;
    listen_to_udp();
    fill_flash();
    if (!start()) {
        fprintf(stderr, "the firmware does not start with these options\n");
        return 1;
    }
    port = tcp_uart_listen(device.port);
    if (port == 0) {
        fail("listen");
    }
    printf("listening on 127.0.0.1:%u\n", port);
    if (device.udp_port >= 0) {
        printf("listening on udp 127.0.0.1:%u\n", (unsigned)device.udp_port);
    }
    fflush(stdout);
    if (setjmp(device.reset) != 0) {
        fake_frame_link_reset();
        if (!start()) {
            fail("reset");
        }
    }
    while (tcp_uart_wait(udp_wire_socket(), fake_frame_link_busy() || update_is_running(&device.app.update)
        || calibrate_is_running(&device.app.calibrate) || trial_status(&device.app.trial) == STATUS_BUSY)) {
        udp_wire_receive();
        app_poll(&device.app);
        tcp_uart_flush();
    }
    tcp_uart_hang_up();
    return 0;
}
