/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Pads of the simulated SoC, as our litex_sim modules find them. */

#ifndef LITESTEREO_PADS_H
#define LITESTEREO_PADS_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "modules.h"

/* A pad's signal; null if the list has none of this name. */
static inline char *optional_pad(struct pad_list_s *list, const char *name)
{
    for (struct pad_s *pad = list->pads; pad->name; pad++) {
        if (!strcmp(pad->name, name)) {
            return pad->signal;
        }
    }
    return NULL;
}

/* A pad's signal; litex_sim ends without it, as it would run on with a module that does nothing. */
static inline char *pad(struct pad_list_s *list, const char *name)
{
    char *signal = optional_pad(list, name);

    if (!signal) {
        fprintf(stderr, "[litex_sim] %s has no pad %s\n", list->name, name);
        exit(1);
    }
    return signal;
}

#endif
