// The viewer process (T3.3.3): keeps what it receives, a display that never waits, measurements of itself.
#pragma once

#include "client/viewer/viewer_options.h"

namespace telesplat::viewer {

/// Exit code: 0 done, 1 failed while running (with end_session: also if the session ended before anything was shown), 2
/// bad usage or input. A signal ends it within 2 s: recorded frames that are not pictures by then stay in OUT/spool.
Result<int> run(ViewerOptions options);

}  // namespace telesplat::viewer
