// Options of a viewer's record.
#pragma once

#include <cstdint>
#include <string>

namespace telesplat::viewer {

/// Frames that are kept in the record.
struct KeptOptions {
  uint64_t picture_every = 0;  ///< record every N-th frame as a picture; 0: one every 2.5 s and the last one
  uint64_t verify_every = 0;   ///< keep every N-th frame for verification; 0: none
  uint64_t verify_row = 2;     ///< frames in a row that are kept each time
  bool exr = false;            ///< write pictures as EXR with depth, too
};

struct RecordOptions {
  std::string out;   ///< folder; empty: the session's, if join is set and this machine has it
  bool join = true;  ///< keep a record in the session's folder
  std::string name;  ///< the viewer's name: its folder in the session's, if another viewer records there already
  uint64_t points_mb = 1024;  ///< MiB of received data to keep at most; 0: no data are kept
};

}  // namespace telesplat::viewer
