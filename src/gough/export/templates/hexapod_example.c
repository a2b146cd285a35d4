/* hexapod_example.c - reads six leg readings from each line of standard input, prints poses.
 *
@facts@
 *
 *     echo "@home_readings@" | ./hexapod_example
 *
@license@
 */
#include "hexapod.h"

#include <stdio.h>
#include <stdlib.h>

/* Six numbers separated by spaces or commas; 0 where the line holds others. */
static int parse(const char *line, hexapod_real legs[6])
{
    for (int i = 0; i < 6; i++) {
        char *end;
        legs[i] = (hexapod_real)strtod(line, &end);
        if (end == line) return 0;
        line = end;
        while (*line == ',' || *line == ' ' || *line == '\t') line++;
    }
    return 1;
}

int main(void)
{
    hexapod_tracker tracker;
    char line[512];
    hexapod_init(&tracker, 0, 0, 0, 0); /* no pose known yet, limits as gough.Tracker has them */
    printf("x,y,z,qw,qx,qy,qz,event,status,steps\n");
    while (fgets(line, sizeof line, stdin)) {
        hexapod_real legs[6];
        if (!parse(line, legs)) {
            fprintf(stderr, "skipped, expected six numbers: %s", line);
            continue;
        }
        (void)hexapod_update(&tracker, legs);
        for (int k = 0; k < 3; k++) printf("%.9g,", (double)tracker.pose.position[k]);
        for (int k = 0; k < 4; k++) printf("%.9g,", (double)tracker.pose.wxyz[k]);
        printf("%s,%s,%d\n", hexapod_event_label(tracker.event),
               hexapod_status_label(tracker.status), tracker.info.steps);
    }
    return 0;
}
