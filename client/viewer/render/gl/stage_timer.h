// How long the GPU takes for each stage of a frame.
#pragma once

#include <cstdint>
#include <vector>

namespace telesplat::gl {

/// Time stamps between a frame's stages, written by the GPU as it gets there.
class StageTimer {
 public:
  explicit StageTimer(int stages);
  ~StageTimer();
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

  /// False where the context has no time stamps (GL_QUERY_COUNTER_BITS is 0): then all results are 0.
  bool available() const { return !queries_.empty(); }
  void begin_frame();
  /// Stages run in order, from begin_frame() on; stages between this one and the last that ended took no time.
  void end_stage(int stage);
  /// Milliseconds of each stage of the frame just drawn, for which this waits.
  const std::vector<double>& results();

 private:
  std::vector<uint32_t> queries_;  // begin_frame, then one a stage
  std::vector<bool> written_;
  std::vector<double> ms_;
};

}  // namespace telesplat::gl
