/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/*
 * Ethernet, ARP, IPv4 and UDP, as far as a host needs them to talk UDP with one device. Frames have neither preamble
 * nor FCS. Each field of a received frame is checked against the received bytes before it is used.
 */

#ifndef FRAMES_H
#define FRAMES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define FRAME_LEAST 60
#define FRAME_MOST  1514

#define MAC_BYTES       6
#define ETHERNET_HEADER 14
#define IP_HEADER       20
#define UDP_HEADER      8
#define PAYLOAD_START   (ETHERNET_HEADER + IP_HEADER + UDP_HEADER)
#define PAYLOAD_MOST    (FRAME_MOST - PAYLOAD_START)

#define TYPE_IP      0x0800
#define TYPE_ARP     0x0806
#define ARP_REQUEST  1
#define ARP_ANSWER   2
#define PROTOCOL_UDP 17

struct station {
    uint8_t mac[MAC_BYTES];
    uint32_t address;
    uint16_t port;
};

/* Kinds of frames; from FRAME_SHORT on, a host or the wire would discard them. */
enum verdict {
    FRAME_DATAGRAM,
    FRAME_ARP_REQUEST,
    FRAME_OTHER,
    FRAME_SHORT,
    FRAME_LONG,
    FRAME_IP_LENGTH,
    FRAME_IP_CHECKSUM,
    FRAME_FRAGMENT,
    FRAME_UDP_LENGTH,
    FRAME_UDP_CHECKSUM,
    FRAME_SENDER,
    FRAME_VERDICTS,
};

struct datagram {
    uint16_t port;
    const uint8_t *payload;
    size_t length;
};

static inline uint16_t get16(const uint8_t *bytes)
{
    return (uint16_t)(bytes[0] << 8 | bytes[1]);
}

static inline uint32_t get32(const uint8_t *bytes)
{
    return (uint32_t)get16(bytes) << 16 | get16(bytes + 2);
}

static inline void put16(uint8_t *bytes, uint16_t value)
{
    bytes[0] = (uint8_t)(value >> 8);
    bytes[1] = (uint8_t)value;
}

static inline void put32(uint8_t *bytes, uint32_t value)
{
    put16(bytes, (uint16_t)(value >> 16));
    put16(bytes + 2, (uint16_t)value);
}

/* Sum of the Internet checksum (RFC 1071); over bytes that hold their own checksum it is 0xffff. */
static inline uint16_t internet_sum(uint32_t sum, const uint8_t *bytes, size_t length)
{
    for (size_t i = 0; i < length; i++) {
        sum += i % 2 ? bytes[i] : (uint32_t)bytes[i] << 8;
    }
    while (sum >> 16) {
        sum = (sum & 0xffff) + (sum >> 16);
    }
    return (uint16_t)sum;
}

static inline void put_ethernet_header(uint8_t *frame, const uint8_t *to, const uint8_t *from, uint16_t type)
{
    memcpy(frame, to, MAC_BYTES);
    memcpy(frame + MAC_BYTES, from, MAC_BYTES);
    put16(frame + 2 * MAC_BYTES, type);
}

static inline size_t padded(uint8_t *frame, size_t length)
{
    if (length < FRAME_LEAST) {
        memset(frame + length, 0, FRAME_LEAST - length);
        return FRAME_LEAST;
    }
    return length;
}

/* Build a frame around a payload of at most PAYLOAD_MOST bytes at `frame + PAYLOAD_START`; the result is its length. */
static inline size_t put_datagram(uint8_t *frame, const struct station *from, const struct station *to, size_t length)
{
    uint8_t *ip  = frame + ETHERNET_HEADER;
    uint8_t *udp = ip + IP_HEADER;

    put_ethernet_header(frame, to->mac, from->mac, TYPE_IP);
    put16(ip, 0x4500);
    put16(ip + 2, (uint16_t)(IP_HEADER + UDP_HEADER + length));
    /* No identification, as the frame may not be fragmented (RFC 6864). */
    put32(ip + 4, 0x4000);
    ip[8] = 64;
    ip[9] = PROTOCOL_UDP;
    put16(ip + 10, 0);
    put32(ip + 12, from->address);
    put32(ip + 16, to->address);
    put16(ip + 10, (uint16_t)~internet_sum(0, ip, IP_HEADER));

    put16(udp, from->port);
    put16(udp + 2, to->port);
    put16(udp + 4, (uint16_t)(UDP_HEADER + length));
    put16(udp + 6, 0);
    return padded(frame, PAYLOAD_START + length);
}

