/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/*
 * The litex_sim module ethernet2socket without a simulator: a substitute for the SoC sends frames on command, and
 * prints the frames that it receives. Each session has separate pads, as two Ethernet ports of a SoC have.
 *
 *   ethernet_bench CLOCK ARGUMENTS [CLOCK ARGUMENTS]
 *
 * CLOCK is sys_clk or eth_clk, which has half the frequency. Commands on the standard input, each answered with `done`:
 *
 *   send SESSION HEX           queue a frame, and a clock without a byte after it
 *   clock SESSION CLOCK        make this the module's clock, as if so many had passed
 *   run CLOCKS                 prints `frame SESSION CLOCK HEX`, CLOCK being the one of the first byte
 *   fuzz SESSION SEED FRAMES   send mutations of the frames given by `send`; nothing reaches a socket
 *   outcomes SESSION           prints the counter of each outcome
 */

#define _GNU_SOURCE

#include <sys/socket.h>

static ssize_t bench_sendto(int socket, const void *bytes, size_t length, int flags, const struct sockaddr *to,
                            socklen_t to_length);

/* The unchanged module, with access to its counters, and with noise kept away from the sockets of this machine. */
#define sendto bench_sendto
#include "ethernet2socket.c"
#undef sendto

#define MOST_SESSIONS 2
#define QUEUE         (1 << 21)
#define NO_BYTE       0x100
#define LINE          4096

struct soc {
    char source_data, source_valid, source_ready, sink_data, sink_valid;
    const char *clock_name;
    uint64_t clocks;
    void *session;
    uint16_t *queue; /* bytes and NO_BYTEs to send */
    size_t queue_start, queue_end;
    uint8_t got[2 * FRAME_MOST];
    size_t got_length;
    bool silent;
};

static struct soc socs[MOST_SESSIONS];
static size_t sessions;
static struct ext_module_s *registered;
static char sys_clk, eth_clk;
static bool bolted;
static uint64_t delivered;

static void require(bool condition, const char *what)
{
    if (!condition) {
        fprintf(stderr, "ethernet_bench: %s\n", what);
        exit(2);
    }
}

static ssize_t bench_sendto(int socket, const void *bytes, size_t length, int flags, const struct sockaddr *to,
                            socklen_t to_length)
{
    static uint8_t copy[PAYLOAD_MOST];

    if (!bolted) {
        return sendto(socket, bytes, length, flags, to, to_length);
    }
    require(length <= sizeof(copy), "a datagram longer than a frame");
    memcpy(copy, bytes, length);
    delivered++;
    return (ssize_t)length;
}

/* A rising edge in the SoC: it samples its inputs, and its outputs advance. */
static void clock_soc(struct soc *soc, size_t number)
{
    soc->clocks++;
    if (soc->sink_valid) {
        require(soc->got_length < sizeof(soc->got), "a frame without an end");
        soc->got[soc->got_length++] = (uint8_t)soc->sink_data;
    } else if (soc->got_length) {
        if (!soc->silent) {
            printf("frame %zu %llu ", number, (unsigned long long)(soc->clocks - soc->got_length));
            for (size_t i = 0; i < soc->got_length; i++) {
                printf("%02x", soc->got[i]);
            }
            putchar('\n');
        }
        soc->got_length = 0;
    }
    require(soc->source_ready || soc->clocks == 1, "not ready");
    soc->source_valid = soc->queue_start < soc->queue_end && soc->queue[soc->queue_start] != NO_BYTE;
    soc->source_data  = soc->source_valid ? (char)soc->queue[soc->queue_start] : 0x55;
    if (soc->queue_start < soc->queue_end && ++soc->queue_start == soc->queue_end) {
        soc->queue_start = soc->queue_end = 0;
    }
}

