// Reads any bytes as a file of a run folder that is read again: events of points, slice frames, displayed
// frames on their way to the disk. The first byte chooses.
#include "client/viewer/record/event_record.h"
#include "client/viewer/record/frame_spool.h"
#include "client/viewer/record/slice_record.h"
#include "tests/support/files/memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace telesplat;
  if (size == 0) return 0;
  const test::MemoryFile file({data + 1, size - 1});
  switch (data[0] % 3) {
    case 0: {
      const auto replay = viewer::EventReplay::open(file.path(), size % 2 == 1);
      if (!replay.ok()) return 0;
      for (uint64_t s = 0; s < 20; ++s)
        if (!(*replay)->advance(Sequence{s}).ok()) return 0;
      if (!(*replay)->next_replica().ok()) return 0;
      (void)(*replay)->advance(Sequence{~uint64_t{0}});
      if ((*replay)->model()) (*replay)->model()->digest();
      return 0;
    }
    case 1: {
      const auto replay = viewer::SliceReplay::open(file.path());
      if (!replay.ok()) return 0;
      for (uint64_t f = 1; f < 5; ++f)
        if (const auto there = (*replay)->advance(FrameId{f}, 0); !there.ok() || !*there) return 0;
      (void)(*replay)->advance(FrameId{~uint64_t{0}}, 1);
      return 0;
    }
    default:
      (void)viewer::read_spooled_frame(file.path());
      return 0;
  }
}
