/* The control groups that bound the process (Linux, version 2; of version 1 what a container sees as its root). */
#ifndef TS_CGROUP_H
#define TS_CGROUP_H

/* Calls visit with the folder of each group that may bound the process: its own and those above, and the root that a
 * container sees. A group may be visited twice. */
void ts_cgroup_each(void (*visit)(const char *folder, void *user), void *user);
#endif