/* As litex_sim does it: clocks, circuit, modules. */
static void run(unsigned long clocks)
{
    for (unsigned long half = 0; half < 2 * clocks; half++) {
        bool eth_edge = half % 4 == 0;

        sys_clk = half % 2 == 0;
        eth_clk = half % 4 < 2;
        for (size_t i = 0; i < sessions; i++) {
            if (strcmp(socs[i].clock_name, "eth_clk") ? sys_clk : eth_edge) {
                clock_soc(&socs[i], i);
            }
        }
        for (size_t i = 0; i < sessions; i++) {
            require(registered->tick(socs[i].session, 0) == RC_OK, "tick");
        }
    }
}

static void queue_frame(struct soc *soc, const uint8_t *frame, size_t length)
{
    require(soc->queue_end + length < QUEUE, "the queue is full");
    for (size_t i = 0; i < length; i++) {
        soc->queue[soc->queue_end++] = frame[i];
    }
    soc->queue[soc->queue_end++] = NO_BYTE;
}

static size_t from_hex(const char *hex, uint8_t *bytes, size_t most)
{
    size_t length = 0;
    int used;

    while (length < most && sscanf(hex, "%2hhx%n", bytes + length, &used) == 1) {
        hex += used;
        length++;
    }
    return length;
}

static uint32_t draw(uint32_t *state, uint32_t below)
{
    *state ^= *state << 13;
    *state ^= *state >> 17;
    *state ^= *state << 5;
    return *state % below;
}

/* Most mutations are small, so that they pass many checks before they are detected; some are noise. */
static size_t mutate(uint8_t *frame, size_t length, uint32_t *state)
{
    for (uint32_t changes = draw(state, 4); changes; changes--) {
        frame[draw(state, length < 64 ? (uint32_t)length : 64)] ^= (uint8_t)(1 << draw(state, 8));
    }
    switch (draw(state, 8)) {
    case 0:
        return 1 + draw(state, (uint32_t)length);
    case 1:
        return length + draw(state, FRAME_MOST + 50 - (uint32_t)length);
    case 2:
        frame[PAYLOAD_START - UDP_HEADER - draw(state, 2)] = (uint8_t)draw(state, 256);
        return length;
    case 3:
        for (size_t i = 2 * MAC_BYTES + 2; i < length; i++) {
            frame[i] = (uint8_t)draw(state, 256);
        }
        return length;
    default:
        return length;
    }
}

static void repair_ip_checksum(uint8_t *frame)
{
    uint8_t *ip   = frame + ETHERNET_HEADER;
    size_t header = 4 * (size_t)(ip[0] & 0xf);

    put16(ip + 10, 0);
    put16(ip + 10, (uint16_t)~internet_sum(0, ip, header));
}

/*
 * The module judges frames in a buffer for the longest, where the sanitizer does not detect a read beyond the frame's
 * end: judge the frame again in a buffer of exactly its length.
 */
static void judge_in_its_own_bytes(const struct session *session, const uint8_t *frame, size_t length)
{
    size_t kept    = length < FRAME_MOST ? length : FRAME_MOST;
    uint8_t *bytes = malloc(kept);
    uint8_t answer[FRAME_LEAST];
    struct datagram datagram;
    enum verdict verdict;

    require(bytes != NULL, "no memory");
    memcpy(bytes, frame, kept);
    verdict = judge(bytes, length, &session->host, &session->settings.device, &datagram);
    if (verdict == FRAME_DATAGRAM) {
        require(datagram.payload >= bytes + PAYLOAD_START && datagram.payload + datagram.length <= bytes + kept,
                "a payload that is not in its frame");
    } else if (verdict == FRAME_ARP_REQUEST) {
        put_arp_answer(answer, bytes, &session->host);
    }
    free(bytes);
}

