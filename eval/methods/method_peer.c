/* peer: another program's maps, of sets that have them. */
#include "eval/methods/method.h"
#include <string.h>

static ts_code run(ev_estimator *e, const ev_case *c, ev_seen seen, void *user, ts_status *st)
{
    (void)e;
    if (!c->peer) return ts_fail(st, TS_INVALID, "has no peer's maps");
    seen(0, c->peer->maps, MAP_CHANNELS, user);
    return TS_OK;
}

static const ev_setting settings[] = {{0}};
const ev_method ev_method_peer = {.name = "peer",
                                  .help = "another program's maps, of sets that have them",
                                  .settings = settings,
                                  .peer = true,
                                  .run = run};