/* Build the answer of `host` to an ARP request that `judge` has found to be one; the result is its length. */
static inline size_t put_arp_answer(uint8_t *frame, const uint8_t *request, const struct station *host)
{
    const uint8_t *asked  = request + ETHERNET_HEADER;
    uint8_t       *answer = frame + ETHERNET_HEADER;

    put_ethernet_header(frame, asked + 8, host->mac, TYPE_ARP);
    memcpy(answer, asked, 6);
    put16(answer + 6, ARP_ANSWER);
    memcpy(answer + 8, host->mac, MAC_BYTES);
    put32(answer + 14, host->address);
    memcpy(answer + 18, asked + 8, MAC_BYTES + 4);
    return padded(frame, ETHERNET_HEADER + 28);
}

static inline enum verdict judge_arp(const uint8_t *arp, const struct station *host)
{
    static const uint8_t request[] = {0, 1, TYPE_IP >> 8, TYPE_IP & 0xff, MAC_BYTES, 4, 0, ARP_REQUEST};
    bool asks = !memcmp(arp, request, sizeof(request)) && get32(arp + 24) == host->address;

    return asks ? FRAME_ARP_REQUEST : FRAME_OTHER;
}

/* `udp` has `length` bytes; the IPv4 header at `ip`, with the addresses, is already checked. */
static inline enum verdict judge_udp(const uint8_t *ip, const uint8_t *udp, size_t length, const struct station *device,
                                     struct datagram *datagram)
{
    uint32_t addresses;

    if (length < UDP_HEADER || get16(udp + 4) != length) {
        return FRAME_UDP_LENGTH;
    }
    addresses = internet_sum(PROTOCOL_UDP + (uint32_t)length, ip + 12, 8);
    if (get16(udp + 6) && internet_sum(addresses, udp, length) != 0xffff) {
        return FRAME_UDP_CHECKSUM;
    }
    /* A socket that is connected to the device would not receive it. */
    if (get32(ip + 12) != device->address || get16(udp) != device->port) {
        return FRAME_SENDER;
    }
    *datagram = (struct datagram){.port = get16(udp + 2), .payload = udp + UDP_HEADER, .length = length - UDP_HEADER};
    return FRAME_DATAGRAM;
}

/* `room` bytes were received, with padding: the packet's header has its length. */
static inline enum verdict judge_ip(const uint8_t *ip, size_t room, const struct station *host,
                                    const struct station *device, struct datagram *datagram)
{
    size_t header = 4 * (size_t)(ip[0] & 0xf);
    size_t total  = get16(ip + 2);

    if (ip[0] >> 4 != 4 || header < IP_HEADER || total < header || total > room) {
        return FRAME_IP_LENGTH;
    }
    if (internet_sum(0, ip, header) != 0xffff) {
        return FRAME_IP_CHECKSUM;
    }
    if (get32(ip + 16) != host->address || ip[9] != PROTOCOL_UDP) {
        return FRAME_OTHER;
    }
    if (get16(ip + 6) & 0x3fff) {
        return FRAME_FRAGMENT;
    }
    return judge_udp(ip, ip + header, total - header, device, datagram);
}

/* Judge a frame from the device for `host`. Of a frame longer than FRAME_MOST only the length is used. */
static inline enum verdict judge(const uint8_t *frame, size_t length, const struct station *host,
                                 const struct station *device, struct datagram *datagram)
{
    static const uint8_t broadcast[MAC_BYTES] = {0xff, 0xff, 0xff, 0xff, 0xff, 0xff};
    uint16_t type;
    bool mine;

    if (length < FRAME_LEAST || length > FRAME_MOST) {
        return length < FRAME_LEAST ? FRAME_SHORT : FRAME_LONG;
    }
    type = get16(frame + 2 * MAC_BYTES);
    mine = !memcmp(frame, host->mac, MAC_BYTES);
    if (type == TYPE_ARP && (mine || !memcmp(frame, broadcast, MAC_BYTES))) {
        return judge_arp(frame + ETHERNET_HEADER, host);
    }
    if (type == TYPE_IP && mine) {
        return judge_ip(frame + ETHERNET_HEADER, length - ETHERNET_HEADER, host, device, datagram);
    }
    return FRAME_OTHER;
}

#endif
