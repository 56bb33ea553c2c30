/* Preloaded into lgd-train under mpirun: a network that is slower than the machine's, by MPI's profiling interface. A
 * sum of n bytes that begins at time t ends no sooner than max(t, the end of the sum before) + LATENCY + n / SPEED, as
 * on a link that carries one sum after the other. bench/mpi/scaling.py says what LATENCY and SPEED a ring of N ranks
 * has.
 *   LGD_LINK="LATENCY SPEED"   microseconds, bytes a microsecond
 *   LGD_LINK_LOG=FILE          at the end rank 0 writes for each bucket of a step: bytes, and the mean microseconds
 *                              from the beginning of backward to its sending, by the clock and of the thread's
 *                              processor time (which other programs do not lengthen); then "step" and a step's
 *                              processor time
 *   LGD_LINK_HOSTS=N           the ranks are as if on N hosts; with the two above each is on one of its own
 *   LGD_LINK_POISON=STEP       the last rank's loss in that step (from 1 on) is not a number */
#include <math.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MOST = 4096, LOSSES = 8 /* the sum of a step's losses has so many doubles, no other one has */ };
typedef struct sum {
    MPI_Request request;
    double ready;
} sum;
static sum under_way[MOST];
static int sums;
static double latency, speed, free_at, began, began_work, first_work;
static long step, poisoned;
static struct {
    double bytes, at, worked;
} bucket[MOST];
static int buckets, most_buckets;

static double microseconds(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}
static double now(void) { return microseconds(CLOCK_MONOTONIC); }
static double work(void) { return microseconds(CLOCK_THREAD_CPUTIME_ID); }

static void read_settings(void)
{
    const char *link = getenv("LGD_LINK"), *poison = getenv("LGD_LINK_POISON");
    if (link && sscanf(link, "%lf %lf", &latency, &speed) != 2) {
        fprintf(stderr, "LGD_LINK=\"%s\" is not \"LATENCY SPEED\"\n", link);
        MPI_Abort(MPI_COMM_WORLD, 2);
    }
    poisoned = poison ? atol(poison) : 0;
}

int MPI_Init_thread(int *argc, char ***argv, int required, int *provided)
{
    const int code = PMPI_Init_thread(argc, argv, required, provided);
    read_settings();
    return code;
}

/* Which ranks share memory. With a link or its log none do: no link delays that. */
int MPI_Comm_split_type(MPI_Comm comm, int type, int key, MPI_Info info, MPI_Comm *made)
{
    const char *hosts = getenv("LGD_LINK_HOSTS");
    int rank, ranks;
    PMPI_Comm_rank(comm, &rank);
    PMPI_Comm_size(comm, &ranks);
    if (type != MPI_COMM_TYPE_SHARED || !(hosts || speed > 0 || getenv("LGD_LINK_LOG")))
        return PMPI_Comm_split_type(comm, type, key, info, made);
    return PMPI_Comm_split(comm, hosts ? rank * atoi(hosts) / ranks : rank, key, made);
}

/* share: of the time that the whole sum of so many bytes takes. */
static void delay(MPI_Request request, double bytes, double share)
{
    if (speed <= 0 || sums == MOST) return;
    const double start = now();
    free_at = (free_at > start ? free_at : start) + share * (latency + bytes / speed);
    under_way[sums++] = (sum){request, free_at};
}

static void note(double bytes)
{
    if (buckets == MOST) return;
    bucket[buckets].bytes = bytes;
    bucket[buckets].worked += work() - began_work;
    bucket[buckets++].at += now() - began;
    if (buckets > most_buckets) most_buckets = buckets;
}

int MPI_Iallreduce(const void *from, void *to, int count, MPI_Datatype type, MPI_Op op, MPI_Comm comm,
                   MPI_Request *request)
{
    static double poison[LOSSES];
    int rank, ranks;
    if (type == MPI_DOUBLE && count == LOSSES) {
        began = now();
        began_work = work();
        if (step == 0) first_work = began_work;
        buckets = 0;
        PMPI_Comm_rank(comm, &rank);
        PMPI_Comm_size(comm, &ranks);
        if (++step == poisoned && rank == ranks - 1) {
            memcpy(poison, from, sizeof poison);
            poison[0] = NAN;
            from = poison;
        }
    }
    const int code = PMPI_Iallreduce(from, to, count, type, op, comm, request);
    if (type != MPI_FLOAT) return code;
    note(4.0 * count);
    delay(*request, 4.0 * count, 1);
    return code;
}

int MPI_Ialltoall(const void *from, int count, MPI_Datatype type, void *to, int counted, MPI_Datatype into,
                  MPI_Comm comm, MPI_Request *request)
{
    int ranks;
    const int code = PMPI_Ialltoall(from, count, type, to, counted, into, comm, request);
    PMPI_Comm_size(comm, &ranks);
    note(2.0 * count * ranks);
    delay(*request, 2.0 * count * ranks, 0.5);
    return code;
}

int MPI_Iallgather(const void *from, int count, MPI_Datatype type, void *to, int counted, MPI_Datatype into,
                   MPI_Comm comm, MPI_Request *request)
{
    int ranks;
    const int code = PMPI_Iallgather(from, count, type, to, counted, into, comm, request);
    PMPI_Comm_size(comm, &ranks);
    delay(*request, 2.0 * count * ranks, 0.5);
    return code;
}

int MPI_Test(MPI_Request *request, int *done, MPI_Status *status)
{
    for (int i = 0; i < sums; i++) {
        if (under_way[i].request != *request) continue;
        if (now() < under_way[i].ready) return PMPI_Request_get_status(*request, done, MPI_STATUS_IGNORE), *done = 0;
        const int code = PMPI_Test(request, done, status);
        if (*done) under_way[i] = under_way[--sums];
        return code;
    }
    return PMPI_Test(request, done, status);
}

int MPI_Finalize(void)
{
    const char *path = getenv("LGD_LINK_LOG");
    int rank;
    PMPI_Comm_rank(MPI_COMM_WORLD, &rank);
    FILE *f = path && rank == 0 ? fopen(path, "w") : NULL;
    for (int i = 0; f && i < most_buckets; i++)
        fprintf(f, "%.0f %.1f %.1f\n", bucket[i].bytes, bucket[i].at / (double)step, bucket[i].worked / (double)step);
    if (f) fprintf(f, "step %.1f\n", step > 1 ? (began_work - first_work) / (double)(step - 1) : 0);
    if (f && fclose(f)) perror(path);
    return PMPI_Finalize();
}