static void fuzz(size_t number, unsigned long seed, unsigned long frames)
{
    static uint8_t templates[8][FRAME_MOST];
    size_t lengths[8] = {0}, count = 0;
    struct soc *soc = &socs[number];
    /* Never 0, from which the generator only makes 0. */
    uint32_t state = (uint32_t)(seed % UINT32_MAX) + 1;

    for (; soc->queue_start < soc->queue_end && count < 8; soc->queue_start++) {
        if (soc->queue[soc->queue_start] == NO_BYTE) {
            count++;
        } else {
            templates[count][lengths[count]++] = (uint8_t)soc->queue[soc->queue_start];
        }
    }
    require(count > 0, "nothing to mutate");
    bolted = soc->silent = true;
    while (frames--) {
        uint8_t frame[FRAME_MOST + 64] = {0};
        uint32_t which = draw(&state, (uint32_t)count);
        size_t length;

        memcpy(frame, templates[which], lengths[which]);
        length = mutate(frame, lengths[which], &state);
        if (draw(&state, 2)) {
            repair_ip_checksum(frame);
        }
        judge_in_its_own_bytes(soc->session, frame, length);
        soc->queue_start = soc->queue_end = 0;
        queue_frame(soc, frame, length);
        run(length + 2);
    }
    run(100);
    bolted = soc->silent = false;
    printf("delivered %llu\n", (unsigned long long)delivered);
}

static void print_outcomes(const struct session *session)
{
    printf("outcomes");
    for (size_t i = 0; i < OUTCOMES; i++) {
        printf(" %llu", (unsigned long long)session->outcomes[i]);
    }
    putchar('\n');
}

static void obey(const char *line)
{
    static uint8_t frame[LINE / 2];
    unsigned long number, clocks, seed;
    int used = 0;

    if (sscanf(line, "run %lu", &clocks) == 1) {
        run(clocks);
    } else if (sscanf(line, "send %lu %n", &number, &used) == 1 && number < sessions) {
        queue_frame(&socs[number], frame, from_hex(line + used, frame, sizeof(frame)));
    } else if (sscanf(line, "fuzz %lu %lu %lu", &number, &seed, &clocks) == 3 && number < sessions) {
        fuzz(number, seed, clocks);
    } else if (sscanf(line, "clock %lu %lu", &number, &clocks) == 2 && number < sessions) {
        ((struct session *)socs[number].session)->clocks = clocks;
    } else if (sscanf(line, "outcomes %lu", &number) == 1 && number < sessions) {
        print_outcomes(socs[number].session);
    } else {
        require(false, line);
    }
    puts("done");
    fflush(stdout);
}

static void add_session(struct soc *soc, const char *clock_name, char *arguments)
{
    struct pad_s clocks[][2] = {{{"sys_clk", 1, &sys_clk}, {0}}, {{"eth_clk", 1, &eth_clk}, {0}}};
    struct pad_s pads[] = {
        {"source_valid", 1, &soc->source_valid}, {"source_ready", 1, &soc->source_ready},
        {"source_data", 8, &soc->source_data}, {"sink_valid", 1, &soc->sink_valid},
        {"sink_data", 8, &soc->sink_data}, {0},
    };
    struct pad_list_s lists[] = {{.name = "eth", .pads = pads}, {.name = "sys_clk", .pads = clocks[0]},
                                 {.name = "eth_clk", .pads = clocks[1]}};

    soc->clock_name = clock_name;
    soc->queue      = calloc(QUEUE, sizeof(*soc->queue));
    require(soc->queue && registered->new_sess(&soc->session, arguments) == RC_OK, "no session");
    for (size_t i = 0; i < sizeof(lists) / sizeof(lists[0]); i++) {
        require(registered->add_pads(soc->session, &lists[i]) == RC_OK, "add_pads");
    }
}

static int take_module(struct ext_module_s *offered)
{
    registered = offered;
    return RC_OK;
}

int main(int count, char **arguments)
{
    static char line[LINE];

    litex_sim_ext_module_init(take_module);
    require(registered && !strcmp(registered->name, "ethernet2socket"), "no module");
    registered->start(NULL);
    for (int i = 1; i + 1 < count && sessions < MOST_SESSIONS; i += 2) {
        add_session(&socs[sessions++], arguments[i], *arguments[i + 1] ? arguments[i + 1] : NULL);
    }
    while (fgets(line, sizeof(line), stdin)) {
        obey(line);
    }
    return 0;
}
